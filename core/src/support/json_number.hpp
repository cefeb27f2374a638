// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace delassus {

/// JSON has no infinities and no NaN: they become null.
inline nlohmann::ordered_json json_number(double value) {
    using Json = nlohmann::ordered_json;
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

}  // namespace delassus
