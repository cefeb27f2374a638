// SPDX-License-Identifier: BSD-3-Clause
// The bodies that the own rows of D touch, and the inverse of their blocks of H.
#pragma once

#include <vector>

#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/h_inverse.hpp"
#include "exchange.hpp"

namespace delassus::petsc {

/// Own columns and those of other processes that the own rows of D touch. Where H is diagonal or of blocks, foreign
/// bodies are there as a whole, with their blocks of H, so that N's diagonal blocks and W = D L⁻ᵀ come without a word
/// between the processes. Where H couples bodies there are the columns alone.
class Bodies {
public:
    /// Collective.
    void analyze(const Processes& processes, const sdk::LocalProblemView& problem);
    /// Collective. Throws sdk::NumericalFailure on all processes if a block is not positive definite on any.
    void factorize(const sdk::LocalProblemView& problem);
    /// H of all local columns, where it is diagonal or of blocks; zeros inside of blocks are stored. Collective.
    [[nodiscard]] sdk::CompressedRows fetched(const sdk::LocalProblemView& problem) const;

    [[nodiscard]] const Processes& processes() const { return processes_; }
    [[nodiscard]] const Exchange& columns() const { return columns_; }
    /// Of all local columns, where H is diagonal or of blocks; else its kind is None.
    [[nodiscard]] const sdk::HInverse& inverse() const { return inverse_; }

    /// The blocks of H as in delassus_problem, with local columns; no blocks where H couples bodies.
    [[nodiscard]] const std::vector<std::int32_t>& block_start() const { return block_start_; }
    [[nodiscard]] const std::vector<std::int32_t>& block_index() const { return block_index_; }

    /// result += D v; own rows, v local columns.
    void multiply_add(const sdk::LocalProblemView& problem, const sdk::Vector& v, sdk::Vector& result) const;
    /// result += Dᵀ λ of the own rows; local columns, not yet collected.
    template <class Reactions>
    void transpose_multiply_add(const sdk::LocalProblemView& problem, const Reactions& lambda,
                                sdk::Vector& result) const {
        for (Eigen::Index row = 0; row < problem.m; ++row) {
            if (lambda[row] == 0.0) continue;
            const auto end = static_cast<std::size_t>(problem.D.row_start[static_cast<std::size_t>(row) + 1]);
            for (auto e = static_cast<std::size_t>(problem.D.row_start[static_cast<std::size_t>(row)]); e < end; ++e)
                result[columns_.local(problem.D.column[e])] += problem.D.value[e] * lambda[row];
        }
    }

private:
    void find_blocks(const sdk::LocalProblemView& problem);

    Processes processes_;
    Exchange columns_;
    sdk::HInverse inverse_;
    bool has_blocks_ = false, diagonal_ = false;
    int width_ = 1;                                        // of the largest block of all
    std::vector<std::int32_t> block_start_, block_index_;  // local columns, ascending in a block
};

/// Own cones without mobility get the mean trace of all others, of all processes, in the diagonal of N (own rows): what
/// sdk::block_scaling gives them in one process. Collective.
void fill_immobile(const Processes& processes, const sdk::ConeRange& cones, sdk::Vector& diagonal);

/// Rows of a matrix with local columns; the values stay where they are.
class LocalRows {
public:
    /// Rows first … last − 1. Valid until the next call.
    sdk::SparseRowsView view(const sdk::LocalMatrixView& matrix, const Exchange& columns, Eigen::Index first,
                             Eigen::Index last);

private:
    std::vector<std::int32_t> start_, column_;
};

}  // namespace delassus::petsc
