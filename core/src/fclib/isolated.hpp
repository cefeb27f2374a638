// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "delassus/problem.hpp"

namespace delassus::fclib {

/// As read_file(), but HDF5 does its work in a child process. HDF5 1.10 reads and writes beyond its memory on some
/// damaged files (a fuzzer needs seconds to find one); so the child dies, and the caller gets an InputError.
Problem read_isolated(const std::filesystem::path& file);

}  // namespace delassus::fclib
