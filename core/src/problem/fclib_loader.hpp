// SPDX-License-Identifier: BSD-3-Clause
// FCLib HDF5 files through the module delassus_fclib, which the first such file loads. So HDF5 is mapped only into
// processes that read or write one.
#pragma once

#include <filesystem>
#include <mutex>
#include <string>

#include "delassus/problem.hpp"

namespace delassus {

/// Throws InputError if this build has no HDF5.
Problem read_fclib(const std::filesystem::path& file);
void write_fclib(const Problem& problem, const std::filesystem::path& file);

/// Held while HDF5 works: its serial library is not safe for several threads.
std::mutex& hdf5_mutex();

}  // namespace delassus

// The module is built together with libdelassus, so C++ types may cross here.
extern "C" {
using DelassusFclibRead = void (*)(const std::filesystem::path& file, delassus::Problem& problem);
using DelassusFclibWrite = void (*)(const delassus::Problem& problem, const std::filesystem::path& file,
                                    const std::string& name_in_messages);
}
