// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "delassus/problem.hpp"

namespace delassus::fclib {

/// As read_file(), but in a child process (hdf5/isolated.hpp).
Problem read_isolated(const std::filesystem::path& file);

}  // namespace delassus::fclib
