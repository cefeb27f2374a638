// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "delassus/export.hpp"

namespace delassus {

/// "linux_x86_64": what libraries of this process are built for.
DELASSUS_API std::string this_platform();

/// The same of a shared library, from the head of the file, which is not loaded; empty if it is none, or of a machine
/// without a name here. Throws InputError if it cannot be read.
DELASSUS_API std::string platform_of_library(const std::filesystem::path& library);

}  // namespace delassus
