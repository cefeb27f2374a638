// SPDX-License-Identifier: BSD-3-Clause
// Plugins that `delassus plugins install` has put into a folder of their own: <plugin folder>/<name>/ with a manifest.
// The folder's mark (support/output_folder.hpp) tells them from what others have put there.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "delassus/plugin_info.hpp"

namespace delassus {

/// The kind in the mark of such a folder.
inline constexpr const char* plugin_kind = "plugin";

/// The folders in `folder` that hold an installed plugin, by ascending name.
DELASSUS_API std::vector<std::filesystem::path> installed_plugins(const std::filesystem::path& folder);

/// "crc32:1a2b3c4d". It tells damage, and is no signature: who can write the file can write its manifest, too. Throws
/// InputError if the file cannot be read.
DELASSUS_API std::string checksum_of_file(const std::filesystem::path& file);

/// Throws PluginError with a sentence if a file whose checksum the manifest holds is missing or another one.
DELASSUS_API void require_checksums(const PluginInfo& info);

}  // namespace delassus
