// SPDX-License-Identifier: BSD-3-Clause
// Reading and writing JSON, compiled once: nlohmann's parser and writer take seconds wherever they are used.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "delassus/export.hpp"

namespace delassus {

/// Keys in alphabetical order. Throws nlohmann::json::parse_error.
DELASSUS_API nlohmann::json parse_json(std::string_view text);

/// Keys in the order of the text. Throws nlohmann::json::parse_error.
DELASSUS_API nlohmann::ordered_json parse_ordered_json(std::string_view text);

/// The same, and a discarded value instead of an exception.
DELASSUS_API nlohmann::ordered_json try_parse_ordered_json(std::string_view text);

/// On one line, or with an indent. Bytes that are no UTF-8 (a plugin's message may hold any) are replaced.
DELASSUS_API std::string json_text(const nlohmann::ordered_json& json, int indent = -1);

}  // namespace delassus
