// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>

#include "hdf5/message.hpp"

namespace delassus::hdf5 {

/// Runs `read` in a child process, where it packs what it finds in the file, and gives what was packed to `take`. HDF5
/// 1.10 reads and writes beyond its memory on some damaged files (a fuzzer finds one within seconds). Then only the
/// child dies, and the caller gets an InputError. If `read` throws an InputError, the caller gets one with the same
/// sentence. It also gets one if `take` does not use up exactly what was packed.
void read_isolated(const std::filesystem::path& file, const std::function<void(Packer&)>& read,
                   const std::function<void(Unpacker&)>& take);

}  // namespace delassus::hdf5
