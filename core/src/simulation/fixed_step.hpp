// SPDX-License-Identifier: BSD-3-Clause
// Steps of a fixed size, counted from t = 0 (internal).
#pragma once

#include <algorithm>
#include <cmath>

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

}  // namespace delassus
