// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "delassus/export.hpp"

namespace delassus {

/// Runs work() in a child process and returns its bytes: some libraries crash or hang on damaged files. What work()
/// prints is dropped. Throws InputError with the sentence of an exception of work(), or one that says that the library
/// failed on the file or used more than `seconds` of processor time. Throws std::bad_alloc if work() does.
DELASSUS_API std::string call_in_child(const std::filesystem::path& file, const char* library, unsigned seconds,
                                       const std::function<std::string()>& work);

/// Runs work(), which writes the file and returns how many bytes, in a child process: some libraries crash when memory
/// or the disk runs out, at once or where the process ends. Throws as the function above.
DELASSUS_API std::int64_t write_in_child(const std::filesystem::path& file, const char* library,
                                         const std::function<std::int64_t()>& work);

}  // namespace delassus
