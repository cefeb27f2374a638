// SPDX-License-Identifier: BSD-3-Clause
// JSON as this folder writes and reads it.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "delassus/errors.hpp"
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

inline Json json_of(const Errors& error) {
    return {{"natural", json_number(error.natural)},  {"siconos", json_number(error.siconos)},
            {"balance", json_number(error.balance)},  {"cone", json_number(error.cone)},
            {"dual", json_number(error.dual)},        {"gap", json_number(error.gap)},
            {"rounding", json_number(error.rounding)}};
}

inline Errors errors_of(const Json& json) {
    return {number_of(json.at("natural")), number_of(json.at("siconos")), number_of(json.at("balance")),
            number_of(json.at("cone")),    number_of(json.at("dual")),    number_of(json.at("gap")),
            number_of(json.at("rounding"))};
}

}  // namespace delassus::bench
