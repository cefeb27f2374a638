// SPDX-License-Identifier: BSD-3-Clause
// A problem as the sweeps see it: blocks, their rows, their local problems.
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/dense_algebra.hpp"
#include "delassus/sdk/team.hpp"
#include "other_parts.hpp"
#include "sweep.hpp"
#include "sweep_order.hpp"

namespace delassus::pgs {

/// The rows of a block, and the cone of the problem that they belong to.
struct Block {
    sdk::RowGroup rows;
    std::int32_t cone = 0;
};

/// Blocks that a sweep visits: a friction cone is one, free rows are one where there are at most six of them, and the
/// other kinds are visited row by row.
inline std::vector<Block> blocks_of(const sdk::ConeRange& cones) {
    std::vector<Block> blocks;
    for (std::size_t c = 0; c < cones.size(); ++c) {
        const bool together = cones[c].kind == DELASSUS_CONE_FRICTION ||
                              (cones[c].kind == DELASSUS_CONE_FREE && cones[c].rows <= sdk::largest_block_rows);
        const std::int32_t rows = together ? cones[c].rows : 1;
        for (std::int32_t i = 0; i < cones[c].rows; i += rows)
            blocks.push_back({{cones[c].first_row + i, rows}, static_cast<std::int32_t>(c)});
    }
    return blocks;
}

/// Whether E is zero off its diagonal and not negative on it.
inline bool is_nonnegative_diagonal(const sdk::SparseRowsView& E) {
    for (Eigen::Index i = 0; i < E.outerSize(); ++i)
        for (sdk::SparseRowsView::InnerIterator entry(E, i); entry; ++entry)
            if (entry.value() != 0.0 && (entry.col() != i || entry.value() < 0.0)) return false;
    return true;
}

/// Whether the sweep can work on velocities: then N is never formed.
inline bool can_sweep_on_velocities(const sdk::ProblemView& problem) {
    return problem.n > 0 && problem.needs_any(DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS) &&
           is_nonnegative_diagonal(problem.E);
}

/// The state that a sweep changes, with rows in the order of the sweep.
struct SweepState {
    sdk::Vector z;       ///< v̂, or λ; padded
    sdk::Vector lambda;  ///< on velocities: λ
};

class Model {
public:
    /// Shares the work of all that follows; the bits do not depend on the team. *team.raw() must live until the next
    /// call.
    void use(const sdk::Team& team) { team_ = team; }
    [[nodiscard]] const sdk::Team& team() const { return team_; }
    /// The model is that of one part; the others must live as long as it. Only sweeps on velocities take parts. Columns
    /// that several parts have are whole in each, with a share of H and a: the problem's, divided by the number of
    /// parts.
    void join(const OtherParts& others) { others_ = &others; }
    [[nodiscard]] const OtherParts& others() const { return *others_; }

    /// The operator is factorised; exact: one-contact problems are solved. Throws std::length_error where N would be
    /// too large to form.
    void build(const sdk::ProblemView& problem, const sdk::DelassusOperator& N, bool on_velocities, bool jacobi,
               bool exact, Ordering ordering) {
        on_velocities_ = on_velocities;
        states_ = on_velocities ? problem.n + problem.m : problem.m;
        if (!on_velocities) check_size(problem);
        const sdk::SparseRows formed = on_velocities ? sdk::SparseRows() : N.formed(problem);
        std::vector<Block> blocks = blocks_of(problem.cones);
        std::vector<sdk::RowGroup> groups;
        for (const Block& block : blocks) groups.push_back(block.rows);
        const auto take = [&](const sdk::BlockRows::Matrix& matrix) {
            rows_.lay_out(matrix, groups);
            order_ = SweepOrder::make(rows_, ordering, on_velocities);
            if (ordering != Ordering::Given || on_velocities) rows_.reorder(order_.block, on_velocities);
            blocks_.clear();
            row_.clear();
            for (std::size_t k = 0; k < blocks.size(); ++k) {
                blocks_.push_back(blocks[static_cast<std::size_t>(order_.block[k])]);
                groups[k] = blocks_.back().rows;
                for (std::int32_t i = 0; i < groups[k].rows; ++i) row_.push_back(groups[k].first + i);
            }
            rows_.fill(matrix, groups, nullptr, nullptr, team_);
            if (!order_.range.empty()) rows_.renumber_columns(order_.range);
        };
        if (on_velocities) {
            take(whitened_jacobian(problem, N));
        } else {
            take(formed);
        }
        build_local_problems(problem, N, jacobi, exact);
    }

