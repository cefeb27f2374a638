// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace delassus {

/// Whether a text that stands for a plugin is the path of its library rather than its name: it has a slash or ends
/// in .so.
inline bool is_library_path(std::string_view text) {
    return text.find('/') != std::string_view::npos || text.ends_with(".so");
}

}  // namespace delassus
