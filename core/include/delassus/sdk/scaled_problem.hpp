// SPDX-License-Identifier: BSD-3-Clause
// The convex problem behind the associated law, scaled so that its operator has a unit diagonal on average:
//
//     minimise  f(λ) = ½ λᵀ N λ + rᵀ λ   over Υ,     ∇f(λ) = N λ + r = u           (seed, eq. 120–122, with the ½)
//
// With λ = P λ̂, P diagonal and positive, f is ½ λ̂ᵀ N̂ λ̂ + r̂ᵀ λ̂ with N̂ = P N P, r̂ = P r, û = P u, and the set becomes
// Υ̂ = P⁻¹Υ. P has one scalar for a block whose rows do not separate (friction), p = (tr N_cc / rows)^(−½), so that a
// cone stays the same; a separate row has its own p = N_ii^(−½), and Υ̂ is the interval [lo/p, hi/p]. λ̂ and û are both
// in √energy: the iterates of a method that works on λ̂ do not depend on the units of length, time or mass.
//
// N̂ = Ŵ Ŵᵀ + Ê with Ŵ = P D L⁻ᵀ, H = L Lᵀ and Ê = P E P: where Ŵ has few entries a product with N̂ needs no H⁻¹.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "delassus/sdk/block_rows.hpp"
#include "delassus/sdk/column_shares.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus::sdk {

/// The convex problem in scaled variables λ̂, cut into parts for threads.
class ScaledProblem {
public:
    /// A block that is projected as a whole (friction).
    struct Block {
        delassus_cone cone;
        std::int32_t first, rows;
        double unit;  ///< λ = unit · λ̂ where Υ is no cone, and so has a size; 1 for a cone
    };
    /// Rows that are projected one by one onto [lower, upper].
    struct Interval {
        std::int32_t first, rows;
    };
    /// About a thousand rows that follow one another, with what belongs to them. A method that works by parts, and adds
    /// up their results in their order, gets the same bits for any number of threads.
    struct Part {
        std::int32_t first = 0, rows = 0;
        std::size_t first_block = 0, blocks = 0, first_interval = 0, intervals = 0, first_group = 0, groups = 0;

        template <class Any>
        [[nodiscard]] auto of(Any& vector) const {
            return vector.segment(first, rows);
        }
    };

    void analyze(const ProblemView& problem) { operator_.analyze(problem); }

    /// Factors H and builds N̂. Throws NumericalFailure if H is not positive definite.
    void factorize(const ProblemView& problem, const Team& team = {});

    /// Takes a, b, the cones' parameters and bounds for the solve that follows.
    void load(const ProblemView& problem);

    /// The rows in parts, in their order; since load().
    [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }

    /// The team where there are rows enough to share, else the calling thread alone.
    [[nodiscard]] static Team useful(const Team& team, const ProblemView& problem) {
        return team.if_worth(problem.m >= 2 * part_rows);
    }

    /// body(part) for all parts, by all members of the team.
    template <class Body>
    void for_parts(const Team& team, const Body& body) const {
        team.run([&](int member) {
            const auto [first, last] = team.share(parts_.size(), member);
            for (std::size_t k = first; k < last; ++k) body(parts_[k]);
        });
    }
    /// The sums over all parts of the Count numbers that body(part) returns as an array.
    template <std::size_t Count, class Body>
    [[nodiscard]] std::array<double, Count> sums_over_parts(const Team& team, const Body& body) const {
        partial_.resize(Count * parts_.size());
        team.run([&](int member) {
            const auto [first, last] = team.share(parts_.size(), member);
            for (std::size_t k = first; k < last; ++k) {
                const std::array<double, Count> sums = body(parts_[k]);
                std::copy(sums.begin(), sums.end(), partial_.begin() + static_cast<std::ptrdiff_t>(Count * k));
            }
        });
        std::array<double, Count> total = {};
        for (std::size_t k = 0; k < partial_.size(); ++k) total[k % Count] += partial_[k];
        return total;
    }

