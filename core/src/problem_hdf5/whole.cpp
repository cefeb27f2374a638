// SPDX-License-Identifier: BSD-3-Clause
#include "problem_hdf5/whole.hpp"

#include <fmt/format.h>

#include <limits>

#include "delassus/error.hpp"
#include "problem_hdf5/problem_hdf5.hpp"
#include "support/call_in_child.hpp"

namespace delassus::problem_hdf5 {

bool is_problem(const std::filesystem::path& file) {
    constexpr unsigned seconds = 20;
    try {
        return call_in_child(file, "HDF5", seconds, [&] {
                   const hdf5::Silence silence;
                   const hdf5::Handle opened(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
                   const hdf5::Group root(hdf5::Handle(H5Gopen2(opened.get(), "/", H5P_DEFAULT)), file.string(), "", 0);
                   return std::string(root.attribute_text("format") == problem_format ? "yes" : "no");
               }) == "yes";
    } catch (const InputError&) {
        return false;
    }
}

namespace {

SparseMatrix narrow(LocalMatrix& matrix) {
    SparseMatrix narrow;
    narrow.rows = static_cast<std::int32_t>(matrix.rows);
    narrow.columns = static_cast<std::int32_t>(matrix.columns);
    narrow.row_start.assign(matrix.row_start.begin(), matrix.row_start.end());
    narrow.column.assign(matrix.column.begin(), matrix.column.end());
    narrow.value = std::move(matrix.value);
    matrix = {};
    return narrow;
}

}  // namespace

void read_whole(const std::filesystem::path& file, Problem& problem) {
    PartitionedProblem part;
    FileTraffic traffic;
    read(*single_process(), file, part, traffic);
    const std::int64_t largest = std::max({part.n(), part.m(), part.H.entries(), part.D.entries(), part.E.entries()});
    if (largest > std::numeric_limits<std::int32_t>::max())
        throw InputError(
            fmt::format("{} holds up to {} entries of one kind, more than the 2147483647 that a whole problem may "
                        "have; read it in parts, by mpirun with more processes.",
                        file.string(), largest));
    problem.name = std::move(part.name);
    problem.law = part.law;
    problem.source = std::move(part.source);
    problem.notes = std::move(part.notes);
    problem.H = narrow(part.H);
    problem.D = narrow(part.D);
    problem.E = narrow(part.E);
    problem.a = std::move(part.a);
    problem.b = std::move(part.b);
    problem.cones = std::move(part.cones);
    validate(problem);
}

void write_whole(const Problem& problem, const std::filesystem::path& file) {
    const auto single = single_process();
    FileTraffic traffic;
    write(*single, part_of(*single, problem), file, traffic);
}

}  // namespace delassus::problem_hdf5
