// SPDX-License-Identifier: BSD-3-Clause
// The scaling of the rows, and the problem in scaled variables.
#pragma once

#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/residual.hpp"

namespace delassus::admm {

/// λ = P λ̂, û = P u with P diagonal and positive, so that N̂ = P N P has a unit diagonal on the average: one value
/// p = (tr N_cc / rows)^(−½) for a block that is projected as a whole, p_i = N_ii^(−½) for any other row. λ̂ and û are
/// both in √energy. Free rows are equations: their p is larger by √1000, as the penalty
/// of equations in OSQP (Stellato et al. 2020, section 5.2). Where H is singular |diag H|⁻¹ stands in for H⁻¹, as in
/// the core's own measure.
class RowScaling {
public:
    void analyze(const sdk::ProblemView& problem);
    /// Throws sdk::NumericalFailure if a definite H turns out not to be so.
    void factorize(const sdk::ProblemView& problem);

    /// The diagonal of N; m.
    [[nodiscard]] const sdk::Vector& diagonal() const { return diagonal_; }
    /// The diagonal of P; m.
    [[nodiscard]] const sdk::Vector& scale() const { return scale_; }
    /// Whether H⁻¹ exists, or n = 0: then velocities follow from the reactions.
    [[nodiscard]] bool definite() const { return definite_; }
    /// Only if definite().
    [[nodiscard]] const sdk::DelassusOperator& N() const { return N_; }
    /// r = D H⁻¹ a + b, in the problem's units; m.
    [[nodiscard]] sdk::Vector free_velocity(const sdk::ProblemView& problem) const;

private:
    bool definite_ = true;
    sdk::DelassusOperator N_;
    sdk::Vector stand_in_;  // |diag H|, n; only if not definite
    sdk::Vector diagonal_, scale_;
};

}  // namespace delassus::admm
