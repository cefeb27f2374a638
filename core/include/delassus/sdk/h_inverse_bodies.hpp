// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/h_inverse.hpp (sdk/compiled_once.hpp).
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/h_inverse.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void HInverse::analyze(const ProblemView& problem) {
    n_ = problem.n;
    if (problem.needs_any(DELASSUS_CAN_REDUCED) || n_ == 0) {
        kind_ = Kind::None;
    } else if (problem.needs_any(DELASSUS_CAN_H_DIAGONAL)) {
        kind_ = Kind::Diagonal;
    } else if (problem.needs_any(DELASSUS_CAN_H_BLOCKS)) {
        kind_ = Kind::Blocks;
    } else if (problem.needs_any(DELASSUS_CAN_H_DEFINITE)) {
        kind_ = Kind::Sparse;
        if (!sparse_) sparse_ = std::make_unique<SparseFactor>();
        if (sparse_->analyze(columns_of(problem), n_)) ++analyses_;
    } else {
        throw std::invalid_argument("H must be symmetric positive definite for this method");
    }
    start_.assign(problem.h_block_start.begin(), problem.h_block_start.end());
    index_.assign(problem.h_block_index.begin(), problem.h_block_index.end());
}

DELASSUS_SDK_FUNCTION void HInverse::factorize(const ProblemView& problem) {
    smallest_relative_pivot_ = 1.0;
    switch (kind_) {
        case Kind::None:
            return;
        case Kind::Diagonal:
            root_.setZero(n_);
            for (Eigen::Index i = 0; i < n_; ++i)
                for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
                    if (entry.col() == i) root_[i] = entry.value();
            if (!(root_.minCoeff() > 0.0)) throw NumericalFailure("H has a diagonal entry that is not positive");
            inverse_ = root_.cwiseInverse();
            root_ = root_.cwiseSqrt();
            return;
        case Kind::Blocks:
            factorize_blocks(problem);
            break;
        case Kind::Sparse:
            if (!sparse_->factorize(columns_of(problem)))
                throw NumericalFailure("the Cholesky factorisation of H failed: H is not positive definite");
            measure_sparse_pivots(problem);
            break;
    }
    ++factorizations_;
}

DELASSUS_SDK_FUNCTION void HInverse::apply(Vector& v) const {
    switch (kind_) {
        case Kind::None:
            return;
        case Kind::Diagonal:
            v.array() *= inverse_.array();
            return;
        case Kind::Blocks:
            apply_blocks(v);
            return;
        case Kind::Sparse:
            sparse_->solve(v);
            return;
    }
}

DELASSUS_SDK_FUNCTION SparseColumns HInverse::half_solved(const SparseRowsView& D) const {
    SparseColumns Z(n_, D.rows());
    std::vector<Eigen::Triplet<double, std::int32_t>> entries;
    sparse_->half_solve(D, sparse_->reach(D),
                        [&](Eigen::Index first, std::span<const std::int32_t> rows, const auto& panel) {
                            for (Eigen::Index j = 0; j < panel.cols(); ++j)
                                for (Eigen::Index i = 0; i < panel.rows(); ++i)
                                    if (panel(i, j) != 0.0)
                                        entries.emplace_back(static_cast<std::int32_t>(first + i),
                                                             rows[static_cast<std::size_t>(j)], panel(i, j));
                        });
    Z.setFromTriplets(entries.begin(), entries.end());
    return Z;
}

DELASSUS_SDK_FUNCTION void CompressedRows::join(const std::vector<CompressedRows>& parts, const Team& team) {
    std::size_t rows = 0, entries = 0;
    for (const CompressedRows& part : parts) {
        rows += part.start.size() - 1;
        entries += part.column.size();
    }
    start.resize(rows + 1);
    column.resize(entries);
    value.resize(entries);
    start[0] = 0;
    team.run([&](int member) {
        const auto [first, last] = team.share(parts.size(), member);
        std::size_t row = 0, entry = 0;
        for (std::size_t k = 0; k < last; ++k) {
            const CompressedRows& part = parts[k];
            if (k >= first) {
                for (std::size_t i = 1; i < part.start.size(); ++i)
                    start[row + i] = static_cast<std::int32_t>(entry) + part.start[i];
                std::copy(part.column.begin(), part.column.end(), column.begin() + static_cast<std::ptrdiff_t>(entry));
                std::copy(part.value.begin(), part.value.end(), value.begin() + static_cast<std::ptrdiff_t>(entry));
            }
            row += part.start.size() - 1;
            entry += part.column.size();
        }
    });
}

