// SPDX-License-Identifier: BSD-3-Clause
// Reactions in scaled variables: what methods ask of the rows alone, whoever multiplies by N.
//
// With λ = P λ̂, P diagonal and positive, N̂ = P N P has a unit diagonal on average, û = P u, and the set of the
// reactions becomes Υ̂ = P⁻¹Υ. P has one scalar for a block whose rows do not separate (friction), p = (tr N_cc /
// rows)^(−½), so that a cone stays the same; a separate row has its own p = N_ii^(−½), and Υ̂ is the interval [lo/p,
// hi/p]. λ̂ and û are both in √energy: the iterates of a method that works on λ̂ do not depend on the units of length,
// time or mass.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "delassus/sdk/block_rows.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus::sdk {

/// The rows of a problem, or a process's own ones, with Υ̂, cut into parts.
class ScaledRows {
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
        std::size_t first_block = 0, blocks = 0, first_interval = 0, intervals = 0;
        std::size_t slice = 0, first_group = 0, groups = 0;  ///< groups count within a slice of N̂'s factors

        template <class Any>
        [[nodiscard]] auto of(Any& vector) const {
            return vector.segment(first, rows);
        }
    };

    /// The rows in parts, in their order; since load().
    [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }

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
        for_parts(team, [&](const Part& part) { keep<Count>(part, 0, body(part)); });
        return totals<Count>();
    }

    /// λ̂ ← its Euclidean projection onto Υ̂; m.
    void project(Vector& lambda) const {
        for (const Part& part : parts_) project(part, lambda);
    }
    /// The rows of one part.
    void project(const Part& part, Vector& lambda) const;

    /// One part's share of the square of the natural error of λ̂ with û without De Saxcé term; both m. With the exact
    /// Coulomb law the term is added here: a friction block has one scalar p, so that p μ‖u_t‖ = μ‖û_t‖. A row whose p
    /// differs from its block's s has the unit step (s/p)² of û.
    [[nodiscard]] double natural_square(const Part& part, const Vector& lambda, const Vector& velocity) const;
    /// The shares of all own parts.
    [[nodiscard]] double natural_square(const Vector& lambda, const Vector& velocity) const {
        double sum = 0.0;
        for (const Part& part : parts_) sum += natural_square(part, lambda, velocity);
        return sum;
    }
    /// The natural error from the sum of all shares.
    [[nodiscard]] double natural_from(double sum) const { return std::sqrt(sum) / reference_; }

    [[nodiscard]] const Vector& scaling() const { return p_; }    ///< the diagonal of P; m
    [[nodiscard]] const Vector& lower() const { return lower_; }  ///< of the rows in intervals(); m, or empty
    [[nodiscard]] const Vector& upper() const { return upper_; }  ///< of the rows in intervals(); m, or empty
    [[nodiscard]] const std::vector<Interval>& intervals() const { return intervals_; }

protected:
    ScaledRows() = default;

    static constexpr std::int32_t part_rows = 1024;

    /// P in the rows of these cones, from the diagonal of N; m. Both have their size.
    void scale(const ConeRange& cones, const Vector& diagonal);

    enum class Keep { AllBlocks, BlocksOfOtherKinds };
    /// Takes the cones' parameters and bounds, and ‖S r‖. P is there; the parts have to be cut anew.
    void load(const ConeRange& cones, bool coulomb, double reference, Keep keep);
    /// Cuts the rows that follow those of the parts into parts, of at least part_rows but for the last one. No block,
    /// interval or group is cut. All three stand in the order of their rows.
    void append_parts(std::size_t slice, std::span<const RowGroup> groups, std::int32_t rows);

    /// before(part) for all parts, then between(), then after(part): by all members of the team. The sums over all
    /// parts of the First numbers that before returns as an array, and the Second of after.
    template <std::size_t First, std::size_t Second, class Before, class Between, class After>
    [[nodiscard]] std::array<double, First + Second> sums_about(const Team& team, const Before& before,
                                                                const Between& between, const After& after) const {
        partial_.resize((First + Second) * parts_.size());
        for_parts(team, [&](const Part& part) { keep<First + Second>(part, 0, before(part)); });
        between();
        for_parts(team, [&](const Part& part) { keep<First + Second>(part, First, after(part)); });
        return totals<First + Second>();
    }

    Vector p_, ratio_;           // ratio: s of the row's block over p of the row
    std::vector<Block> blocks_;  // beside contacts_; empty if all are of friction and Keep says so

private:
    /// What hot loops need of a block: a fifth of its bytes.
    struct Contact {
        double mu;
        std::int32_t first, rows;  // rows: 0 where the block is not one of friction
    };

    static constexpr std::int32_t longest_interval = 512;

    template <std::size_t Count, std::size_t Some>
    void keep(const Part& part, std::size_t first, const std::array<double, Some>& sums) const {
        const auto number = static_cast<std::size_t>(&part - parts_.data());
        std::copy(sums.begin(), sums.end(), partial_.data() + Count * number + first);
    }
    template <std::size_t Count>
    [[nodiscard]] std::array<double, Count> totals() const {
        std::array<double, Count> total = {};
        for (std::size_t k = 0; k < partial_.size(); ++k) total[k % Count] += partial_[k];
        return total;
    }

    [[nodiscard]] std::int32_t rows_of(std::size_t block) const {
        return contacts_[block].rows > 0 ? contacts_[block].rows : blocks_[block].rows;
    }
    void project_block(std::size_t block, double* lambda) const;

    std::vector<Contact> contacts_;
    std::vector<Interval> intervals_;
    Vector lower_, upper_;
    std::vector<Part> parts_;
    mutable std::vector<double> partial_;  // sums of the parts
    double reference_ = 1.0;
    bool coulomb_ = false;
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/scaled_rows_bodies.hpp"
#endif
