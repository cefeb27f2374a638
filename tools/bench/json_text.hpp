// SPDX-License-Identifier: BSD-3-Clause
// JSON as this folder writes and reads it.
#pragma once

#include <limits>

#include "support/json.hpp"
#include "support/json_number.hpp"

namespace delassus::bench {

using Json = nlohmann::ordered_json;
using delassus::json_text;  // beside those of this folder

/// The inverse of json_number(): null is NaN.
inline double number_of(const Json& json) {
    return json.is_number() ? json.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace delassus::bench
