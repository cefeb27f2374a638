// SPDX-License-Identifier: BSD-3-Clause
// Steps of a fixed size, counted from t = 0, and their parts where a method cannot take them as one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "delassus/adaptive_stepping.hpp"
#include "delassus/export.hpp"
#include "delassus/step_solver.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

/// Times within this fraction of a step are equal but for rounding.
inline constexpr double rounding_of_step = 1e-9;

/// Whether a run in steps of this size has come to its end, however short it is.
inline bool has_ended(double t, double end, double h) {
    return end - t <= rounding_of_step * std::min(h, end);
}

/// A step of fixed size from t: its size, and the time that it reaches.
struct FixedStep {
    double h, end;
};

// Times are multiples of the step, counted, not summed: t = k h. Where `end` is no multiple, the last steps share what
// remains, so that none is shorter than half a step: a sliver would divide C and Φ by next to nothing. A run that is
// ended here or goes on later takes the same steps up to the last two.
inline FixedStep fixed_step(double t, double end, double h) {
    const double remaining = end - t;
    if (remaining <= (1.0 + rounding_of_step) * h)
        return {remaining >= (1.0 - rounding_of_step) * h ? h : remaining, end};
    if (remaining < (1.5 - rounding_of_step) * h) return {0.5 * remaining, t + 0.5 * remaining};
    const double count = std::round(t / h);
    const bool on_grid = std::abs(t - count * h) <= rounding_of_step * h;
    return {h, on_grid ? (count + 1.0) * h : t + h};
}

/// The shortest part of a step, relative to it. So short a part can pass a jump of velocities: it errs by its size
/// times the jump.
inline constexpr double shortest_part = 1e-6;

/// How parts are chosen whose error is at most `limit` in a step of size h.
[[nodiscard]] inline StepControl control_within(double limit, double h) {
    return {.absolute = limit, .initial = h, .smallest = shortest_part * h, .largest = h};
}

/// Into which a step is divided, at most, where its method cannot take it.
inline constexpr std::int64_t most_parts = 64;

struct Parts {
    std::int64_t taken = 0;
    std::int32_t rejected = 0;  ///< trials that were thrown away
    double error = 0.0;         ///< the largest of AdaptiveStepReport::error
};

/// Parts until the time `end`, as long as their errors allow. report ← that of all of them.
DELASSUS_API Parts step_within_error(AdaptiveStepping& control, State& state, double end, StepSolver& solver,
                                     StepReport& report);

/// Takes one step of a size from a state.
using TakeStep = std::function<void(State& state, double h, StepReport& report)>;

/// After a step of size h from `begin` was too long for the timestepper: twice as many parts until it can take them
/// all; how many. memory: the timestepper's at `begin`. Throws StepFailure, with the sentence of `failure`, where
/// most_parts are too long as well; StepTooDeep where those leave bodies in one another.
DELASSUS_API std::int64_t step_in_parts(Timestepper& timestepper, const TakeStep& take, const State& begin,
                                        const std::vector<double>& memory, double h, State& state, StepReport& report,
                                        const StepTooLong& failure);

}  // namespace delassus
