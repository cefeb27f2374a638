// SPDX-License-Identifier: BSD-3-Clause
// H⁻¹ for a symmetric positive definite H of any structure: diagonal, small blocks, or sparse (finite elements).
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include "delassus/sdk/problem_view.hpp"
#include "delassus/sdk/sparse_factor.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus::sdk {

/// Thrown by factorize and solve; the host sees DELASSUS_NUMERICAL_FAILURE with this sentence.
class NumericalFailure : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Compressed rows whose memory serves again.
struct CompressedRows {
    std::vector<std::int32_t> start, column;  ///< columns ascend within a row
    std::vector<double> value;

    void clear() {
        start.assign(1, 0);
        column.clear();
        value.clear();
    }
    void put(std::int32_t j, double entry) {
        column.push_back(j);
        value.push_back(entry);
    }
    void end_row() { start.push_back(static_cast<std::int32_t>(column.size())); }
    /// Takes the rows of all parts, one after another.
    void join(const std::vector<CompressedRows>& parts, const Team& team);
    /// As a matrix of so many columns; valid until the next change.
    [[nodiscard]] SparseRowsView view(Eigen::Index columns) const {
        return {static_cast<Eigen::Index>(start.size()) - 1,
                columns,
                static_cast<Eigen::Index>(value.size()),
                start.data(),
                column.data(),
                value.data()};
    }
};

/// Applies H⁻¹. With H = L Lᵀ (up to the permutation P of the sparse case), it also gives the columns of
/// Z = L⁻¹ P Dᵀ, by which D H⁻¹ Dᵀ = Zᵀ Z.
class HInverse {
public:
    enum class Kind { None, Diagonal, Blocks, Sparse };

    /// Reads the structure from the needs that the host derived. Throws std::invalid_argument unless H is definite.
    /// Where the pattern of a sparse H is that of the last call, its analysis is kept, whatever changed in D.
    void analyze(const ProblemView& problem);

    /// Throws NumericalFailure if H is not positive definite.
    void factorize(const ProblemView& problem);

    /// v ← H⁻¹ v; n entries.
    void apply(Vector& v) const;

    /// Sparse columns of Z = L⁻¹ P Dᵀ (n × m, in the order of the factor's own rows) of a sparse H: D H⁻¹ Dᵀ = Zᵀ Z.
    [[nodiscard]] SparseColumns half_solved(const SparseRowsView& D) const;

    /// W ← Zᵀ = D L⁻ᵀ without its zeros, where H is diagonal or of blocks.
    void half_solve_rows(const SparseRowsView& D, CompressedRows& W, const Team& team = {}) const;

    /// Visits L⁻¹ P Dᵀ row by row of D without storing it, where H is diagonal or of blocks: visit(row, reach, work),
    /// where work (n) is zero but for the indices in reach.
    template <class Visitor>
    void for_each_half_solved_row(const SparseRowsView& D, Visitor&& visit) const {
        scratch_.resize(1);
        for_each_half_solved_row(D, 0, D.rows(), scratch_[0], visit);
    }

    /// The factor of a sparse H.
    [[nodiscard]] const SparseFactor& sparse() const { return *sparse_; }

    /// The smallest L_jj² / H_jj of the Cholesky factor, at most 1: how far each freedom is from depending on the
    /// others, whatever its units. At rounding level H is singular to working precision.
    [[nodiscard]] double smallest_relative_pivot() const { return smallest_relative_pivot_; }

    [[nodiscard]] Kind kind() const { return kind_; }
    /// Entries of L in the sparse case, else 0; a product with H⁻¹ costs twice as many multiplications.
    [[nodiscard]] std::int64_t factor_entries() const {
        return kind_ == Kind::Sparse ? static_cast<std::int64_t>(sparse_->entries()) : 0;
    }
    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }

private:
    /// Of the diagonal blocks that the host shows (DELASSUS_CAN_H_BLOCKS).
    static constexpr int largest_block = 16;
    using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, largest_block, largest_block>;

    /// Memory for rows of Z; one for each thread.
    struct RowScratch {
        Vector work;
        std::vector<std::int32_t> reach, mark;
    };

    template <class Visitor>
    void for_each_half_solved_row(const SparseRowsView& D, Eigen::Index first, Eigen::Index last, RowScratch& scratch,
                                  Visitor&& visit) const {
        scratch.work.setZero(n_);
        scratch.mark.assign(static_cast<std::size_t>(n_), -1);
        for (Eigen::Index row = first; row < last; ++row) {
            half_solve_row(D, row, scratch.work, scratch.reach, scratch.mark);
            visit(row, scratch.reach, scratch.work);
            for (const auto i : scratch.reach) scratch.work[i] = 0.0;
        }
    }

    /// W ← rows first … last − 1 of Zᵀ.
    void half_solve_rows(const SparseRowsView& D, Eigen::Index first, Eigen::Index last, RowScratch& scratch,
                         CompressedRows& W) const;

    static Eigen::Map<const SparseColumns> columns_of(const ProblemView& problem);

    [[nodiscard]] std::size_t block_count() const { return start_.empty() ? 0 : start_.size() - 1; }

    void factorize_blocks(const ProblemView& problem);

    void record_pivot(double root, double diagonal) {
        smallest_relative_pivot_ = std::min(smallest_relative_pivot_, root * root / diagonal);
    }

    void measure_sparse_pivots(const ProblemView& problem);

    void apply_blocks(Vector& v) const;

    void half_solve_row(const SparseRowsView& D, Eigen::Index row, Vector& work, std::vector<std::int32_t>& reach,
                        std::vector<std::int32_t>& mark) const;

    Kind kind_ = Kind::None;
    Eigen::Index n_ = 0;
    Vector inverse_;  // diagonal: 1/H_ii; blocks: the inverses, column-major, one after another
    Vector root_;     // diagonal: √H_ii; blocks: the inverses of the lower Cholesky factors
    std::vector<std::int32_t> start_, index_, position_, block_of_;
    std::vector<std::size_t> offset_;
    std::unique_ptr<SparseFactor> sparse_;
    double smallest_relative_pivot_ = 1.0;
    std::int64_t analyses_ = 0, factorizations_ = 0;
    mutable std::vector<RowScratch> scratch_;
    mutable std::vector<CompressedRows> parts_;  // by threads
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/h_inverse_bodies.hpp"
#endif
