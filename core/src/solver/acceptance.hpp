// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "delassus/solver.hpp"

namespace delassus {

/// The error with which `auto` ends after this work, where the tolerance η is a goal and not a promise.
///
/// An answer with the error ε is worth V = log(L/ε) / log(L/η): 1 at the goal η, 0 at the loosest error L that is of
/// use. Work w is counted in first turns. The goal is worth a turn; so the solve ends once its answer is worth at least
/// the share that a turn has in all the work: V ≥ 1/w, and so
///
///     ε ≤ L (η/L)^min(1, 1/w),      η after the first turn, √(η L) after two, ever nearer to L.
///
/// AutoSolver asks only where no forecast says that the next turn of the last member gets to η.
inline double acceptable_error(const SolveSettings& settings, double work) {
    const double loosest = settings.loosest;
    if (!(loosest > settings.tolerance)) return settings.tolerance;
    return loosest * std::pow(settings.tolerance / loosest, std::min(1.0, 1.0 / work));
}

}  // namespace delassus
