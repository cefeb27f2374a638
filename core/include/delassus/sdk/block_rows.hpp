// SPDX-License-Identifier: BSD-3-Clause
// A sparse matrix by groups of rows that share their columns: the three rows of a contact touch the same two bodies, so
// one column index serves eighteen coefficients (block_kernels.hpp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "delassus/sdk/block_kernels.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus::sdk {

/// Rows first … first + rows − 1 of a matrix; at most largest_block_rows where they go into BlockRows.
struct RowGroup {
    std::int32_t first = 0;
    std::int32_t rows = 0;
};

static_assert(largest_block_rows == 6, "with_rows() has a case for each number of rows");

/// The rows of a problem by what is projected together: the blocks of friction, and single rows of separable kinds.
std::vector<RowGroup> row_groups(const ConeRange& cones);

/// Vectors over the columns have chunk_padding entries beyond the last; those over the rows need none.
class BlockRows {
public:
    using Matrix = Eigen::Ref<const SparseRows>;

    /// A group of rows and the places of its values.
    struct Group {
        std::ptrdiff_t value = 0;  ///< first coefficient
        std::ptrdiff_t chunk = 0;  ///< first chunk
        std::int32_t first = 0, rows = 0, chunks = 0;
    };

    BlockRows() = default;

    /// Copies matrix, scaled by diag(left) · matrix · diag(right); a null pointer is an identity. Group k takes the
    /// matrix's rows groups[k], in any order, each row once; zeros that its rows do not share are stored.
    BlockRows(const Matrix& matrix, std::span<const RowGroup> groups, const double* left, const double* right,
              const Team& team = {});

    /// The same in steps, in memory that is kept. First the places alone:
    void lay_out(const Matrix& matrix, std::span<const RowGroup> groups);
    /// Group order[k] goes to place k, and so in memory. renumber: rows are counted anew in that order. Before fill().
    void reorder(std::span<const std::int32_t> order, bool renumber);
    /// The values, of the same matrix. rows[k]: the rows of the matrix that the group in place k takes.
    void fill(const Matrix& matrix, std::span<const RowGroup> rows, const double* left, const double* right,
              const Team& team = {});

    /// Counts columns anew, after fill(): column k w + j, w = width(), becomes range[k] w + j. All chunks start at
    /// multiples of w.
    void renumber_columns(std::span<const std::int32_t> range);

    /// Stored values, shared zeros included: the cost of a product.
    [[nodiscard]] std::size_t entries() const { return value_.size(); }
    [[nodiscard]] int width() const { return width_; }  ///< of a chunk: 2, 4 or 6 columns
    [[nodiscard]] std::span<const Group> groups() const { return groups_; }
    [[nodiscard]] const double* values(const Group& group) const { return value_.data() + group.value; }
    [[nodiscard]] const std::int32_t* starts(const Group& group) const { return start_.data() + group.chunk; }
    /// The coefficients of a group's row in one of its chunks; width() values.
    [[nodiscard]] const double* chunk(const Group& group, int k, int row) const {
        return values(group) + place_of_chunk(width_, group.rows, group.chunks, k, row);
    }

    /// result ← matrix · v + offset by rows, for the groups first … last − 1. result and offset: rows, and may be one
    /// vector; v: columns, padded.
    void multiply(const double* v, const double* offset, double* result, std::size_t first, std::size_t last) const;

    /// result += matrix · v. result: rows; v: columns, padded.
    void multiply_add(const double* v, double* result) const { multiply(v, result, result, 0, groups_.size()); }

    /// result += matrixᵀ · v, for the groups first … last − 1. result: columns, padded; v: rows.
    void transpose_multiply_add(const double* v, double* result, std::size_t first, std::size_t last) const;
    void transpose_multiply_add(const double* v, double* result) const {
        transpose_multiply_add(v, result, 0, groups_.size());
    }

private:
    void find_columns(const Matrix& matrix, std::span<const RowGroup> groups);

    bool append_shared_columns(const Matrix& matrix, const RowGroup& rows);

    void fill_group(const Matrix& matrix, const RowGroup& rows, const Group& group, const double* left,
                    const double* right);

    [[nodiscard]] int cheapest_width() const;

    void place_values();

    std::vector<Group> groups_;
    int width_ = 2;
    std::vector<std::int32_t> start_;  // first column of each chunk
    std::vector<double> value_;
    std::vector<std::int32_t> columns_;  // of the groups, ascending, one group after another: work space of lay_out()
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/block_rows_bodies.hpp"
#endif