    /// μ and bounds, and what the sweep starts from; call it at each solve. scaling: s_c by cones
    /// (sdk::block_scaling).
    void set_right_hand_side(const sdk::ProblemView& problem, const sdk::DelassusOperator& N,
                             const std::vector<double>& scaling) {
        for (std::size_t k = 0; k < blocks_.size(); ++k) {
            const delassus_cone& cone = problem.cones[static_cast<std::size_t>(blocks_[k].cone)];
            LocalBlock& local = local_.block[k];
            if (cone.kind == DELASSUS_CONE_FRICTION) local.mu = sdk::friction_coefficient(cone);
            if (cone.kind == DELASSUS_CONE_NONNEGATIVE) local.lo = 0.0;
            if (cone.kind == DELASSUS_CONE_BOX) {
                local.lo = cone.lo[blocks_[k].rows.first - cone.first_row];
                local.hi = cone.hi[blocks_[k].rows.first - cone.first_row];
            }
        }
        std::fill(local_.kappa.begin(), local_.kappa.end(), 0.0);
        squares_.resize(blocks_.size());
        for (std::size_t k = 0; k < blocks_.size(); ++k) {
            const double s = scaling[static_cast<std::size_t>(blocks_[k].cone)];
            squares_[k] = s * s;
        }
        sliding_.assign(blocks_.size(), 0.0);
        if (on_velocities_) {
            to_sweep(problem.b, offset_);
            free_state_.setZero(states_ + sdk::chunk_padding);
            free_state_.head(problem.n) = whitened(problem, N.inverse());
            renumber(free_state_);
        } else {
            offset_ = N.free_velocity(problem);
            velocities_.setZero(problem.m);
        }
    }

    /// The state that belongs to λ (m, as the problem counts rows).
    void state_of(const sdk::Vector& lambda, SweepState& state) const {
        if (on_velocities_) {
            to_sweep(lambda, state.lambda);
            renew(state);
        } else {
            state.z.setZero(states_ + sdk::chunk_padding);
            state.z.head(lambda.size()) = lambda;
        }
    }
    /// λ of a state; m, in the order of the sweep.
    [[nodiscard]] Eigen::VectorBlock<sdk::Vector> swept(SweepState& state) const {
        return on_velocities_ ? state.lambda.head(offset_.size()) : state.z.head(offset_.size());
    }
    /// The rest of the state from swept(state).
    void renew(SweepState& state) const {
        if (!on_velocities_) return;
        state.z = free_state_;
        run_pieces(Direction::Forward, [&](std::size_t k) {
            rows_.transpose_multiply_add(state.lambda.data(), state.z.data(), order_.piece[k], order_.piece[k + 1]);
        });
        reconcile(state);
    }
    /// λ of a state; m, as the problem counts rows.
    void reactions(const SweepState& state, sdk::Vector& lambda) const {
        if (on_velocities_) {
            to_problem(state.lambda, lambda);
        } else {
            lambda = state.z.head(offset_.size());
        }
    }

    /// One Gauss–Seidel sweep.
    void sweep_in_place(const SweepRule& rule, SweepState& state) const {
        run_pieces(rule.direction,
                   [&](std::size_t k) { visit_range(rule, state, state.z, order_.piece[k], order_.piece[k + 1]); });
        reconcile(state);
    }

