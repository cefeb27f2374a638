// SPDX-License-Identifier: BSD-3-Clause
// What Newton's law makes of a contact that meets within a step (internal).
#pragma once

#include <algorithm>
#include <optional>

#include "delassus/export.hpp"

namespace delassus {

/// How a row moves before something meets.
struct Approach {
    double gap = 0.0;           ///< at the beginning of the step, ≥ 0
    double speed = 0.0;         ///< there; negative: closing
    double acceleration = 0.0;  ///< until it meets
};

/// A contact that meets within a step, and stays or bounces, perhaps several times, as if its gap had one acceleration
/// besides from then on. Speeds are those of its row when it meets.
struct Impact {
    double meets = 0.0;      ///< after the beginning of the step, s
    double closing = 0.0;    ///< speed with which it meets then, > 0
    double end_speed = 0.0;  ///< at the end of the step
    bool again = false;      ///< it meets once more before that, or rests
    double flight = 0.0;     ///< how long it has been apart again by then, s; 0 if it rests
    double change = 0.0;     ///< of the speed, from what it would be if nothing met
    double acts = 0.0;       ///< when in the step one impulse of that size would lead to the same gap at its end, s
};

/// How much of a step of size h is left after that time in it, s: never nothing, as forces are impulses over it.
[[nodiscard]] inline double rest_after(double time, double h) {
    constexpr double least = 1e-9;
    return std::max(h - time, least * h);
}

/// Nothing if the contact does not meet in the step of size h > 0. after: acceleration of the row from then on;
/// restitution in [0, 1]; turning: what the turn of the row adds to the acceleration of the gap, d/dt D v.
[[nodiscard]] DELASSUS_API std::optional<Impact> impact_within(double h, const Approach& approach, double after,
                                                               double restitution, double turning = 0.0);

}  // namespace delassus
