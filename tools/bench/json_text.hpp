// SPDX-License-Identifier: BSD-3-Clause
// JSON as this folder writes and reads it.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "support/json_number.hpp"

namespace delassus::bench {

using Json = nlohmann::ordered_json;

/// The inverse of json_number(): null is NaN.
inline double number_of(const Json& json) {
    return json.is_number() ? json.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

/// Bytes that are no UTF-8 (a plugin's message may hold any) are replaced.
inline std::string text_of(const Json& json, int indent = -1) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace delassus::bench
