// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "delassus/export.hpp"

namespace delassus {

/// The absolute folder, links resolved, that libdelassus was loaded from. Modules and plugins are found from there:
/// <folder>/delassus and <folder>/delassus/plugins, in the build tree and in an install tree. Throws Error if the
/// loader does not know it.
DELASSUS_API std::filesystem::path library_directory();

}  // namespace delassus
