// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/delassus_operator.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>
#include <span>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/delassus_operator.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void DelassusOperator::factorize(const ProblemView& problem, bool will_form, const Team& team) {
    inverse_.factorize(problem);
    compute_blocks(problem, will_form, team);
}

DELASSUS_SDK_FUNCTION void DelassusOperator::apply(const ProblemView& problem, const Vector& lambda,
                                                   Vector& result) const {
    if (problem.n > 0) {
        work_.noalias() = problem.D.transpose() * lambda;
        inverse_.apply(work_);
        result.noalias() = problem.D * work_;
    } else {
        result.setZero(problem.m);
    }
    if (problem.E.nonZeros() > 0) result.noalias() += problem.E * lambda;
}

DELASSUS_SDK_FUNCTION Vector DelassusOperator::free_velocity(const ProblemView& problem) const {
    Vector r;
    free_velocity(problem, r);
    return r;
}

DELASSUS_SDK_FUNCTION void DelassusOperator::free_velocity(const ProblemView& problem, Vector& r) const {
    r = problem.b;
    if (problem.n > 0) {
        work_ = problem.a;
        inverse_.apply(work_);
        r.noalias() += problem.D * work_;
    }
}

DELASSUS_SDK_FUNCTION Vector DelassusOperator::velocity(const ProblemView& problem,
                                                        const Eigen::Ref<const Vector>& lambda) const {
    Vector x;
    velocity(problem, lambda, x);
    return x;
}

DELASSUS_SDK_FUNCTION void DelassusOperator::velocity(const ProblemView& problem,
                                                      const Eigen::Ref<const Vector>& lambda, Vector& x) const {
    x = problem.a;
    if (problem.n > 0) {
        x.noalias() += problem.D.transpose() * lambda;
        inverse_.apply(x);
    }
}

DELASSUS_SDK_FUNCTION SparseRows DelassusOperator::formed(const ProblemView& problem) const {
    SparseRows N(problem.m, problem.m);
    if (inertia_.rows() > 0) {
        N = inertia_;
    } else if (problem.n > 0) {
        if (inverse_.kind() == HInverse::Kind::Sparse) {
            const SparseColumns Z = inverse_.half_solved(problem.D);
            N = SparseColumns(Z.transpose() * Z);
        } else {
            const SparseRowsView W = whitened_.view(problem.n);
            N = W * SparseColumns(W.transpose());
        }
    }
    if (problem.E.nonZeros() > 0) N += problem.E;
    N.makeCompressed();
    return N;
}

DELASSUS_SDK_FUNCTION void DelassusOperator::compute_blocks(const ProblemView& problem, bool will_form,
                                                            const Team& team) {
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
        add_inertia(problem, team);
    }
    if (problem.E.nonZeros() > 0) add_compliance(problem);
}

// D H⁻¹ Dᵀ = Σ ZᵀZ over the panels of Z: of all pairs of rows by dense products where most pairs couple, else of
// those in one block.
DELASSUS_SDK_FUNCTION void DelassusOperator::add_inertia_by_panels(const ProblemView& problem, bool will_form) {
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
                    if (!all && (rows[i] >= cone.first_row + cone.rows || (i > j && cone.rows > largest_block))) break;
                    add(rows[i], rows[j], all ? product(p, q) : panel.col(p).dot(panel.col(q)));
                }
            }
        });
    if (!all) return;
    sum.triangularView<Eigen::StrictlyUpper>() = sum.transpose();
    inertia_ = sum.sparseView();
}

// D_c H⁻¹ D_cᵀ from the rows of Z, kept for one block at a time as (index, value) pairs.
DELASSUS_SDK_FUNCTION void DelassusOperator::add_inertia(const ProblemView& problem, const Team& team) {
    inverse_.half_solve_rows(problem.D, whitened_, team);
    const auto& start = whitened_.start;
    const auto& value = whitened_.value;
    // Rows of one contact mostly have the same columns.
    const auto product = [&start, columns = whitened_.column.data(), values = value.data()](std::int32_t row,
                                                                                            std::int32_t other) {
        auto i = start[static_cast<std::size_t>(row)], k = start[static_cast<std::size_t>(other)];
        const auto end = start[static_cast<std::size_t>(row) + 1], last = start[static_cast<std::size_t>(other) + 1];
        double sum = 0.0;
        if (end - i == last - k && std::equal(columns + i, columns + end, columns + k)) {
            for (; i < end; ++i, ++k) sum += values[i] * values[k];
            return sum;
        }
        while (i < end && k < last) {
            if (columns[i] == columns[k]) {
                sum += values[i++] * values[k++];
            } else {
                ++(columns[i] < columns[k] ? i : k);
            }
        }
        return sum;
    };
    const auto add_block = [&](std::size_t c) {
        const std::int32_t first = problem.cones[c].first_row, rows = problem.cones[c].rows;
        double* block = block_offset_[c] < 0 ? nullptr : blocks_.data() + block_offset_[c];
        for (std::int32_t i = 0; i < rows; ++i) {
            double square = 0.0;
            for (auto e = start[static_cast<std::size_t>(first + i)];
                 e < start[static_cast<std::size_t>(first + i) + 1]; ++e)
                square += value[static_cast<std::size_t>(e)] * value[static_cast<std::size_t>(e)];
            diagonal_[first + i] += square;
            if (!block) continue;
            block[i * rows + i] += square;
            for (std::int32_t j = 0; j < i; ++j) {
                const double entry = product(first + i, first + j);
                block[i * rows + j] += entry;
                block[j * rows + i] += entry;
            }
        }
    };
    team.run([&](int member) {
        const auto [first, last] = team.share(problem.cones.size(), member);
        for (std::size_t c = first; c < last; ++c) add_block(c);
    });
}

DELASSUS_SDK_FUNCTION void DelassusOperator::add_compliance(const ProblemView& problem) {
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

}  // namespace delassus::sdk
