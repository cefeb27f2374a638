// SPDX-License-Identifier: BSD-3-Clause
// Static equilibrium of a dynamical system (internal).
#pragma once

#include <functional>
#include <limits>

#include "delassus/export.hpp"
#include "dynamics/newton.hpp"

namespace delassus {

/// What a search for an equilibrium may do.
struct RelaxationSettings {
    double tolerance = 1e-10;  ///< last movement over the whole way, both in the norm of the mass
    int most_steps = 300;      ///< at one load
    int most_failures = 60;    ///< steps that were tried again
    double farthest = 1e6;     ///< positions beyond this many times the largest at the start are on their way off
};

/// Effort, and how far from an equilibrium the state is.
struct RelaxationReport {
    int steps = 0, newton_iterations = 0;
    double residual = 0.0;  ///< largest entry of f + C_qᵀ λ, N or Nm
    double reaction = 0.0;  ///< largest entry of C_qᵀ λ
};

class DELASSUS_API Relaxation {
public:
    /// system outlives it.
    Relaxation(DynamicalSystem& system, RelaxationSettings settings);

    /// Moves state, in which nothing moves (v = 0), to an equilibrium, and lambda (m) to its reactions. Throws
    /// StepFailure if it finds none; state and lambda are then as before.
    RelaxationReport run(State& state, Vector& lambda, StepSolver& solver);

    /// The smallest ω² of small free vibrations about an equilibrium, rad²/s²: negative where it is unstable. NaN for
    /// systems without freedom, and for those with more than 600 velocities, where it is not computed.
    [[nodiscard]] double smallest_eigenvalue(const State& state, const Vector& lambda) const;

private:
    [[nodiscard]] double mass_norm(const Vector& x, const State& state) const;

    DynamicalSystem& system_;
    RelaxationSettings settings_;
    Newton newton_;
    std::int32_t n_, m_;
    double tau_ = 1.0;  // s; kept from load to load
};

}  // namespace delassus