    /// As sweep_in_place, and what look() would return if each block's residual were that of the moment of its visit:
    /// about the error before the sweep, at no pass over the rows of its own. This and what follows is of the own part.
    [[nodiscard]] double recorded_sweep(const SweepRule& rule, SweepState& state) {
        sums_.assign(order_.piece.size() - 1, 0.0);
        run_pieces(rule.direction, [&](std::size_t k) {
            Record record{squares_.data(), sliding_.data()};
            visit_range(rule, state, state.z, order_.piece[k], order_.piece[k + 1], &record);
            sums_[k] = record.sum;
        });
        reconcile(state);
        return std::accumulate(sums_.begin(), sums_.end(), 0.0);
    }

    /// One Jacobi step; next is work space.
    void jacobi_step(const SweepRule& rule, SweepState& state, sdk::Vector& next) const {
        next = state.z;
        visit_range(rule, state, next, 0, blocks_.size());
        state.z.swap(next);
        reconcile(state);
    }

    /// The sum of the squared natural residuals of all blocks (sdk::NaturalResidual, not yet divided by the reference).
    /// Keeps De Saxcé's terms μ‖u_t‖.
    [[nodiscard]] double look(const SweepState& state, bool coulomb) {
        constexpr std::size_t part = 512;
        const std::size_t parts = (blocks_.size() + part - 1) / part;
        sums_.resize(parts);
        const double* lambda = on_velocities_ ? state.lambda.data() : state.z.data();
        team_.run([&](int member) {
            const auto [first, last] = team_.share(parts, member);
            for (std::size_t k = first; k < last; ++k) {
                Record record{squares_.data(), sliding_.data()};
                look_at(rows_, k * part, std::min(blocks_.size(), (k + 1) * part), local_, coulomb, offset_.data(),
                        state.z.data(), lambda, record);
                sums_[k] = record.sum;
            }
        });
        return std::accumulate(sums_.begin(), sums_.end(), 0.0);
    }
    /// De Saxcé's terms at the last look() or recorded_sweep(), by blocks; 0 without the Coulomb law and where there is
    /// no friction.
    [[nodiscard]] const std::vector<double>& sliding_terms() const { return sliding_; }
    /// sᵀλ for De Saxcé's terms s by blocks.
    [[nodiscard]] double work_against(const std::vector<double>& terms, const SweepState& state) const {
        const double* lambda = on_velocities_ ? state.lambda.data() : state.z.data();
        double sum = 0.0;
        for (std::size_t k = 0; k < terms.size(); ++k) sum += terms[k] * lambda[rows_.groups()[k].first];
        return sum;
    }
    /// ½λᵀNλ + rᵀλ, up to a constant; on velocities that is ½‖v̂‖² + bᵀλ − ½‖L⁻¹a‖². With the shares of H that join()
    /// asks for, the parts' objectives add up to that of all: k copies of an entry are each 1/√k of it.
    [[nodiscard]] double objective(SweepState& state) {
        const auto lambda = swept(state);
        if (on_velocities_) return 0.5 * state.z.squaredNorm() + lambda.dot(offset_);
        rows_.multiply(state.z.data(), offset_.data(), velocities_.data(), 0, blocks_.size());
        return 0.5 * lambda.dot(velocities_ + offset_);
    }
    /// √N_ii in the order of the sweep, 1 where it is zero: ‖√N_ii δ_i‖ is free of units.
    [[nodiscard]] sdk::Vector metric(const sdk::DelassusOperator& N) const {
        sdk::Vector result;
        to_sweep(N.diagonal(), result);
        return result.unaryExpr([](double diagonal) { return diagonal > 0.0 ? std::sqrt(diagonal) : 1.0; });
    }

    /// Where v̂'s entry of a column stands in a state; on velocities.
    [[nodiscard]] std::size_t place_of_column(std::size_t column) const {
        // The ranges end with the last column that a block touches; what is behind stays where it is.
        const auto width = static_cast<std::size_t>(rows_.width());
        if (column / width >= order_.range.size()) return column;
        return static_cast<std::size_t>(order_.range[column / width]) * width + column % width;
    }

