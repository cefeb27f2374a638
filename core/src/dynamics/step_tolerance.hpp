// SPDX-License-Identifier: BSD-3-Clause
// How exactly the problem of a step, or a part of it, is solved (docs/tolerance.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "delassus/plugin.h"
#include "delassus/prepared.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"
#include "solver/judgement.hpp"

namespace delassus {

/// Tolerances below this are beyond what rounding allows in some problems: missing them is no miss by orders.
inline constexpr double rounding_limit_of_steps = 1e-8;
/// An error within this multiple of the upper bound is used where nothing better is found.
inline constexpr double usable_multiple = 3.0;

/// What the tolerance of an island depends on, beside the error of the method.
struct IslandTraits {
    std::uint64_t needs;
    /// How much the error of a velocity along a normal may exceed the natural error: the largest μ under the Coulomb
    /// law (docs/errors.md, "Large friction"), at least 1.
    double amplification = 1.0;
};

/// Collective.
inline IslandTraits traits_of(const Prepared& problem) {
    IslandTraits traits{problem.needs()};
    if (problem.law() == Law::Coulomb)
        for (const Cone& cone : problem.cones())
            if (cone.kind == ConeKind::Friction)
                traits.amplification = std::max(traits.amplification, cone.parameters[0]);
    problem.communicator().max(std::span(&traits.amplification, 1));
    return traits;
}

/// The upper bound of an island's tolerance: what is left of a joint's velocity becomes drift.
inline double loosest_goal(const IslandTraits& part) {
    return ((part.needs & DELASSUS_CAN_FREE) != 0 ? 1e-4 : 1e-2) / part.amplification;
}

/// (rows/300)³, at most 1: few rows are solved exactly for next to nothing.
inline double share_of_many(double rows) {
    constexpr double many = 300.0;
    return std::pow(std::min(1.0, rows / many), 3);
}

/// Below which no goal is, where a hundredth of the upper bound is exact enough.
inline double least_goal(const IslandTraits& part, double rows) {
    return 1e-8 + 1e-2 * share_of_many(rows) * loosest_goal(part);
}

/// What a goal follows from.
struct ErrorOfMethod {
    double in_masses;       ///< √(Σ H_ii e_i²), e being the method's own error in the velocities
    double in_rows;         ///< ‖S D e‖
    double reference;       ///< Prepared::reference()
    double rows;            ///< of the island
    bool gathered = false;  ///< IslandRequest
};

/// Rows far from the method's own error need not be solved below it.
inline double goal_of(const ErrorOfMethod& error, const IslandTraits& part) {
    constexpr double share = 0.5, share_in_rows = 0.75;
    const double least = error.gathered ? least_goal(part, error.rows) : 1e-8;
    const double unit = error.reference * part.amplification;
    const double by_masses = share * error.in_masses / unit;
    if (!(by_masses > least)) return least;  // as at rest, and where nothing can be measured
    const double in_rows = share_in_rows * error.in_rows / unit;
    return std::clamp(std::min(by_masses, in_rows), least,
                      std::max(least, loosest_goal(part) * share_of_many(error.rows)));
}

/// Sets the tolerance of an island. A tolerance that the configuration names is kept at least. goal: of goal_of(),
/// where tolerances follow from the error of the method. share: of it and of the upper bound.
inline void set_step_tolerance(const SolverConfig& config, const IslandTraits& part, std::optional<double> goal,
                               double share, SolveSettings& of) {
    if (!goal) {
        // Contacts may have no answer to a default tolerance that anybody finds: no work loosens it, but there is
        // last_resort().
        const bool contacts = (part.needs & DELASSUS_CAN_FRICTION) != 0;
        if (!config.tolerance && !of.fixed_iterations && contacts) of.loosest = of.tolerance;
        return;
    }
    if (config.tolerance && *goal >= *config.tolerance) return;
    of.tolerance = std::max(share * *goal, std::min(*goal, rounding_limit_of_steps));
    of.loosest = config.tolerance.value_or(std::max(of.tolerance, share * loosest_goal(part)));
}

/// What is used where nothing better is found: nobody asked for the tolerance, and so it ends no run.
inline bool last_resort(const SolverConfig& config, const IslandTraits& part, const SolveSettings& of,
                        const SolveReport& report) {
    return of.loosest > 0.0 && report.status != Status::Infeasible &&
           worst_of(report.error) <= config.tolerance.value_or(usable_multiple * loosest_goal(part));
}

}  // namespace delassus
