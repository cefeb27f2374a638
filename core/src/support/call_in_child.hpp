// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "delassus/export.hpp"

namespace delassus {

/// The bytes that work() returns, which runs in a child process: for libraries that crash or do not end on damaged
/// files. What work() prints goes nowhere. Throws InputError with the sentence of an exception of work(), or one that
/// says that the library fails on the file, or used more than `seconds` of processor time; std::bad_alloc if work()
/// does.
DELASSUS_API std::string call_in_child(const std::filesystem::path& file, const char* library, unsigned seconds,
                                       const std::function<std::string()>& work);

/// Runs work(), which writes the file, in a child process: for libraries that crash where memory or the disk ends.
/// Throws likewise.
DELASSUS_API void write_in_child(const std::filesystem::path& file, const char* library,
                                 const std::function<void()>& work);

}  // namespace delassus