    [[nodiscard]] bool on_velocities() const { return on_velocities_; }
    [[nodiscard]] const sdk::BlockRows& rows() const { return rows_; }
    [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }  ///< as they are visited
    [[nodiscard]] const SweepOrder& order() const { return order_; }
    [[nodiscard]] const LocalProblems& local() const { return local_; }

private:
    void visit_range(const SweepRule& rule, SweepState& state, sdk::Vector& next, std::size_t first, std::size_t last,
                     Record* record = nullptr) const {
        if (on_velocities_) {
            visit<true>(rows_, first, last, local_, rule, offset_.data(), state.z.data(), next.data(),
                        state.lambda.data(), record);
        } else {
            visit<false>(rows_, first, last, local_, rule, offset_.data(), state.z.data(), next.data(), nullptr,
                         record);
        }
    }

    void reconcile(SweepState& state) const {
        if (others_->exist()) others_->reconcile({state.z.data(), static_cast<std::size_t>(state.z.size())});
    }

    // visit(k) for all pieces of the order, those of a phase by the members of the team.
    template <class Visit>
    void run_pieces(Direction direction, const Visit& visit) const {
        team_.run([&](int member) { order_.run(team_, member, direction == Direction::Forward, visit); });
    }

    // v̂ as the rows count its entries.
    void renumber(sdk::Vector& state) const {
        if (order_.range.empty()) return;
        const sdk::Vector before = state;
        const int width = rows_.width();
        for (std::size_t k = 0; k < order_.range.size(); ++k)
            std::copy_n(before.data() + static_cast<std::ptrdiff_t>(k) * width, width,
                        state.data() + order_.range[k] * width);
    }

    template <class Rows>
    void to_sweep(const Rows& by_problem, sdk::Vector& by_sweep) const {
        by_sweep.resize(by_problem.size());
        for (std::size_t i = 0; i < row_.size(); ++i) by_sweep[static_cast<Eigen::Index>(i)] = by_problem[row_[i]];
    }
    void to_problem(const sdk::Vector& by_sweep, sdk::Vector& by_problem) const {
        by_problem.resize(by_sweep.size());
        for (std::size_t i = 0; i < row_.size(); ++i) by_problem[row_[i]] = by_sweep[static_cast<Eigen::Index>(i)];
    }

    // D̂ = D L⁻ᵀ with H = L Lᵀ, m × (n + m): with v̂ = Lᵀv, D v = D̂ v̂ and an impulse changes v̂ by D̂ᵀδ, so that the
    // sweep needs one set of rows instead of D and H⁻¹Dᵀ. A diagonal compliance is one more velocity of its own for
    // each row: √E_ii in column n + i adds E_ii to N_ii.
    sdk::SparseRowsView whitened_jacobian(const sdk::ProblemView& problem, const sdk::DelassusOperator& N) {
        if (problem.E.nonZeros() == 0) return N.whitened().view(states_);
        const sdk::SparseRowsView without = N.whitened().view(problem.n);
        with_compliance_.clear();
        for (Eigen::Index row = 0; row < problem.m; ++row) {
            for (sdk::SparseRowsView::InnerIterator entry(without, row); entry; ++entry)
                with_compliance_.put(static_cast<std::int32_t>(entry.col()), entry.value());
            const double compliance = problem.E.coeff(row, row);
            if (compliance > 0.0)
                with_compliance_.put(static_cast<std::int32_t>(problem.n + row), std::sqrt(compliance));
            with_compliance_.end_row();
        }
        return with_compliance_.view(states_);
    }

    // L⁻¹a: a half solve with a as the single row of a matrix.
    static sdk::Vector whitened(const sdk::ProblemView& problem, const sdk::HInverse& inverse) {
        std::vector<std::int32_t> column(static_cast<std::size_t>(problem.n));
        for (std::size_t j = 0; j < column.size(); ++j) column[j] = static_cast<std::int32_t>(j);
        const std::int32_t start[2] = {0, static_cast<std::int32_t>(problem.n)};
        sdk::Vector result;
        inverse.for_each_half_solved_row(
            sdk::SparseRowsView(1, problem.n, problem.n, start, column.data(), problem.a.data()),
            [&](Eigen::Index, const std::vector<std::int32_t>&, const sdk::Vector& work) { result = work; });
        return result;
    }

