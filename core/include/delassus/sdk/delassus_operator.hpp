// SPDX-License-Identifier: BSD-3-Clause
// The Delassus operator N = D H⁻¹ Dᵀ + E (seed, eq. 116), never formed unless asked.
#pragma once

#include <vector>

#include "delassus/sdk/h_inverse.hpp"

namespace delassus::sdk {

/// Products with N, its diagonal blocks, r = D H⁻¹ a + b, and the velocities that go with given reactions.
/// analyze, factorize and the rest are called with the same problem (new a and b are fine).
class DelassusOperator {
public:
    void analyze(const ProblemView& problem) { inverse_.analyze(problem); }

    /// Factors H and computes the diagonal blocks of N. Throws NumericalFailure if H is not positive definite.
    /// will_form: formed() will be called, and N may be made in the same pass over D.
    void factorize(const ProblemView& problem, bool will_form = false) {
        inverse_.factorize(problem);
        compute_blocks(problem, will_form);
    }

    /// As factorize, where the values of H are those of the last factorisation: only D and E are new.
    void refresh(const ProblemView& problem) { compute_blocks(problem, false); }

    /// result ← N λ; both m.
    void apply(const ProblemView& problem, const Vector& lambda, Vector& result) const {
        if (problem.n > 0) {
            work_.noalias() = problem.D.transpose() * lambda;
            inverse_.apply(work_);
            result.noalias() = problem.D * work_;
        } else {
            result.setZero(problem.m);
        }
        if (problem.E.nonZeros() > 0) result.noalias() += problem.E * lambda;
    }

    /// r = D H⁻¹ a + b: the constraint velocities without reactions; m.
    [[nodiscard]] Vector free_velocity(const ProblemView& problem) const {
        Vector r;
        free_velocity(problem, r);
        return r;
    }
    /// The same into r, which is resized.
    void free_velocity(const ProblemView& problem, Vector& r) const {
        r = problem.b;
        if (problem.n > 0) {
            work_ = problem.a;
            inverse_.apply(work_);
            r.noalias() += problem.D * work_;
        }
    }

    /// x = H⁻¹ (a + Dᵀ λ); n.
    template <class Lambda>
    [[nodiscard]] Vector velocity(const ProblemView& problem, const Lambda& lambda) const {
        Vector x;
        velocity(problem, lambda, x);
        return x;
    }
    /// The same into x, which is resized.
    template <class Lambda>
    void velocity(const ProblemView& problem, const Lambda& lambda, Vector& x) const {
        x = problem.a;
        if (problem.n > 0) {
            x.noalias() += problem.D.transpose() * lambda;
            inverse_.apply(x);
        }
    }

    /// The diagonal of N; m.
    [[nodiscard]] const Vector& diagonal() const { return diagonal_; }

    /// N_cc of a block of at most `largest_block` rows, row-major = column-major; null for larger blocks.
    [[nodiscard]] const double* block(std::size_t cone) const {
        return block_offset_[cone] < 0 ? nullptr : blocks_.data() + block_offset_[cone];
    }
    static constexpr int largest_block = 8;

    /// N as a sparse matrix. Costs memory of its fill: dense where H couples everything.
    [[nodiscard]] SparseRows formed(const ProblemView& problem) const {
        SparseRows N(problem.m, problem.m);
        if (inertia_.rows() > 0) {
            N = inertia_;
        } else if (problem.n > 0) {
            const SparseColumns Z = inverse_.half_solved(problem.D);
            N = SparseColumns(Z.transpose() * Z);
        }
        if (problem.E.nonZeros() > 0) N += problem.E;
        N.makeCompressed();
        return N;
    }

    [[nodiscard]] const HInverse& inverse() const { return inverse_; }

private:
    /// Rows up to which N of a sparse H is made beside its blocks, as a dense matrix at first.
    static constexpr Eigen::Index most_rows_formed = 4000;

    void compute_blocks(const ProblemView& problem, bool will_form) {
        if (inertia_.rows() > 0) inertia_.resize(0, 0);  // which allocates, even from nothing to nothing
        diagonal_.setZero(problem.m);
        block_offset_.assign(problem.cones.size(), -1);
        std::ptrdiff_t size = 0;
        for (std::size_t c = 0; c < problem.cones.size(); ++c) {
            if (problem.cones[c].rows > largest_block) continue;
            block_offset_[c] = size;
            size += static_cast<std::ptrdiff_t>(problem.cones[c].rows) * problem.cones[c].rows;
        }
        blocks_.assign(static_cast<std::size_t>(size), 0.0);
        if (problem.n > 0 && inverse_.kind() == HInverse::Kind::Sparse) {
            add_inertia_by_panels(problem, will_form);
        } else if (problem.n > 0) {
            add_inertia(problem);
        }
        if (problem.E.nonZeros() > 0) add_compliance(problem);
    }

