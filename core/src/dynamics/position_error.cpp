// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/position_error.hpp"

#include <cmath>

namespace delassus {

// A step of the trapezoidal rule errs in positions by h³ q‴/12, and one of θ > ½ by (θ − ½) h² q̈ more (Hairer, Nørsett,
// Wanner, Solving Ordinary Differential Equations I, sec. III.2). With the mean accelerations a of the step and a₋ of
// the one before, of size h₋, besides free spins, q‴ is 2 (a − a₋)/(h + h₋):
//
//     error ≈ h³ |a − a₋| / (6 (h + h₋)) + (θ − ½) h² |a|
//
// Where a force sets in or ends within the step accelerations jump, and this is the order of what the step errs by; so
// it is at an impact without restitution, by what follows it in the step. Bounces have their own time, and steps are
// cut between them. Contacts that let go in a step change nothing yet. Beside the jump of an impact the acceleration
// before it is small.
bool PositionError::note(const Step& step, StepReport& report) {
    const auto n = static_cast<std::size_t>(step.change.size());
    const double h = step.h;
    const bool before = step.last_h >= short_share * h && !acceleration_.empty(), met = report.impact_speed > 0.0;
    const bool known = before || met;
    if (!before) acceleration_.assign(n, 0.0);
    if (known) report.error.assign(n, 0.0);
    const double both = h + (before ? step.last_h : h);
    for (std::size_t i = 0; i < n; ++i) {
        const double smooth = step.timed && step.bounce ? 1.0 - step.struck[i] : 1.0;
        const double change = smooth * step.change[static_cast<Eigen::Index>(i)];
        if (known)
            report.error[i] = h * h * std::abs(change - smooth * h * acceleration_[i]) / (6.0 * both) +
                              (theta_ - 0.5) * h * std::abs(change);
        if (!before || step.struck[i] <= mostly) acceleration_[i] = change / h;
    }
    if (met && (!step.timed || !before)) acceleration_.clear();
    return before;
}

}  // namespace delassus
