// SPDX-License-Identifier: BSD-3-Clause
// How far a step's linear model of the forces was from the forces (internal).
#pragma once

#include <span>
#include <string_view>

#include "delassus/export.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

// A linearised step takes forces f_lin at its end, to first order from where it knows them; in truth they are
// f(q⁺, v⁺, t⁺) there. The difference would change the velocities by h M⁻¹ (f − f_lin) in a step. Its share of the
// velocities, in the norm of M,
//
//     η = ‖h (f − f_lin)‖_{M⁻¹} / max(‖v‖_M, ‖v⁺‖_M, ‖h f_lin‖_{M⁻¹})
//
// is the share that is lost, or gained, while the motion turns by a radian: a bob of mass m on a stiff spring k of
// length l moves along the tangent by h v, which stretches the spring by (h v)²/2l. The false tension
// T = k (h v)²/2l is h T/(m v) = (hω)² φ/2 = η, with φ = h v/l the turn in a step. In the next step its geometric
// stiffness T/l, as h² T/l beside m, slows the bob by η φ, and a radian has 1/φ steps. (M is taken by its diagonal.)
//
// What joints and attachments hold does not change the velocities: a light node that hangs on a heavy body moves with
// it. So where η is beyond a limit and M is definite, both numerators are measured again by the changes that they
// allow,
//
//     M δ − C_qᵀ λ = h (f − f_lin),      C_q δ = 0,      ‖h (f − f_lin)‖² = δᵀ M δ
//
// Rounding of the positions, 10 ε ‖q‖_∞ as in Newton's method, leaves a difference of that times the diagonal of
// (H − M)/h, which counts for nothing.
class DELASSUS_API Linearization {
public:
    /// limit: of η; infinite: it is not measured. system outlives it.
    Linearization(DynamicalSystem& system, double limit);

    /// Whether there is something to measure: forces that are not constant, and a limit.
    [[nodiscard]] bool wanted() const { return wanted_; }

    /// report.linearization ← η of the step from begin to end, and what rounding may make of it. force: h f there,
    /// linear: h f_lin, n each; H: M + h R + h² K or near to it. Throws StepTooLong if η is beyond the limit.
    void judge(const State& begin, const State& end, double h, std::span<const double> force,
               std::span<const double> linear, const SparseMatrix& H, std::string_view method, StepSolver& solver,
               StepReport& report);

private:
    DynamicalSystem& system_;
    double limit_;
    bool wanted_;
    MatrixAssembler M_, D_;
};

/// The row of the option `linearization_limit`.
OptionInfo linearization_option();

}  // namespace delassus
