// SPDX-License-Identifier: BSD-3-Clause
// Rejected plugins in words.
#pragma once

#include <string>

#include "delassus/registry.hpp"

namespace delassus {

/// "path: reason", without the path before a reason that begins with it.
[[nodiscard]] inline std::string sentence_of(const RejectedPlugin& plugin) {
    const std::string path = plugin.path.string();
    return plugin.reason.starts_with(path) ? plugin.reason : path + ": " + plugin.reason;
}

}  // namespace delassus
