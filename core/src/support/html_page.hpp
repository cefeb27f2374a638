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

/// The page of that file name in the folder `parts`. The marks @name.js@ and @name.css@ are replaced by the content of
/// those files, @data@ by the JSON text; inserted text is not searched for marks. The page holds each mark inside a
/// script or style element, which no script and no data can close. Throws InputError if a part is missing.
DELASSUS_API std::string html_page(const std::filesystem::path& parts, const std::string& name, std::string_view json);

}  // namespace delassus
