// SPDX-License-Identifier: BSD-3-Clause
// The problem as the splitting sees it, in one process: the law, the equations of motion, and the errors as the host
// will measure them.
#pragma once

#include "contact_law.hpp"
#include "delassus/sdk/anderson.hpp"
#include "resolvent.hpp"

namespace delassus::admm {

class ScaledSystem {
public:
    explicit ScaledSystem(Resolvent::Form form) : resolvent_(form) {}

    void analyze(const sdk::ProblemView& problem) {
        scaling_.analyze(problem);
        resolvent_.analyze();
    }
    /// set_penalty has to follow. Throws sdk::NumericalFailure if a definite H turns out not to be so.
    void factorize(const sdk::ProblemView& problem) {
        scaling_.factorize(problem);
        resolvent_.load_matrices(problem, scaling_);
    }
    /// Takes a, b, the cones' parameters, bounds and law. problem must last as long as the solve.
    void load(const sdk::ProblemView& problem);

    /// The diagonal of P; m.
    [[nodiscard]] const sdk::Vector& scale() const { return scaling_.scale(); }
    /// Whether velocities follow from the reactions, by H⁻¹.
    [[nodiscard]] bool definite() const { return scaling_.definite(); }

    [[nodiscard]] double penalty() const { return resolvent_.penalty(); }
    /// Throws sdk::NumericalFailure if the matrix is not definite.
    void set_penalty(double penalty) { resolvent_.set_penalty(penalty); }

    /// λ̂ ← the law's reactions for ŷ; m, and may be one vector.
    void project(const sdk::Vector& y, sdk::Vector& lambda) const { law_.apply(y, lambda); }
    /// μ̂, û ← what obeys the equations of motion with μ̂ + ρ û = ŵ; m.
    void resolve(const sdk::Vector& w, sdk::Vector& mu, sdk::Vector& u) { resolvent_.apply(w, mu, u); }
    /// x of the latest resolve(); n, only where not definite().
    [[nodiscard]] const sdk::Vector& x() const { return resolvent_.x(); }

    /// The natural error of reactions with the velocities u of their rows, both m in the problem's units.
    [[nodiscard]] double natural(const sdk::Vector& lambda, const sdk::Vector& u) const {
        return natural_.natural(lambda, u);
    }
    /// The error on which a claim may rest, of λ (m) with x (n), u = D x + E λ + b computed anew. With a definite H
    /// x ← H⁻¹(a + Dᵀλ) first, and it is the natural error; else x is given, and the balance ‖Hx − Dᵀλ − a‖ over its
    /// largest term counts too.
    [[nodiscard]] double claim(const sdk::Vector& lambda, sdk::Vector& x) const;
    /// u = D x + E λ + b; m.
    [[nodiscard]] sdk::Vector velocities(const sdk::Vector& lambda, const sdk::Vector& x) const;
    /// x = H⁻¹(a + Dᵀλ); n, only if definite().
    [[nodiscard]] sdk::Vector velocity(const Eigen::Ref<const sdk::Vector>& lambda) const {
        return scaling_.N().velocity(*problem_, lambda);
    }

    [[nodiscard]] double norm(const sdk::Vector& v) const { return v.norm(); }

    // What a problem in parts has to do more for.
    [[nodiscard]] static sdk::Anderson::Sum sum() { return {}; }        ///< over all processes
    [[nodiscard]] static bool everywhere(bool holds) { return holds; }  ///< in all processes
    static void next_iteration() {}                                     ///< of a solve, for its cost
    static void end_iterations() {}

    [[nodiscard]] std::int64_t analyses() const { return resolvent_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const { return resolvent_.factorizations(); }

private:
    const sdk::ProblemView* problem_ = nullptr;
    RowScaling scaling_;
    Resolvent resolvent_;
    ContactLaw law_;
    sdk::NaturalResidual natural_;
};

}  // namespace delassus::admm
