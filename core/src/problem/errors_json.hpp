// SPDX-License-Identifier: BSD-3-Clause
// Errors as JSON, by the table of measures.
#pragma once

#include <limits>
#include <string>

#include "delassus/errors.hpp"
#include "support/json_number.hpp"

namespace delassus {

/// An object with a number, or null, for each measure.
inline nlohmann::ordered_json errors_json(const Errors& errors) {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    for (const ErrorMeasure& measure : error_measures)
        json[std::string(measure.name)] = json_number(errors.*measure.value);
    return json;
}

/// The inverse, null being NaN. Throws nlohmann::json::out_of_range where a measure is absent.
inline Errors errors_in(const nlohmann::ordered_json& json) {
    Errors errors;
    for (const ErrorMeasure& measure : error_measures) {
        const auto& number = json.at(std::string(measure.name));
        errors.*measure.value = number.is_number() ? number.get<double>() : std::numeric_limits<double>::quiet_NaN();
    }
    return errors;
}

}  // namespace delassus
