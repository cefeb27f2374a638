// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "delassus/plugin_info.hpp"

namespace delassus {

/// The file by which a package of Python is its own module.
inline constexpr const char* package_file = "__init__.py";

/// What read_sidecar() does with the text of the file. Throws PluginError with a sentence.
DELASSUS_API PluginInfo parse_sidecar(const std::string& text, const std::filesystem::path& sidecar);

}  // namespace delassus
