// SPDX-License-Identifier: BSD-3-Clause
// Every file that is read goes through here, or is checked here before a library reads it: a pipe or a device would
// hang the reader, or never end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

#include "delassus/export.hpp"

namespace delassus {

/// Throws InputError if the file is absent, no regular file, or unreadable.
DELASSUS_API void require_regular_file(const std::filesystem::path& path);

/// The whole content of a regular file, byte by byte. Throws InputError as require_regular_file(), and if it has more
/// than `most` bytes.
DELASSUS_API std::string read_file(const std::filesystem::path& path,
                                   std::uint64_t most = std::numeric_limits<std::uint64_t>::max());

/// What no text that people or this program write by hand exceeds: configurations, lists, sidecars.
inline constexpr std::uint64_t most_bytes_of_text = 16U << 20U;

}  // namespace delassus
