// SPDX-License-Identifier: BSD-3-Clause
// How exactly the problem of a step, or a part of it, is solved (docs/tolerance.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "delassus/needs.hpp"
#include "delassus/plugin.h"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"
#include "solver/judgement.hpp"

namespace delassus {

/// Tolerances below this are beyond what rounding allows in some problems: missing them is no miss by orders.
inline constexpr double rounding_limit_of_steps = 1e-8;
/// An error within this multiple of the upper bound is used where nothing better is found.
inline constexpr double usable_multiple = 3.0;

/// What the tolerance of a part depends on, beside the error of the method.
struct PartTraits {
    std::uint64_t needs;
    /// How much the error of a velocity along a normal may exceed the natural error: the largest μ under the Coulomb
    /// law (docs/errors.md, "Large friction"), at least 1.
    double amplification = 1.0;
};

inline double amplification_of(std::span<const Cone> cones, Law law) {
    double largest = 1.0;
    if (law != Law::Coulomb) return largest;
    for (const Cone& cone : cones)
        if (cone.kind == ConeKind::Friction) largest = std::max(largest, cone.parameters[0]);
    return largest;
}

/// The upper bound of a part's tolerance: what is left of a joint's velocity becomes drift.
inline double loosest_goal(const PartTraits& part) {
    return ((part.needs & DELASSUS_CAN_FREE) != 0 ? 1e-4 : 1e-2) / part.amplification;
}

/// What a goal follows from.
struct ErrorOfMethod {
    double in_masses;  ///< √(Σ H_ii e_i²), e being the method's own error in the velocities
    double in_rows;    ///< ‖S D e‖
    double reference;  ///< ErrorMeter::reference()
    double rows;       ///< of the part
    /// The part may be a whole pile, of which other ways of solving see each heap apart.
    bool gathered = false;
};

/// Rows far from the method's own error need not be solved below it.
inline double goal_of(const ErrorOfMethod& error, const PartTraits& part) {
    constexpr double share = 0.5, share_in_rows = 0.75, many = 300.0;
    // Few rows are solved exactly for next to nothing.
    const double share_of_many = std::pow(std::min(1.0, error.rows / many), 3);
    const double least = error.gathered ? 1e-8 + 1e-2 * share_of_many * loosest_goal(part) : 1e-8;
    const double unit = error.reference * part.amplification;
    const double by_masses = share * error.in_masses / unit;
    if (!(by_masses > least)) return least;  // as at rest, and where nothing can be measured
    const double in_rows = share_in_rows * error.in_rows / unit;
    return std::clamp(std::min(by_masses, in_rows), least, std::max(least, loosest_goal(part) * share_of_many));
}

/// Sets the tolerance of an island. A tolerance that the configuration names is kept at least. goal: of goal_of(),
/// where tolerances follow from the error of the method.
inline void set_step_tolerance(const SolverConfig& config, const PartTraits& part, std::optional<double> goal,
                               SolveSettings& of) {
    if (!goal) {
        // Contacts may have no answer to a default tolerance that anybody finds: no work loosens it, but there is
        // last_resort().
        const bool only_contacts = (part.needs & DELASSUS_CAN_FRICTION) != 0 && (part.needs & DELASSUS_CAN_FREE) == 0;
        if (!config.tolerance && !config.sweeps && only_contacts) of.loosest = of.tolerance;
        return;
    }
    if (config.tolerance && *goal >= *config.tolerance) return;
    of.tolerance = *goal;
    of.loosest = config.tolerance.value_or(loosest_goal(part));
}

/// What is used where nothing better is found: nobody asked for the tolerance, and so it ends no run.
inline bool last_resort(const SolverConfig& config, const PartTraits& part, const SolveSettings& of,
                        const SolveReport& report) {
    return of.loosest > 0.0 && report.status != Status::Infeasible &&
           worst_of(report.error) <= config.tolerance.value_or(usable_multiple * loosest_goal(part));
}

}  // namespace delassus
