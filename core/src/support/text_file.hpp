// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "delassus/export.hpp"

namespace delassus {

/// The whole content of a regular file, byte by byte. Throws InputError if it is absent, no regular file, or
/// unreadable.
DELASSUS_API std::string read_file(const std::filesystem::path& path);

}  // namespace delassus
