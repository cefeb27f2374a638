// SPDX-License-Identifier: BSD-3-Clause
// The figures that say how good a solver's answer is: the core's error measures, then the velocity error against a
// reference.
#pragma once

#include <string_view>
#include <vector>

#include "bench/json_text.hpp"
#include "bench/results.hpp"

namespace delassus::bench {

struct AnswerMeasure {
    std::string_view name;   ///< the key in files
    std::string_view unit;   ///< "1": dimensionless
    std::string_view title;  ///< what it says, in a few words
    bool brief;              ///< shown where there is room for few
    double Errors::*error;   ///< null: Measurement::velocity
};
[[nodiscard]] const std::vector<AnswerMeasure>& answer_measures();

/// unknown where the run gave no result, or there is no reference.
[[nodiscard]] double value_of(const Measurement& run, const AnswerMeasure& measure);

/// The table for a page: name, title and brief of each.
[[nodiscard]] Json answer_measures_json();

}  // namespace delassus::bench
