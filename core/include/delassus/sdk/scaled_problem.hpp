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
#include <span>
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
    void factorize(const ProblemView& problem) {
        operator_.factorize(problem, cheapest_form(problem) == Form::Formed);
        scale_rows(problem);
        build_operator(problem);
    }

    /// Takes a, b, the cones' parameters and bounds for the solve that follows.
    void load(const ProblemView& problem) {
        r_ = operator_.free_velocity(problem);
        residual_ = NaturalResidual(problem, operator_.diagonal(), r_);
        coulomb_ = problem.coulomb;
        r_.array() *= p_.array();
        blocks_.clear();
        contacts_.clear();
        intervals_.clear();
        lower_.setZero(problem.m);
        upper_.setZero(problem.m);
        for (const delassus_cone& cone : problem.cones) {
            const ConeOperations& kind = operations_of(cone);
            if (!kind.is_separable()) {
                const bool friction = cone.kind == DELASSUS_CONE_FRICTION;
                blocks_.push_back({cone, cone.first_row, cone.rows, kind.is_cone ? 1.0 : p_[cone.first_row]});
                contacts_.push_back(
                    {friction ? friction_coefficient(cone) : 0.0, cone.first_row, friction ? cone.rows : 0});
                continue;
            }
            for (std::int32_t i = 0; i < cone.rows; ++i) {
                const auto [lo, hi] = kind.interval(cone, i);
                lower_[cone.first_row + i] = lo / p_[cone.first_row + i];
                upper_[cone.first_row + i] = hi / p_[cone.first_row + i];
            }
            for (std::int32_t i = 0; i < cone.rows; i += longest_interval)
                intervals_.push_back({cone.first_row + i, std::min(longest_interval, cone.rows - i)});
        }
        divide();
    }

    /// The rows in parts, in their order; since load().
    [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }

    /// body(part) for all parts, by all members of the team.
    template <class Body>
    void for_parts(Team& team, const Body& body) const {
        team.run([&](int member) {
            const auto [first, last] = team.share(parts_.size(), member);
            for (std::size_t k = first; k < last; ++k) body(parts_[k]);
        });
    }
    /// The sums over all parts of the Count numbers that body(part) returns as an array.
    template <std::size_t Count, class Body>
    [[nodiscard]] std::array<double, Count> sums_over_parts(Team& team, const Body& body) const {
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

    /// A product with N̂ in two steps: first what concerns all rows at once, by all members of the team …
    void begin_product(Team& team, const Vector& lambda) const {
        if (rows_.entries() > 0) {
            if (team.size() > 1) {
                if (shares_.members() != team.size()) shares_ = ColumnShares(rows_, work_.size(), team.size());
                team.run([&](int member) { shares_.transpose_multiply(rows_, lambda.data(), work_.data(), member); });
            } else {
                work_.setZero();
                rows_.transpose_multiply_add(lambda.data(), work_.data());
            }
            if (!whitened_) {
                velocity_ = work_.head(velocity_.size());
                operator_.inverse().apply(velocity_);
                work_.head(velocity_.size()) = velocity_;
            }
        }
        if (square_.entries() > 0) padded_.head(lambda.size()) = lambda;
    }
    /// … then the rows of a part: result ← N̂ λ̂ there (m), with the λ̂ of begin_product.
    void finish_product(const Part& part, Vector& result) const {
        part.of(result).setZero();
        const std::size_t last = part.first_group + part.groups;
        if (rows_.entries() > 0) rows_.multiply(work_.data(), result.data(), result.data(), part.first_group, last);
        if (square_.entries() > 0)
            square_.multiply(padded_.data(), result.data(), result.data(), part.first_group, last);
    }

    /// result ← N̂ λ̂; both m. Allocates nothing (but in Eigen's solve with a sparse factor).
    void multiply(const Vector& lambda, Vector& result) const {
        Team alone(1);
        multiply(alone, lambda, result);
    }
    void multiply(Team& team, const Vector& lambda, Vector& result) const {
        result.resize(lambda.size());
        begin_product(team, lambda);
        for_parts(team, [&](const Part& part) { finish_product(part, result); });
    }

    /// gradient ← N̂ λ̂ + r̂ = û; both m.
    void gradient(const Vector& lambda, Vector& result) const {
        multiply(lambda, result);
        result += r_;
    }

    /// λ̂ ← its Euclidean projection onto Υ̂; m.
    void project(Vector& lambda) const {
        for (const Part& part : parts_) project(part, lambda);
    }
    /// The rows of one part.
    void project(const Part& part, Vector& lambda) const {
        for (std::size_t k = part.first_block; k < part.first_block + part.blocks; ++k) {
            const Contact& contact = contacts_[k];
            if (contact.rows == 3) {
                FrictionCone::project_with_slope(contact.mu, 3, lambda.data() + contact.first);
            } else {
                project_block(blocks_[k], lambda.data() + blocks_[k].first);
            }
        }
        for (std::size_t k = part.first_interval; k < part.first_interval + part.intervals; ++k)
            for (std::int32_t i = intervals_[k].first; i < intervals_[k].first + intervals_[k].rows; ++i)
                lambda[i] = std::min(upper_[i], std::max(lower_[i], lambda[i]));
    }

    /// The natural error of λ̂ with û without De Saxcé term; both m. With the exact Coulomb law the term is added here:
    /// a friction block has one scalar p, so that p μ‖u_t‖ = μ‖û_t‖. A row whose p differs from its block's s has the
    /// unit step (s/p)² of û.
    [[nodiscard]] double natural(const Vector& lambda, const Vector& velocity) const {
        double sum = 0.0;
        for (const Part& part : parts_) sum += natural_square(part, lambda, velocity);
        return natural_from(sum);
    }
    /// The natural error from the sum of its parts' squares.
    [[nodiscard]] double natural_from(double sum) const { return std::sqrt(sum) / residual_.reference(); }
    /// One part's share.
    [[nodiscard]] double natural_square(const Part& part, const Vector& lambda, const Vector& velocity) const {
        double sum = 0.0, sums[3] = {};  // of three rows apart: their additions do not wait for one another
        std::array<double, largest_block_rows> trial;
        for (std::size_t k = part.first_block; k < part.first_block + part.blocks; ++k) {
            const Contact& contact = contacts_[k];
            const double* l = lambda.data() + contact.first;
            const double* u = velocity.data() + contact.first;
            if (contact.rows == 3 && !coulomb_) {
                for (std::size_t i = 0; i < 3; ++i) trial[i] = l[i] - u[i];
                FrictionCone::project_with_slope(contact.mu, 3, trial.data());
                for (std::size_t i = 0; i < 3; ++i) sums[i] += (l[i] - trial[i]) * (l[i] - trial[i]);
                continue;
            }
            const Block& block = blocks_[k];
            for (std::int32_t i = 0; i < block.rows; ++i) trial[i] = l[i] - u[i];
            if (coulomb_) trial[0] -= de_saxce(block.cone, u);
            project_block(block, trial.data());
            for (std::int32_t i = 0; i < block.rows; ++i) sum += (l[i] - trial[i]) * (l[i] - trial[i]);
        }
        for (std::size_t k = part.first_interval; k < part.first_interval + part.intervals; ++k) {
            const Interval& run = intervals_[k];
            for (std::int32_t i = run.first; i < run.first + run.rows; ++i) {
                const double w = ratio_[i];
                const double change =
                    std::min(lambda[i] - lower_[i], std::max(lambda[i] - upper_[i], w * w * velocity[i]));
                sum += change * change / (w * w);
            }
        }
        return sum + sums[0] + sums[1] + sums[2];
    }

    /// The natural error as the host will measure it: x = H⁻¹(a + Dᵀλ) and u = D x + E λ + b computed anew from λ (m,
    /// in the problem's own units). Leaves x (n) in velocity.
    [[nodiscard]] double measured(const ProblemView& problem, const Vector& lambda, Vector& velocity) const {
        velocity = operator_.velocity(problem, lambda);
        Vector u = problem.b;
        if (problem.n > 0) u.noalias() += problem.D * velocity;
        if (problem.E.nonZeros() > 0) u.noalias() += problem.E * lambda;
        return residual_.natural(lambda, u);
    }

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

    static constexpr std::int32_t longest_interval = 512, part_rows = 1024;

    static void project_block(const Block& block, double* lambda) {
        if (block.unit == 1.0) return sdk::project(block.cone, lambda);
        for (std::int32_t i = 0; i < block.rows; ++i) lambda[i] *= block.unit;
        sdk::project(block.cone, lambda);
        for (std::int32_t i = 0; i < block.rows; ++i) lambda[i] /= block.unit;
    }

    void scale_rows(const ProblemView& problem) {
        const Vector& diagonal = operator_.diagonal();
        const std::vector<double> block = block_scaling(problem.cones, diagonal);
        p_.resize(problem.m);
        ratio_.resize(problem.m);
        groups_.clear();
        for (std::size_t c = 0; c < problem.cones.size(); ++c) {
            const delassus_cone& cone = problem.cones[c];
            const bool whole = !is_separable(cone);
            if (whole) groups_.push_back({cone.first_row, cone.rows});
            for (std::int32_t i = cone.first_row; i < cone.first_row + cone.rows; ++i) {
                p_[i] = whole || !(diagonal[i] > 0.0) ? block[c] : 1.0 / std::sqrt(diagonal[i]);
                ratio_[i] = block[c] / p_[i];
                if (!whole) groups_.push_back({i, 1});
            }
        }
    }

    enum class Form { Whitened, Solved, Formed };

    // With a diagonal or block-diagonal H, Ŵ has about as many entries as D. With a sparse H a row of Ŵ reaches up the
    // elimination tree: then the alternatives are D̂ with two triangular solves a product, or for few rows N̂ itself.
    // Costs are counted in multiplications.
    [[nodiscard]] Form cheapest_form(const ProblemView& problem) const {
        const HInverse& inverse = operator_.inverse();
        if (inverse.kind() != HInverse::Kind::Sparse) return Form::Whitened;
        const double whitened = 2.0 * static_cast<double>(inverse.sparse().reach(problem.D).entries);
        const double solved = 2.0 * static_cast<double>(problem.D.nonZeros() + inverse.factor_entries());
        const double formed = static_cast<double>(problem.m) * static_cast<double>(problem.m);
        if (formed <= std::min(whitened, solved)) return Form::Formed;
        return whitened <= solved ? Form::Whitened : Form::Solved;
    }

    // Cuts the rows into parts of at least part_rows, where no block, interval or group is cut. All three stand in the
    // order of their rows.
    void divide() {
        parts_.clear();
        Part part;
        const auto rows = static_cast<std::int32_t>(p_.size());
        while (part.first < rows) {
            part.first_block += part.blocks;
            part.first_interval += part.intervals;
            part.first_group += part.groups;
            part.blocks = part.intervals = part.groups = 0;
            std::int32_t end = part.first;
            while (end < rows && end - part.first < part_rows) {
                const std::size_t block = part.first_block + part.blocks;
                if (block < blocks_.size() && blocks_[block].first == end) {
                    end += blocks_[block].rows;
                    ++part.blocks;
                } else {
                    end += intervals_[part.first_interval + part.intervals].rows;
                    ++part.intervals;
                }
            }
            while (part.first_group + part.groups < groups_.size() &&
                   groups_[part.first_group + part.groups].first < end)
                ++part.groups;
            part.rows = end - part.first;
            parts_.push_back(part);
            part.first = end;
        }
    }

    void build_operator(const ProblemView& problem) {
        rows_ = {};
        square_ = {};
        shares_ = {};
        work_.setZero(problem.n + chunk_padding);
        velocity_.setZero(problem.n);
        padded_.setZero(problem.m + chunk_padding);
        const Form form = cheapest_form(problem);
        whitened_ = form != Form::Solved;
        const HInverse& inverse = operator_.inverse();
        if (form == Form::Formed) {
            square_ = BlockRows(operator_.formed(problem), groups_, p_.data(), p_.data());
            return;
        }
        if (problem.n > 0 && whitened_) {
            const SparseColumns Z = inverse.half_solved(problem.D);
            const SparseRowsView W(Z.cols(), Z.rows(), Z.nonZeros(), Z.outerIndexPtr(), Z.innerIndexPtr(),
                                   Z.valuePtr());  // the columns of Z are the rows of W = Zᵀ
            rows_ = BlockRows(W, groups_, p_.data(), nullptr);
        } else if (problem.n > 0) {
            rows_ = BlockRows(problem.D, groups_, p_.data(), nullptr);
        }
        if (problem.E.nonZeros() > 0) square_ = BlockRows(problem.E, groups_, p_.data(), p_.data());
    }

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
