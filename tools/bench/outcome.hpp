// SPDX-License-Identifier: BSD-3-Clause
// The outcome of a run whose right answer is bounded (docs/stability.md).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bench/json_text.hpp"
#include "bench/scene_measurement.hpp"
#include "bench/suite_axis.hpp"

namespace delassus::bench {

/// correct: claimed, and within all bounds. inaccurate: claimed, out of a bound. refused: not taken, with a sentence.
/// failed: the library itself says that it did not come to an end, and why. wrong: claimed, although the core's error
/// is above the tolerance or figures are not finite. crashed, hung: of its process.
struct Judgement {
    std::string outcome;
    std::string measure;  ///< the one that says most: the nearest to, or farthest beyond, its bound
    double figure = unknown, limit = unknown;  ///< of that measure
    std::string sentence;                      ///< for people; empty only where there is nothing to say
    Json measures = Json::object();            ///< all that is known, by name
};

/// A bound on `velocity` is not judged where there is no reference, which the sentence then says.
[[nodiscard]] Judgement judge(const Measurement& run, const std::vector<Bound>& bounds);
/// place: where the body of the axis belongs at the end.
[[nodiscard]] Judgement judge(const SimulationMeasurement& run, const std::vector<Bound>& bounds,
                              const std::optional<std::array<double, 3>>& place);

/// Where a method stops being correct along an axis.
struct Breakdown {
    std::string axis, method;
    std::optional<double> last_correct;  ///< before the first that is not
    std::optional<double> first_not;     ///< first value in the axis' order that is not correct; empty: none
    std::string outcome, sentence;       ///< of that value
    std::vector<double> correct_again;   ///< values after it that are correct
};

/// One for each axis and method of the rows, in their order; rows: of kind "cell", by value in the axis' order.
[[nodiscard]] std::vector<Breakdown> breakdowns(const std::vector<Json>& cells);

}  // namespace delassus::bench
