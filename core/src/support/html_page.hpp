// SPDX-License-Identifier: BSD-3-Clause
// Pages in a single file. Their parts stand beside libdelassus (tools/pages puts them there).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "delassus/export.hpp"

namespace delassus {

/// The folder of the parts.
DELASSUS_API std::filesystem::path page_parts();

/// The page of that file name in the folder `parts`. In place of @name.js@ and @name.css@ stands the content of that
/// file, in place of @data@ the JSON text; what is put in is not looked at for marks. The page holds each mark inside a
/// script or style element, which nothing in a script or in the data can end. Throws InputError if a part is missing.
DELASSUS_API std::string html_page(const std::filesystem::path& parts, const std::string& name, std::string_view json);

}  // namespace delassus
