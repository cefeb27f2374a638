// SPDX-License-Identifier: BSD-3-Clause
// What every claim of a solver is held against, whether one process has the problem or each a part of it.
#pragma once

#include <functional>

#include "delassus/solver.hpp"

namespace delassus {

/// The greatest of the natural error, its lower bound `dual`, which counts where reactions are so large that they
/// swallow velocities, and the balance; infinite where any measure is not finite, so that nothing is known.
[[nodiscard]] DELASSUS_API double worst_of(const Errors& error);

/// For a problem whose errors cannot be measured (ErrorMeter::reference is NaN): what it ends with, and no solver is
/// asked.
void refuse_to_judge(SolveReport& report);

/// Throws InputError on a setting outside its domain.
DELASSUS_API void check_settings(const SolveSettings& settings);

/// Takes back a claim that there is no solution unless the answer proves that none is smaller than beyond_all_sizes.
/// proven: proven_size() of the answer.
void judge_infeasibility(SolveReport& report, double proven);

/// Compares the claim report.status with report.error and corrects status and message (docs/errors.md, "When a claim
/// stands"). only_cones: every set is a cone. rounding_of: called where only the balance is missed; in the
/// same cases on all processes that have the same report.
DELASSUS_API void judge(SolveReport& report, bool only_cones, const std::function<RoundingOfBalance()>& rounding_of);

}  // namespace delassus
