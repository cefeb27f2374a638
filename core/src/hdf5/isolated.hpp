// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>

#include "hdf5/message.hpp"

namespace delassus::hdf5 {

/// Lets `read` look into the file and pack what it finds in a child process, and gives what was packed to `take`.
/// HDF5 1.10 reads and writes beyond its memory on some damaged files (a fuzzer needs seconds to find one); so the
/// child dies, and the caller gets an InputError. It gets one too, with the same sentence, if `read` throws any, and if
/// `take` does not use up exactly what was packed.
void read_isolated(const std::filesystem::path& file, const std::function<void(Packer&)>& read,
                   const std::function<void(Unpacker&)>& take);

}  // namespace delassus::hdf5
