// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "delassus/problem.hpp"

namespace delassus::problem_hdf5 {

/// See problem/problem_hdf5_loader.hpp.
bool is_problem(const std::filesystem::path& file);
void read_whole(const std::filesystem::path& file, Problem& problem);
void write_whole(const Problem& problem, const std::filesystem::path& file);

}  // namespace delassus::problem_hdf5
