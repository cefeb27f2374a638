// SPDX-License-Identifier: BSD-3-Clause
// Problem folders: problem.json, H.mtx, D.mtx, E.mtx, a.mtx, b.mtx.
#pragma once

#include <filesystem>

#include "delassus/problem.hpp"

namespace delassus {

/// Reads and validates. Memory stays in proportion to the files: without a.mtx (b.mtx), n (m) is at most a million.
Problem read_problem_folder(const std::filesystem::path& folder);

/// The problem must be valid. A matrix or vector of zeros gets no file, unless its size needs one.
void write_problem_folder(const Problem& problem, const std::filesystem::path& folder);

/// The last name of a path, also of "folder/" and "."; without the extension if it is a file's.
std::string problem_name(const std::filesystem::path& path, bool strip_extension);

}  // namespace delassus
