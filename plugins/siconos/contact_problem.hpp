// SPDX-License-Identifier: BSD-3-Clause
// A problem in the form that Siconos takes: velocity = M reaction + q with three rows a contact, normal first.
//
// M = P N P and q = P r with one scalar p_c a contact, that of the natural error (or 1): then Siconos' own error is
// free of units, and differs from the natural one in its divisor alone. Blocks with fewer than three rows are embedded:
// a frictionless row becomes a contact with μ = 0, a planar contact gets a third row. The added rows have a one on the
// diagonal of M and zeros elsewhere, so that their reactions and velocities are zero at the solution.
#pragma once

#include <memory>
#include <vector>

#include <FrictionContactProblem.h>

#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/residual.hpp"

namespace delassus::siconos {

class ContactProblem {
public:
    ContactProblem(bool scaled, bool blocks) : scaled_(scaled), blocks_(blocks) {}

    void analyze(const sdk::ProblemView& problem) { operator_.analyze(problem); }

    /// Forms N and copies it into Siconos' matrix: 3×3 blocks, or compressed columns. Throws NumericalFailure if H is
    /// not positive definite.
    void factorize(const sdk::ProblemView& problem);

    /// Takes a, b and μ for the solves that follow.
    void load(const sdk::ProblemView& problem);

    /// For Siconos' drivers; owned here, valid until the next factorize or load.
    [[nodiscard]] FrictionContactProblem& raw() { return raw_; }

    /// Reactions in the problem's units (m) to Siconos' (3 a contact) and back.
    [[nodiscard]] sdk::Vector embedded(const sdk::Vector& lambda) const;
    [[nodiscard]] sdk::Vector restricted(const sdk::Vector& reaction) const;

    /// The natural error of λ (m); leaves x = H⁻¹(a + Dᵀλ) in velocity (n).
    [[nodiscard]] double natural(const sdk::ProblemView& problem, const sdk::Vector& lambda,
                                 sdk::Vector& velocity) const;

    /// x = H⁻¹(a + Dᵀλ); n. λ: m.
    template <class Lambda>
    [[nodiscard]] sdk::Vector velocity(const sdk::ProblemView& problem, const Lambda& lambda) const {
        return operator_.velocity(problem, lambda);
    }

private:
    struct Free {
        void operator()(NumericsMatrix* matrix) const;
    };

    bool scaled_, blocks_;
    sdk::DelassusOperator operator_;
    sdk::NaturalResidual residual_;
    std::vector<std::int32_t> place_;  // row of M for each of the problem's rows
    sdk::Vector p_;                    // of each of the problem's rows
    std::unique_ptr<NumericsMatrix, Free> matrix_;
    std::vector<double> q_, mu_;
    FrictionContactProblem raw_{};
};

}  // namespace delassus::siconos