    // N couples all rows that reach one connected part of H; its entries are counted by 32-bit numbers.
    static void check_size(const sdk::ProblemView& problem) {
        std::vector<std::int32_t> part(static_cast<std::size_t>(problem.n), 0);
        for (std::size_t k = 0; k + 1 < problem.h_block_start.size(); ++k)
            for (auto i = problem.h_block_start[k]; i < problem.h_block_start[k + 1]; ++i)
                part[static_cast<std::size_t>(problem.h_block_index[static_cast<std::size_t>(i)])] =
                    static_cast<std::int32_t>(k);
        std::vector<double> touching(problem.h_block_start.size(), 0.0);
        std::vector<Eigen::Index> last(problem.h_block_start.size(), -1);
        for (Eigen::Index row = 0; row < problem.m && problem.n > 0; ++row)
            for (sdk::SparseRowsView::InnerIterator entry(problem.D, row); entry; ++entry) {
                const auto k = static_cast<std::size_t>(part[static_cast<std::size_t>(entry.col())]);
                if (last[k] == row) continue;
                last[k] = row;
                touching[k] += 1.0;
            }
        double entries = static_cast<double>(problem.E.nonZeros());
        for (const double count : touching) entries += count * count;
        if (entries > static_cast<double>(std::numeric_limits<std::int32_t>::max()))
            throw std::length_error("pgs would have to form N = D H⁻¹ Dᵀ + E with about " + std::to_string(entries) +
                                    " entries, which is too many; a solver that only multiplies by N can take this");
    }

    void build_local_problems(const sdk::ProblemView& problem, const sdk::DelassusOperator& N, bool jacobi,
                              bool exact) {
        local_ = {};
        local_.block.resize(blocks_.size());
        const std::vector<double> sharing = jacobi && on_velocities_ ? sharing_of_columns() : std::vector<double>();
        const auto matrix_of = [&](std::size_t k, Eigen::MatrixXd& M) {
            const std::int32_t rows = blocks_[k].rows.rows;
            if (jacobi) {
                bounding_block(rows_.groups()[k], sharing, M);
            } else if (rows > 1) {
                M = Eigen::Map<const Eigen::MatrixXd>(N.block(static_cast<std::size_t>(blocks_[k].cone)), rows, rows);
            } else {
                M.setConstant(1, 1, N.diagonal()[blocks_[k].rows.first]);
            }
        };
        team_.run([&](int member) {
            const auto [first, last] = team_.share(blocks_.size(), member);
            Eigen::MatrixXd M;
            for (std::size_t k = first; k < last; ++k) {
                LocalBlock& local = local_.block[k];
                if (problem.cones[static_cast<std::size_t>(blocks_[k].cone)].kind == DELASSUS_CONE_FRICTION) {
                    local.kind = LocalBlock::Kind::Friction;
                } else if (blocks_[k].rows.rows > 1) {
                    local.kind = LocalBlock::Kind::Free;
                    continue;
                }
                matrix_of(k, M);
                local.step = reciprocal(M.rows() == 1 ? M(0, 0) : largest_eigenvalue(M));
            }
        });
        Eigen::MatrixXd M;
        for (std::size_t k = 0; k < blocks_.size(); ++k) {
            LocalBlock& local = local_.block[k];
            if (local.kind == LocalBlock::Kind::Friction && exact) {
                local.matrix = static_cast<std::int32_t>(local_.contact.size());
                matrix_of(k, M);
                local_.contact.emplace_back(blocks_[k].rows.rows, M.data());
            } else if (local.kind == LocalBlock::Kind::Free) {
                local.matrix = static_cast<std::int32_t>(local_.inverse.size());
                matrix_of(k, M);
                append_pseudo_inverse(M);
            }
        }
        local_.kappa.assign(local_.contact.size(), 0.0);
    }