DELASSUS_SDK_FUNCTION void HInverse::half_solve_rows(const SparseRowsView& D, CompressedRows& W,
                                                     const Team& team) const {
    const auto members = static_cast<std::size_t>(team.size());
    if (scratch_.size() < members) scratch_.resize(members);
    if (members == 1) return half_solve_rows(D, 0, D.rows(), scratch_[0], W);
    parts_.resize(members);
    team.run([&](int member) {
        const auto [first, last] = team.share(static_cast<std::size_t>(D.rows()), member);
        const auto place = static_cast<std::size_t>(member);
        half_solve_rows(D, static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(last), scratch_[place],
                        parts_[place]);
    });
    W.join(parts_, team);
}

DELASSUS_SDK_FUNCTION void HInverse::half_solve_rows(const SparseRowsView& D, Eigen::Index first, Eigen::Index last,
                                                     RowScratch& scratch, CompressedRows& W) const {
    W.clear();
    const auto entries = static_cast<std::size_t>(D.outerIndexPtr()[last] - D.outerIndexPtr()[first]);
    W.start.reserve(static_cast<std::size_t>(last - first) + 1);
    W.column.reserve(entries);
    W.value.reserve(entries);
    if (kind_ == Kind::Diagonal) {
        for (Eigen::Index row = first; row < last; ++row) {
            for (SparseRowsView::InnerIterator entry(D, row); entry; ++entry)
                if (entry.value() != 0.0)
                    W.put(static_cast<std::int32_t>(entry.col()), entry.value() / root_[entry.col()]);
            W.end_row();
        }
        return;
    }
    for_each_half_solved_row(D, first, last, scratch, [&](Eigen::Index, auto& reach, const Vector& work) {
        if (!std::is_sorted(reach.begin(), reach.end())) std::sort(reach.begin(), reach.end());
        for (const auto j : reach)
            if (work[j] != 0.0) W.put(j, work[j]);
        W.end_row();
    });
}

// H is symmetric, so its compressed rows are its compressed columns.
DELASSUS_SDK_FUNCTION Eigen::Map<const SparseColumns> HInverse::columns_of(const ProblemView& problem) {
    const delassus_matrix& H = problem.raw->H;
    return {H.rows, H.columns, H.entries, H.row_start, H.column, H.value};
}

DELASSUS_SDK_FUNCTION void HInverse::factorize_blocks(const ProblemView& problem) {
    position_.resize(static_cast<std::size_t>(n_));
    block_of_.resize(static_cast<std::size_t>(n_));
    offset_.resize(block_count() + 1);
    offset_[0] = 0;
    for (std::size_t k = 0; k < block_count(); ++k) {
        const auto size = static_cast<std::size_t>(start_[k + 1] - start_[k]);
        offset_[k + 1] = offset_[k] + size * size;
        for (std::size_t i = 0; i < size; ++i) {
            position_[static_cast<std::size_t>(index_[static_cast<std::size_t>(start_[k]) + i])] =
                static_cast<std::int32_t>(i);
            block_of_[static_cast<std::size_t>(index_[static_cast<std::size_t>(start_[k]) + i])] =
                static_cast<std::int32_t>(k);
        }
    }
    inverse_.resize(static_cast<Eigen::Index>(offset_.back()));
    root_.resize(static_cast<Eigen::Index>(offset_.back()));
    Block block, inverse_of_root;
    for (std::size_t k = 0; k < block_count(); ++k) {
        const Eigen::Index size = start_[k + 1] - start_[k];
        if (size > largest_block) throw std::invalid_argument("a block of H is larger than the host allows");
        block.setZero(size, size);
        for (Eigen::Index i = 0; i < size; ++i) {
            for (SparseRowsView::InnerIterator entry(problem.H, index_[static_cast<std::size_t>(start_[k] + i)]); entry;
                 ++entry)
                block(i, position_[static_cast<std::size_t>(entry.col())]) = entry.value();
        }
        const Eigen::LLT<Block> factor(block);
        if (factor.info() != Eigen::Success)
            throw NumericalFailure("block " + std::to_string(k) + " of H is not positive definite");
        for (Eigen::Index i = 0; i < size; ++i) record_pivot(factor.matrixLLT()(i, i), block(i, i));
        const auto offset = static_cast<Eigen::Index>(offset_[k]);
        inverse_of_root.setIdentity(size, size);
        factor.matrixL().solveInPlace(inverse_of_root);
        Eigen::Map<Eigen::MatrixXd>(root_.data() + offset, size, size) = inverse_of_root;
        Eigen::Map<Eigen::MatrixXd>(inverse_.data() + offset, size, size).noalias() =
            inverse_of_root.transpose().lazyProduct(inverse_of_root);
    }
}