    // D H⁻¹ Dᵀ = Σ ZᵀZ over the panels of Z: of all pairs of rows by dense products where most pairs couple, else of
    // those in one block.
    void add_inertia_by_panels(const ProblemView& problem, bool will_form) {
        const SparseFactor& factor = inverse_.sparse();
        const SparseFactor::Reach reach = factor.reach(problem.D);
        const bool all = will_form && problem.m <= most_rows_formed && problem.m * problem.m <= 4 * reach.coupled;
        std::vector<std::size_t> cone_of(static_cast<std::size_t>(problem.m));
        for (std::size_t c = 0; c < problem.cones.size(); ++c)
            for (std::int32_t i = 0; i < problem.cones[c].rows; ++i)
                cone_of[static_cast<std::size_t>(problem.cones[c].first_row + i)] = c;
        Eigen::MatrixXd sum, product;
        if (all) sum.setZero(problem.m, problem.m);
        const auto add = [&](std::int32_t row, std::int32_t column, double value) {  // row ≥ column
            if (all) sum(row, column) += value;
            const std::size_t c = cone_of[static_cast<std::size_t>(column)];
            const delassus_cone& cone = problem.cones[c];
            if (row >= cone.first_row + cone.rows) return;
            if (row == column) diagonal_[row] += value;
            if (block_offset_[c] < 0) return;
            double* block = blocks_.data() + block_offset_[c];
            const std::int32_t i = row - cone.first_row, j = column - cone.first_row;
            block[i * cone.rows + j] += value;
            if (i != j) block[j * cone.rows + i] += value;
        };
        factor.half_solve(
            problem.D, reach, [&](Eigen::Index, std::span<const std::int32_t> rows, const Eigen::MatrixXd& panel) {
                if (all) {
                    product.setZero(panel.cols(), panel.cols());
                    product.selfadjointView<Eigen::Lower>().rankUpdate(panel.transpose());
                }
                for (std::size_t j = 0; j < rows.size(); ++j) {
                    const auto q = static_cast<Eigen::Index>(j);
                    const delassus_cone& cone = problem.cones[cone_of[static_cast<std::size_t>(rows[j])]];
                    for (std::size_t i = j; i < rows.size(); ++i) {
                        const auto p = static_cast<Eigen::Index>(i);
                        if (!all && (rows[i] >= cone.first_row + cone.rows || (i > j && cone.rows > largest_block)))
                            break;
                        add(rows[i], rows[j], all ? product(p, q) : panel.col(p).dot(panel.col(q)));
                    }
                }
            });
        if (!all) return;
        sum.triangularView<Eigen::StrictlyUpper>() = sum.transpose();
        inertia_ = sum.sparseView();
    }

    // D_c H⁻¹ D_cᵀ from the rows of Z, kept for one block at a time as (index, value) pairs.
    void add_inertia(const ProblemView& problem) {
        rows_.resize(largest_block);
        std::size_t c = 0;
        inverse_.for_each_half_solved_row(
            problem.D, [&](Eigen::Index row, const std::vector<std::int32_t>& reach, const Vector& work) {
                while (row >= problem.cones[c].first_row + problem.cones[c].rows) ++c;
                const delassus_cone& cone = problem.cones[c];
                double square = 0.0;
                for (const auto i : reach) square += work[i] * work[i];
                diagonal_[row] += square;
                if (block_offset_[c] < 0) return;
                double* block = blocks_.data() + block_offset_[c];
                const auto local = static_cast<std::size_t>(row - cone.first_row);
                const auto width = static_cast<std::size_t>(cone.rows);
                block[local * width + local] += square;
                for (std::size_t other = 0; other < local; ++other) {
                    double product = 0.0;
                    for (const auto& [i, value] : rows_[other]) product += value * work[i];
                    block[local * width + other] += product;
                    block[other * width + local] += product;
                }
                auto& kept = rows_[local];
                kept.clear();
                for (const auto i : reach) kept.emplace_back(i, work[i]);
            });
    }

    void add_compliance(const ProblemView& problem) {
        for (std::size_t c = 0; c < problem.cones.size(); ++c) {
            const delassus_cone& cone = problem.cones[c];
            for (std::int32_t i = 0; i < cone.rows; ++i) {
                for (SparseRowsView::InnerIterator entry(problem.E, cone.first_row + i); entry; ++entry) {
                    const Eigen::Index j = entry.col() - cone.first_row;
                    if (j < 0 || j >= cone.rows) continue;
                    if (i == j) diagonal_[entry.col()] += entry.value();
                    if (block_offset_[c] >= 0)
                        blocks_[static_cast<std::size_t>(block_offset_[c] + static_cast<std::ptrdiff_t>(i) * cone.rows +
                                                         j)] += entry.value();
                }
            }
        }
    }

    HInverse inverse_;
    SparseRows inertia_;  // D H⁻¹ Dᵀ, where it was made with the blocks
    std::vector<std::vector<std::pair<std::int32_t, double>>> rows_;  // of one block at a time
    Vector diagonal_;
    std::vector<double> blocks_;
    std::vector<std::ptrdiff_t> block_offset_;
    mutable Vector work_;
};

}  // namespace delassus::sdk