    // How many blocks touch each entry of v̂.
    [[nodiscard]] std::vector<double> sharing_of_columns() const {
        std::vector<double> sharing(static_cast<std::size_t>(states_ + sdk::chunk_padding), 0.0);
        for (const auto& group : rows_.groups())
            for (int k = 0; k < group.chunks; ++k)
                for (int j = 0; j < rows_.width(); ++j) {
                    bool touched = false;
                    for (int i = 0; i < group.rows; ++i) touched = touched || rows_.chunk(group, k, i)[j] != 0.0;
                    if (touched) sharing[static_cast<std::size_t>(rows_.starts(group)[k] + j)] += 1.0;
                }
        return sharing;
    }

    // Gauss–Seidel takes the diagonal block N_cc for M_c. Jacobi moves all blocks at once and needs blocks with N ≼
    // blockdiag(M_c), so that the sum of the local models bounds the objective. On velocities: if w_j blocks touch the
    // entry j of v̂, then
    //     λᵀNλ = Σ_j (Σ_c (D̂_cᵀλ_c)_j)² ≤ Σ_j w_j Σ_c (D̂_cᵀλ_c)_j² = Σ_c λ_cᵀ (D̂_c W D̂_cᵀ) λ_c     (Cauchy–Schwarz).
    // On rows of N: N ≼ diag(Σ_j |N_ij|), as the difference is diagonally dominant.
    void bounding_block(const sdk::BlockRows::Group& group, const std::vector<double>& sharing,
                        Eigen::MatrixXd& M) const {
        M.setZero(group.rows, group.rows);
        for (int k = 0; k < group.chunks; ++k)
            for (int c = 0; c < rows_.width(); ++c) {
                if (!on_velocities_) {
                    for (int i = 0; i < group.rows; ++i) M(i, i) += std::abs(rows_.chunk(group, k, i)[c]);
                    continue;
                }
                const double weight = sharing[static_cast<std::size_t>(rows_.starts(group)[k] + c)];
                for (int i = 0; i < group.rows; ++i)
                    for (int j = 0; j < group.rows; ++j)
                        M(i, j) += weight * rows_.chunk(group, k, i)[c] * rows_.chunk(group, k, j)[c];
            }
    }

    static double reciprocal(double value) { return value > 0.0 ? 1.0 / value : 0.0; }

    static double largest_eigenvalue(const Eigen::MatrixXd& M) {
        if (M.rows() == 2) return 0.5 * (M(0, 0) + M(1, 1) + std::hypot(M(0, 0) - M(1, 1), 2.0 * M(0, 1)));
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
        solver.computeDirect(Eigen::Matrix3d(M), Eigen::EigenvaluesOnly);
        return solver.eigenvalues()[2];
    }

    void append_pseudo_inverse(const Eigen::MatrixXd& M) {
        const sdk::SymmetricEigen eigen(M);
        const double threshold = 1e-12 * std::max(0.0, eigen.values()[M.rows() - 1]);
        const Eigen::MatrixXd result = eigen.with(
            eigen.values().unaryExpr([threshold](double value) { return value > threshold ? 1.0 / value : 0.0; }));
        local_.inverse.insert(local_.inverse.end(), result.data(), result.data() + result.size());
    }

    static inline const OtherParts none_;
    const OtherParts* others_ = &none_;
    sdk::CompressedRows with_compliance_;  // D̂ where there is E
    bool on_velocities_ = false;
    Eigen::Index states_ = 0;  // entries of z without padding
    sdk::BlockRows rows_;      // by visits; on velocities its rows are counted so too
    SweepOrder order_;
    sdk::Team team_;
    std::vector<Block> blocks_;      // by visits, rows as the problem counts them
    std::vector<std::int32_t> row_;  // the problem's row of each row by visits
    LocalProblems local_;
    sdk::Vector offset_;                     // m: b on velocities, r on rows of N
    sdk::Vector free_state_;                 // v̂ without reactions, padded
    sdk::Vector velocities_;                 // work space of objective(); m
    std::vector<double> squares_, sliding_;  // s² and De Saxcé's terms by blocks
    std::vector<double> sums_;               // work space of looks and recorded sweeps
};

}  // namespace delassus::pgs
