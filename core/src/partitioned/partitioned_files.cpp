// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/partitioned_files.hpp"

#include "delassus/error.hpp"
#include "partitioned/problem_hdf5_module.hpp"
#include "problem/problem_hdf5_loader.hpp"
#include "support/module.hpp"

namespace delassus {

namespace {

const DelassusProblemHdf5& files() {
    static const DelassusProblemHdf5 functions = [] {
        DelassusProblemHdf5 found{};
        reinterpret_cast<DelassusProblemHdf5Functions>(module_symbol("delassus_problem_hdf5", "delassus_problem_hdf5",
                                                                     "problems in one file cannot be read or written",
                                                                     "HDF5", "; use problem folders"))(found);
        return found;
    }();
    return functions;
}

/// The module, on all processes or on none.
const DelassusProblemHdf5& files(const Communicator& communicator) {
    together(communicator, [] { files(); });
    return files();
}

}  // namespace

bool is_partitioned_file(const std::filesystem::path& path) {
    return is_problem_hdf5(path);
}

PartitionedProblem read_partitioned(const Communicator& communicator, const std::filesystem::path& path,
                                    FileTraffic* traffic) {
    PartitionedProblem part;
    FileTraffic moved;
    files(communicator).read(communicator, path, part, traffic == nullptr ? moved : *traffic);
    return part;
}

void write_partitioned(const Communicator& communicator, const PartitionedProblem& part,
                       const std::filesystem::path& path, FileTraffic* traffic) {
    FileTraffic moved;
    files(communicator).write(communicator, part, path, traffic == nullptr ? moved : *traffic);
}

void write_partitioned_solution(const Communicator& communicator, const std::filesystem::path& path,
                                const PartitionedProblem& part, const std::vector<double>& x,
                                const std::vector<double>& lambda, const std::string& report_json,
                                FileTraffic* traffic) {
    FileTraffic moved;
    files(communicator)
        .write_solution(communicator, path, part, x, lambda, report_json, traffic == nullptr ? moved : *traffic);
}

Solution read_partitioned_solution(const Communicator& communicator, const std::filesystem::path& path,
                                   const PartitionedProblem& part, FileTraffic* traffic) {
    Solution own;
    FileTraffic moved;
    files(communicator).read_solution(communicator, path, part, own, traffic == nullptr ? moved : *traffic);
    return own;
}

PartitionedFileSummary inspect_partitioned(const Communicator& communicator, const std::filesystem::path& path) {
    PartitionedFileSummary summary;
    files(communicator).inspect(communicator, path, summary);
    return summary;
}

}  // namespace delassus
