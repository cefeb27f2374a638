// SPDX-License-Identifier: BSD-3-Clause
// States within a step that was taken: dense output.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

/// The way of a step as polynomials. With θ = (t − begin.t)/(end.t − begin.t) and k from 1 to `degree`
///     q(θ) = begin.q ∘ exp(Σ θᵏ Δ_k),   v(θ) = begin.v + Σ θᵏ V_k
/// which meets `begin` and `end`. Between them constraints hold but for the error of the polynomials.
struct ContinuousExtension {
    State begin, end;
    std::int32_t degree = 0;                ///< 0: there is no way, only `end`
    std::vector<double> positions;          ///< Δ_k one after the other, degree × n
    std::vector<double> velocities;         ///< V_k likewise
    std::vector<double> multipliers;        ///< λ of the bilateral constraints at the end, m; empty: not known
    std::vector<double> multiplier_powers;  ///< of λ(θ), k from 0, m each; empty: λ follows from the state
};

/// Finds states on the way of a step, returned to the constraints.
class DELASSUS_API DenseOutput {
public:
    /// system outlives it.
    explicit DenseOutput(DynamicalSystem& system);
    ~DenseOutput();
    DenseOutput(const DenseOutput&) = delete;
    DenseOutput& operator=(const DenseOutput&) = delete;

    /// state ← that at time t, begin.t ≤ t ≤ end.t. Positions and velocities are the nearest ones, in the norm of the
    /// mass, at which C = 0 and C_q v + C_t = 0, up to rounding. Adds the problems solved to the report. Throws
    /// InputError for another time, StepTooLong if the polynomials are so far from the constraints that they cannot be
    /// returned to them, StepFailure if the state is not finite.
    void at(const ContinuousExtension& way, double t, State& state, StepSolver& solver, StepReport& report);
    /// The same as the polynomials have it, which is off the constraints by their error. Throws InputError and
    /// StepFailure as at().
    void read(const ContinuousExtension& way, double t, State& state);
    /// λ of the bilateral constraints at a state that at() gave, forces, m: by a problem more where way.multipliers and
    /// multiplier_powers do not tell them.
    [[nodiscard]] std::vector<double> multipliers(const ContinuousExtension& way, const State& state,
                                                  StepSolver& solver, StepReport& report);

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
