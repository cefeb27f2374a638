// SPDX-License-Identifier: BSD-3-Clause
// The convex problem behind the associated law, scaled so that its operator has a unit diagonal on average:
//
//     minimise  f(λ) = ½ λᵀ N λ + rᵀ λ   over Υ,     ∇f(λ) = N λ + r = u           (seed, eq. 120–122, with the ½)
//
// In scaled variables (scaled_rows.hpp) f is ½ λ̂ᵀ N̂ λ̂ + r̂ᵀ λ̂ with N̂ = P N P, r̂ = P r.
//
// N̂ = Ŵ Ŵᵀ + Ê with Ŵ = P D L⁻ᵀ, H = L Lᵀ and Ê = P E P: where Ŵ has few entries a product with N̂ needs no H⁻¹.
#pragma once

#include <array>
#include <vector>

#include "delassus/sdk/column_shares.hpp"
#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/scaled_rows.hpp"

namespace delassus::sdk {

/// The convex problem in scaled variables λ̂, cut into parts for threads.
class ScaledProblem : public ScaledRows {
public:
    using View = ProblemView;

    void analyze(const ProblemView& problem) { operator_.analyze(problem); }

    /// Factors H and builds N̂. Throws NumericalFailure if H is not positive definite.
    void factorize(const ProblemView& problem, const Team& team = {});

    /// Takes a, b, the cones' parameters and bounds for the solve that follows.
    void load(const ProblemView& problem);

    /// The team where there are rows enough to share, else the calling thread alone.
    [[nodiscard]] static Team useful(const Team& team, const ProblemView& problem) {
        return team.if_worth(problem.m >= 2 * part_rows);
    }

    /// before(part) for all parts, then what a product of N̂ with λ̂ (m, made by before) needs of all rows, then
    /// after(part), which may call finish_product: by all members of the team. The sums over all parts of the First
    /// numbers that before returns as an array, and the Second of after.
    template <std::size_t First, std::size_t Second, class Before, class After>
    [[nodiscard]] std::array<double, First + Second> sums_about_product(const Team& team, const Vector& lambda,
                                                                        const Before& before,
                                                                        const After& after) const {
        return sums_about<First, Second>(
            team, before, [&] { begin_product(team, lambda); }, after);
    }

    /// A product with N̂ in two steps: first what concerns all rows at once, by all members of the team …
    void begin_product(const Team& team, const Vector& lambda) const;
    /// … then the rows of a part: result ← N̂ λ̂ there (m), with the λ̂ of begin_product.
    void finish_product(const Part& part, Vector& result) const;

    /// result ← N̂ λ̂; both m. Allocates nothing (but in Eigen's solve with a sparse factor).
    void multiply(const Vector& lambda, Vector& result) const;
    void multiply(const Team& team, const Vector& lambda, Vector& result) const;

    /// gradient ← N̂ λ̂ + r̂ = û; both m.
    void gradient(const Vector& lambda, Vector& result) const;

    /// The natural error of λ̂ with û without De Saxcé term; both m.
    [[nodiscard]] double natural(const Vector& lambda, const Vector& velocity) const {
        return natural_from(natural_square(lambda, velocity));
    }

    /// The natural error as the host will measure it: x = H⁻¹(a + Dᵀλ) and u = D x + E λ + b computed anew from λ (m,
    /// in the problem's own units). Leaves x (n) in velocity.
    [[nodiscard]] double measured(const ProblemView& problem, const Vector& lambda, Vector& velocity) const;

    /// x = H⁻¹(a + Dᵀλ); n, in the problem's own units.
    [[nodiscard]] Vector velocity(const ProblemView& problem, const Eigen::Ref<const Vector>& lambda) const {
        return operator_.velocity(problem, lambda);
    }

    [[nodiscard]] const Vector& r() const { return r_; }  ///< r̂; m
    [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }
    [[nodiscard]] const DelassusOperator& unscaled() const { return operator_; }

    // What a problem in parts has to do more for.
    [[nodiscard]] static bool everywhere(bool holds) { return holds; }  ///< in all processes
    static void next_iteration() {}                                     ///< of a solve, for its cost
    static void end_iterations() {}

private:
    enum class Form { Whitened, Solved, Formed };

    [[nodiscard]] Form cheapest_form(const ProblemView& problem) const;

    void build_operator(const ProblemView& problem, const Team& team);

    DelassusOperator operator_;
    NaturalResidual residual_;
    Vector r_;
    std::vector<RowGroup> groups_;
    mutable ColumnShares shares_;  // of rows_, for the latest team
    BlockRows rows_;               // Ŵ, or D̂ = P D
    BlockRows square_;             // Ê, or all of N̂
    bool whitened_ = true;
    mutable Vector work_, padded_;  // n and m, with the padding of BlockRows
    mutable Vector velocity_;       // n
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/scaled_problem_bodies.hpp"
#endif
