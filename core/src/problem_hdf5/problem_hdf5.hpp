// SPDX-License-Identifier: BSD-3-Clause
// What partitioned_files.hpp promises, where HDF5 is linked. All are collective.
#pragma once

#include "problem_hdf5/problem_file.hpp"

namespace delassus::problem_hdf5 {

void read(const Communicator& communicator, const std::filesystem::path& path, PartitionedProblem& part,
          FileTraffic& traffic);
void write(const Communicator& communicator, const PartitionedProblem& part, const std::filesystem::path& path,
           FileTraffic& traffic);
void read_solution(const Communicator& communicator, const std::filesystem::path& path, const PartitionedProblem& part,
                   Solution& own, FileTraffic& traffic);
void write_solution(const Communicator& communicator, const std::filesystem::path& path, const PartitionedProblem& part,
                    const std::vector<double>& x, const std::vector<double>& lambda, const std::string& report_json,
                    FileTraffic& traffic);
void inspect(const Communicator& communicator, const std::filesystem::path& path, PartitionedFileSummary& summary);

}  // namespace delassus::problem_hdf5
