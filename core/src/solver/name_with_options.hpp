// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "delassus/export.hpp"
#include "delassus/plugin_info.hpp"

namespace delassus {

/// "name" or "name(key=value,key=value)"; what names the thing in messages. Throws InputError.
struct NameWithOptions {
    std::string name;
    OptionTexts options;
};
DELASSUS_API NameWithOptions parse_name_with_options(std::string_view text, std::string_view what);

}  // namespace delassus
