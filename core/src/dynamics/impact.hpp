// SPDX-License-Identifier: BSD-3-Clause
// What Newton's law makes of a contact that meets within a step (internal).
#pragma once

#include <optional>

#include "delassus/export.hpp"

namespace delassus {

/// A contact that meets within a step, and stays or bounces, perhaps several times, as if its row had one acceleration
/// besides.
struct Impact {
    double meets = 0.0;      ///< after the beginning of the step, s
    double closing = 0.0;    ///< speed with which it meets then, > 0
    double end_speed = 0.0;  ///< at the end of the step; negative if it closes again there
    double change = 0.0;     ///< of the speed, by the impulses of all bounces, ≥ 0
    double acts = 0.0;       ///< when in the step one impulse of that size would lead to the same gap at its end, s
};

/// Nothing if the contact does not meet. gap ≥ 0, speed (negative: closing) and acceleration of the row at the
/// beginning of the step of size h > 0; restitution in [0, 1].
[[nodiscard]] DELASSUS_API std::optional<Impact> impact_within(double h, double gap, double speed, double acceleration,
                                                               double restitution);

}  // namespace delassus
