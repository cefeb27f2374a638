// SPDX-License-Identifier: BSD-3-Clause
// Whole problems in one HDF5 file (docs/files.md) through the module delassus_problem_hdf5, which the first HDF5 file
// loads. Runs of several processes read their parts instead (delassus/partitioned_files.hpp).
#pragma once

#include <filesystem>

#include "delassus/problem.hpp"

namespace delassus {

/// Whether the file says that it is one; false for all else, damaged and missing files among it.
bool is_problem_hdf5(const std::filesystem::path& file);
/// Throw InputError, also if this build has no HDF5 or if the problem has more than 32-bit indices can number.
Problem read_problem_hdf5(const std::filesystem::path& file);
void write_problem_hdf5(const Problem& problem, const std::filesystem::path& file);

}  // namespace delassus

// The module is built together with libdelassus, so C++ types may cross here.
struct DelassusWholeProblemHdf5 {
    bool (*is_problem)(const std::filesystem::path& file);
    void (*read)(const std::filesystem::path& file, delassus::Problem& problem);
    void (*write)(const delassus::Problem& problem, const std::filesystem::path& file);
};
extern "C" {
using DelassusWholeProblemHdf5Functions = void (*)(DelassusWholeProblemHdf5& functions);
}
