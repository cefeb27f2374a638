// SPDX-License-Identifier: BSD-3-Clause
// The errors as the host will measure them.
#pragma once

#include "row_scaling.hpp"

namespace delassus::admm {

class Measure {
public:
    /// r = D H⁻¹ a + b; m. problem and scaling must outlive the object.
    Measure(const sdk::ProblemView& problem, const RowScaling& scaling, const sdk::Vector& r)
        : problem_(problem), scaling_(scaling), natural_(problem, scaling.diagonal(), r) {}

    /// The natural error of reactions with the velocities u of their rows, both m in the problem's units.
    [[nodiscard]] double natural(const sdk::Vector& lambda, const sdk::Vector& u) const {
        return natural_.natural(lambda, u);
    }

    /// The error on which a claim may rest, of λ (m) with x (n), u = D x + E λ + b computed anew. With a definite H
    /// x ← H⁻¹(a + Dᵀλ) first, and it is the natural error; else x is given, and the balance ‖Hx − Dᵀλ − a‖ over its
    /// largest term counts too.
    [[nodiscard]] double claim(const sdk::Vector& lambda, sdk::Vector& x) const;

    /// u = D x + E λ + b; m.
    [[nodiscard]] sdk::Vector velocity(const sdk::Vector& lambda, const sdk::Vector& x) const;

private:
    const sdk::ProblemView& problem_;
    const RowScaling& scaling_;
    sdk::NaturalResidual natural_;
};

}  // namespace delassus::admm