DELASSUS_SDK_FUNCTION void HInverse::measure_sparse_pivots(const ProblemView& problem) {
    const Vector root = sparse_->diagonal();
    for (Eigen::Index i = 0; i < n_; ++i)
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            if (entry.col() == i) record_pivot(root[i], entry.value());
}

DELASSUS_SDK_FUNCTION void HInverse::apply_blocks(Vector& v) const {
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, largest_block, 1> gathered;
    for (std::size_t k = 0; k < block_count(); ++k) {
        const Eigen::Index size = start_[k + 1] - start_[k];
        const std::int32_t* index = index_.data() + start_[k];
        gathered.resize(size);
        for (Eigen::Index i = 0; i < size; ++i) gathered[i] = v[index[i]];
        const Eigen::Map<const Eigen::MatrixXd> inverse(inverse_.data() + offset_[k], size, size);
        for (Eigen::Index i = 0; i < size; ++i) v[index[i]] = inverse.col(i).dot(gathered);
    }
}

// One row of D through L⁻¹: leaves the result in work and the touched indices in reach.
DELASSUS_SDK_FUNCTION void HInverse::half_solve_row(const SparseRowsView& D, Eigen::Index row, Vector& work,
                                                    std::vector<std::int32_t>& reach,
                                                    std::vector<std::int32_t>& mark) const {
    reach.clear();
    const auto stamp = static_cast<std::int32_t>(row);
    const auto touch = [&](std::int32_t i) {
        if (mark[static_cast<std::size_t>(i)] == stamp) return false;
        mark[static_cast<std::size_t>(i)] = stamp;
        reach.push_back(i);
        return true;
    };
    switch (kind_) {
        case Kind::None:
            return;
        case Kind::Diagonal:
            for (SparseRowsView::InnerIterator entry(D, row); entry; ++entry) {
                touch(static_cast<std::int32_t>(entry.col()));
                work[entry.col()] = entry.value() / root_[entry.col()];
            }
            return;
        case Kind::Blocks:
            for (SparseRowsView::InnerIterator entry(D, row); entry; ++entry) {
                const auto j = static_cast<std::size_t>(entry.col());
                const auto k = static_cast<std::size_t>(block_of_[j]);
                const Eigen::Index size = start_[k + 1] - start_[k];
                const Eigen::Map<const Eigen::MatrixXd> inverse_of_root(root_.data() + offset_[k], size, size);
                for (Eigen::Index i = position_[j]; i < size; ++i) {
                    const std::int32_t target = index_[static_cast<std::size_t>(start_[k] + i)];
                    touch(target);
                    work[target] += inverse_of_root(i, position_[j]) * entry.value();
                }
            }
            return;
        case Kind::Sparse:
            throw std::logic_error("a sparse factor solves for all rows of D together");
    }
}

}  // namespace delassus::sdk
