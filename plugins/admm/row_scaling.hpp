// SPDX-License-Identifier: BSD-3-Clause
// The scaling of the rows, and the problem in scaled variables.
#pragma once

#include <cmath>
#include <vector>

#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/residual.hpp"

namespace delassus::admm {

/// The diagonal of P, from that of N; m.
///
/// λ = P λ̂, û = P u with P diagonal and positive, so that N̂ = P N P has a unit diagonal on the average: one value
/// p = (tr N_cc / rows)^(−½) for a block that is projected as a whole, p_i = N_ii^(−½) for any other row. λ̂ and û are
/// both in √energy. Free rows are equations: their p is larger by √1000, as the penalty of equations in OSQP (Stellato
/// et al. 2020, section 5.2).
inline sdk::Vector scale_of(const sdk::ConeRange& cones, const sdk::Vector& diagonal) {
    const double equation_factor = std::sqrt(1000.0);
    const std::vector<double> block = sdk::block_scaling(cones, diagonal);
    sdk::Vector scale(diagonal.size());
    for (std::size_t c = 0; c < cones.size(); ++c) {
        const delassus_cone& cone = cones[c];
        const bool whole = !sdk::is_separable(cone);
        for (std::int32_t i = cone.first_row; i < cone.first_row + cone.rows; ++i)
            scale[i] = whole || !(diagonal[i] > 0.0) ? block[c] : 1.0 / std::sqrt(diagonal[i]);
        if (sdk::operations_of(cone).is_linear) scale.segment(cone.first_row, cone.rows) *= equation_factor;
    }
    return scale;
}

/// N and the scaling of its rows. Where H is singular |diag H|⁻¹ stands in for H⁻¹, as in the core's own measure.
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
