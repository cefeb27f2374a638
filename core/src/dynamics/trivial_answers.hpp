// SPDX-License-Identifier: BSD-3-Clause
// Answers that need no solver: where the rows are still, or feel no more than rounding.
#pragma once

#include "delassus/errors.hpp"
#include "delassus/prepared.hpp"

namespace delassus {

/// How fast the velocities without reactions move the rows, as a share of the motion as a whole, about; 1 where nothing
/// moves. Collective.
[[nodiscard]] double share_of_rows(const Prepared& problem);

/// Whether the velocities without reactions move the rows by no more than their own rounding, so that no reactions are
/// the answer: solution ← that. Collective.
bool rows_feel_nothing(const Prepared& problem, Solution& solution);

/// Whether the velocities without reactions vanish in rounding, so that no reactions are the answer: what recovers a
/// penetration at constant speed is such a case. Errors relative to them say nothing. solution ← that answer.
/// Collective.
bool moves_freely(const Prepared& problem, Solution& solution);

/// Whether the rows hold as well as rounding lets them. A body that is pushed along at a constant speed needs next to
/// no reaction: errors are relative to it, and the speed's own rounding is large beside it.
[[nodiscard]] inline bool rows_are_rounding(const Errors& error) {
    constexpr double slack = 32.0;
    return error.natural <= slack * error.rounding;
}

}  // namespace delassus
