// SPDX-License-Identifier: BSD-3-Clause
// Problems and solutions on disk (docs/files.md): problem folders (problem.json and Matrix Market files), problems in
// one HDF5 file, FCLib HDF5 files (local and global), solution folders.
//
// Readers check everything and throw InputError with one sentence that names the file. Writers write beside the target
// and rename, so that nothing half-written is ever seen.
#pragma once

#include <filesystem>
#include <string>

#include "delassus/export.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// Reads a problem folder, or, if the path is a file that ends in .h5 or .hdf5, a problem in one HDF5 file or an FCLib
/// file, whichever its content says. The result is validated.
DELASSUS_API Problem read_problem(const std::filesystem::path& path);

/// Writes a problem in one HDF5 file if the path ends in .h5, an FCLib file if it ends in .hdf5, else a problem folder.
/// FCLib holds friction cones of one
/// dimension and, globally, free rows; other problems are refused with InputError.
DELASSUS_API void write_problem(const Problem& problem, const std::filesystem::path& path);

/// Reads x.mtx and lambda.mtx of a solution folder and checks their sizes against n and m.
DELASSUS_API Solution read_solution(const std::filesystem::path& folder, std::int32_t n, std::int32_t m);

/// Writes x.mtx and lambda.mtx, and report.json if report is not empty.
DELASSUS_API void write_solution(const Solution& solution, const std::string& report,
                                 const std::filesystem::path& folder);

}  // namespace delassus
