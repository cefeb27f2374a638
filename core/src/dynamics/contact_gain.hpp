// SPDX-License-Identifier: BSD-3-Clause
// Bounces that would gain energy (internal).
#pragma once

#include <vector>

#include "delassus/dynamical_system.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// What the contacts of a step do to its energy.
struct ContactWork {
    double work = 0.0;     ///< theirs, J
    double kinetic = 0.0;  ///< the larger one of the kinetic energies at its two ends, J; not 0 at rest

    /// More than rounding and the error of a step explain.
    [[nodiscard]] bool gains() const { return work > 0.01 * kinetic; }
    [[nodiscard]] bool takes() const { return work < -0.01 * kinetic; }
};

/// Sees it beside kinetic energies; keeps its memory.
class EnergyOfStep {
public:
    /// system outlives it.
    explicit EnergyOfStep(const DynamicalSystem& system) : system_(system) {}

    /// begin, end: velocities, n; the masses are those of the state `at`. problem: of the step; a ten-thousandth of the
    /// energy that forces alone lead to, by its a, is the least that counts as kinetic: at rest work is what the solver
    /// leaves.
    [[nodiscard]] ContactWork with(double work, const State& at, const std::vector<double>& begin,
                                   const std::vector<double>& end, const Problem& problem);

private:
    const DynamicalSystem& system_;
    std::vector<double> momentum_, diagonal_;
};

// Newton's law of impact with friction may ask for an impulse that gains energy (Kane and Levinson 1985, Dynamics,
// section 5.8), without a bound where a mechanism is nearly jammed between contacts. Without restitution u⁺ = 0 where a
// contact pushes, and friction acts against u⁺: that takes energy. If impulses and velocities are linear in a common
// share s of all coefficients of restitution, as long as the same contacts push and slide, the work is a convex square
// in s, and its chord between a share that takes energy and one that gains lies above it. Where the chord is 0 nothing
// is gained.

/// Solves a step with as much restitution as gains no energy. solve(share) solves it with that share of each
/// coefficient, and returns the work. Returns that of the last solve, which gains only if one without restitution does.
template <class Solve>
ContactWork solve_without_gain(const Solve& solve) {
    constexpr int most_chords = 4;
    ContactWork last = solve(1.0), above = last;
    if (!last.gains()) return last;
    last = solve(0.0);
    ContactWork below = last;
    double least = 0.0, most = 1.0;
    for (int chord = 0; chord < most_chords && below.takes(); ++chord) {
        const double share = (most * below.work - least * above.work) / (below.work - above.work);
        last = solve(share);
        (last.gains() ? most : least) = share;
        (last.gains() ? above : below) = last;
    }
    return last.gains() && below.takes() ? solve(least) : last;
}

}  // namespace delassus