    /// before(part) for all parts, then what a product of N̂ with λ̂ (m, made by before) needs of all rows, then
    /// after(part), which may call finish_product: by all members of the team. The sums over all parts of the First
    /// numbers that before returns as an array, and the Second of after.
    template <std::size_t First, std::size_t Second, class Before, class After>
    [[nodiscard]] std::array<double, First + Second> sums_about_product(const Team& team, const Vector& lambda,
                                                                        const Before& before,
                                                                        const After& after) const {
        constexpr std::size_t count = First + Second;
        partial_.resize(count * parts_.size());
        for_parts(team, [&](const Part& part) {
            const std::array<double, First> sums = before(part);
            std::copy(sums.begin(), sums.end(), partial_.data() + count * number_of(part));
        });
        begin_product(team, lambda);
        for_parts(team, [&](const Part& part) {
            const std::array<double, Second> sums = after(part);
            std::copy(sums.begin(), sums.end(), partial_.data() + count * number_of(part) + First);
        });
        std::array<double, count> total = {};
        for (std::size_t k = 0; k < partial_.size(); ++k) total[k % count] += partial_[k];
        return total;
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

    /// λ̂ ← its Euclidean projection onto Υ̂; m.
    void project(Vector& lambda) const;
    /// The rows of one part.
    void project(const Part& part, Vector& lambda) const;

    /// The natural error of λ̂ with û without De Saxcé term; both m. With the exact Coulomb law the term is added here:
    /// a friction block has one scalar p, so that p μ‖u_t‖ = μ‖û_t‖. A row whose p differs from its block's s has the
    /// unit step (s/p)² of û.
    [[nodiscard]] double natural(const Vector& lambda, const Vector& velocity) const;
    /// The natural error from the sum of its parts' squares.
    [[nodiscard]] double natural_from(double sum) const { return std::sqrt(sum) / residual_.reference(); }
    /// One part's share.
    [[nodiscard]] double natural_square(const Part& part, const Vector& lambda, const Vector& velocity) const;

    /// The natural error as the host will measure it: x = H⁻¹(a + Dᵀλ) and u = D x + E λ + b computed anew from λ (m,
    /// in the problem's own units). Leaves x (n) in velocity.
    [[nodiscard]] double measured(const ProblemView& problem, const Vector& lambda, Vector& velocity) const;

    [[nodiscard]] const Vector& r() const { return r_; }          ///< r̂; m
    [[nodiscard]] const Vector& scaling() const { return p_; }    ///< the diagonal of P; m
    [[nodiscard]] const Vector& lower() const { return lower_; }  ///< of the rows in intervals(); m
    [[nodiscard]] const Vector& upper() const { return upper_; }  ///< of the rows in intervals(); m
    [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }
    [[nodiscard]] const std::vector<Interval>& intervals() const { return intervals_; }
    [[nodiscard]] const DelassusOperator& unscaled() const { return operator_; }

private:
    /// What hot loops need of a block: a fifth of its bytes.
    struct Contact {
        double mu;
        std::int32_t first, rows;  // rows: 0 where the block is not one of friction
    };

    [[nodiscard]] std::size_t number_of(const Part& part) const {
        return static_cast<std::size_t>(&part - parts_.data());
    }

    static constexpr std::int32_t longest_interval = 512, part_rows = 1024;

    static void project_block(const Block& block, double* lambda);

    void scale_rows(const ProblemView& problem);

    enum class Form { Whitened, Solved, Formed };

    [[nodiscard]] Form cheapest_form(const ProblemView& problem) const;

    void divide();

    void build_operator(const ProblemView& problem, const Team& team);

    DelassusOperator operator_;
    NaturalResidual residual_;
    Vector p_, ratio_;  // ratio: s of the row's block over p of the row
    Vector r_, lower_, upper_;
    std::vector<Block> blocks_;
    std::vector<Contact> contacts_;  // beside blocks_
    std::vector<Interval> intervals_;
    std::vector<RowGroup> groups_;
    std::vector<Part> parts_;
    mutable std::vector<double> partial_;  // sums of the parts
    mutable ColumnShares shares_;          // of rows_, for the latest team
    BlockRows rows_;                       // Ŵ, or D̂ = P D
    BlockRows square_;                     // Ê, or all of N̂
    bool whitened_ = true;
    bool coulomb_ = false;
    mutable Vector work_, padded_;  // n and m, with the padding of BlockRows
    mutable Vector velocity_;       // n
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/scaled_problem_bodies.hpp"
#endif
