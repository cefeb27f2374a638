// SPDX-License-Identifier: BSD-3-Clause
// A sparse matrix by groups of rows that share their columns: the three rows of a contact touch the same two bodies, so
// one column index serves eighteen coefficients (block_kernels.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "delassus/sdk/block_kernels.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// Rows first … first + rows − 1 of a matrix; at most largest_block_rows where they go into BlockRows.
struct RowGroup {
    std::int32_t first = 0;
    std::int32_t rows = 0;
};

static_assert(largest_block_rows == 6, "with_rows() has a case for each number of rows");

/// The rows of a problem by what is projected together: the blocks of friction, and single rows of separable kinds.
inline std::vector<RowGroup> row_groups(const ConeRange& cones) {
    std::vector<RowGroup> groups;
    for (const delassus_cone& cone : cones) {
        const std::int32_t rows = is_separable(cone) ? 1 : cone.rows;
        for (std::int32_t i = 0; i < cone.rows; i += rows) groups.push_back({cone.first_row + i, rows});
    }
    return groups;
}

/// Vectors over the columns have chunk_padding entries beyond the last; those over the rows need none.
class BlockRows {
public:
    /// A group of rows and the places of its values.
    struct Group {
        std::ptrdiff_t value = 0;  ///< first coefficient
        std::ptrdiff_t chunk = 0;  ///< first chunk
        std::int32_t first = 0, rows = 0, chunks = 0;
    };

    BlockRows() = default;

    /// Copies matrix, scaled by diag(left) · matrix · diag(right); a null pointer is an identity. Group k takes the
    /// matrix's rows groups[k], in any order, each row once; zeros that its rows do not share are stored.
    template <class Matrix>
    BlockRows(const Matrix& matrix, std::span<const RowGroup> groups, const double* left, const double* right) {
        const std::vector<std::int32_t> columns = columns_of(matrix, groups);
        width_ = cheapest_width(columns, groups);
        std::size_t at = 0;
        for (std::size_t k = 0; k < groups.size(); ++k) {
            Group& group = groups_[k];
            group.value = static_cast<std::ptrdiff_t>(value_.size());
            group.chunk = static_cast<std::ptrdiff_t>(start_.size());
            const std::size_t end = at + static_cast<std::size_t>(group.chunks);  // still its number of columns
            std::int32_t reached = -1;
            for (; at < end; ++at) {
                if (columns[at] < reached) continue;
                start_.push_back(columns[at]);
                reached = columns[at] + width_;
            }
            group.chunks = static_cast<std::int32_t>(static_cast<std::ptrdiff_t>(start_.size()) - group.chunk);
            value_.resize(value_.size() +
                          static_cast<std::size_t>(group.chunks) * static_cast<std::size_t>(group.rows * width_));
            const std::int32_t* start = start_.data() + group.chunk;
            for (std::int32_t i = 0; i < group.rows; ++i) {
                for (typename Matrix::InnerIterator entry(matrix, group.first + i); entry; ++entry) {
                    const auto column = static_cast<std::int32_t>(entry.col());
                    const auto place = std::upper_bound(start, start + group.chunks, column) - start - 1;
                    const double scale = (left ? left[group.first + i] : 1.0) * (right ? right[column] : 1.0);
                    value_[static_cast<std::size_t>(group.value + column - start[place]) +
                           place_of_chunk(width_, group.rows, group.chunks, static_cast<int>(place), i)] =
                        scale * entry.value();
                }
            }
        }
    }

    /// The same rows with group order[k] in place k, and so in memory. renumber: rows are counted anew in that order.
    [[nodiscard]] BlockRows reordered(std::span<const std::int32_t> order, bool renumber) const {
        BlockRows result;
        result.width_ = width_;
        result.groups_.reserve(order.size());
        result.start_.reserve(start_.size());
        result.value_.reserve(value_.size());
        std::int32_t row = 0;
        for (const std::int32_t k : order) {
            const Group& from = groups_[static_cast<std::size_t>(k)];
            Group group = from;
            group.value = static_cast<std::ptrdiff_t>(result.value_.size());
            group.chunk = static_cast<std::ptrdiff_t>(result.start_.size());
            if (renumber) group.first = row;
            row += group.rows;
            result.groups_.push_back(group);
            result.start_.insert(result.start_.end(), starts(from), starts(from) + from.chunks);
            const auto size = static_cast<std::ptrdiff_t>(from.chunks) * from.rows * width_;
            result.value_.insert(result.value_.end(), values(from), values(from) + size);
        }
        return result;
    }

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
    void multiply(const double* v, const double* offset, double* result, std::size_t first, std::size_t last) const {
        with_width(width_, [&]<int Width>() {
            for (std::size_t k = first; k < last; ++k) {
                const Group& group = groups_[k];
                with_rows(group.rows, [&]<int Rows>() {
                    multiply_group<Rows, Width>(values(group), starts(group), group.chunks, v, offset + group.first,
                                                result + group.first);
                });
            }
        });
    }

    /// result += matrix · v. result: rows; v: columns, padded.
    void multiply_add(const double* v, double* result) const { multiply(v, result, result, 0, groups_.size()); }

    /// result += matrixᵀ · v. result: columns, padded; v: rows.
    void transpose_multiply_add(const double* v, double* result) const {
        with_width(width_, [&]<int Width>() {
            for (const Group& group : groups_)
                with_rows(group.rows, [&]<int Rows>() {
                    const double* delta = v + group.first;
                    bool zero = true;  // open contacts are many
                    for (int i = 0; i < Rows; ++i) zero = zero && delta[i] == 0.0;
                    if (!zero)
                        transpose_multiply_group<Rows, Width>(values(group), starts(group), group.chunks, delta,
                                                              result);
                });
        });
    }

private:
    // The columns that each group touches, ascending, one group after another; fills groups_, with the number of
    // columns in place of chunks.
    template <class Matrix>
    std::vector<std::int32_t> columns_of(const Matrix& matrix, std::span<const RowGroup> groups) {
        std::vector<std::int32_t> columns;
        std::vector<std::size_t> last(static_cast<std::size_t>(matrix.cols()), 0);
        for (const RowGroup& rows : groups) {
            groups_.push_back({0, 0, rows.first, rows.rows, 0});
            const auto begin = static_cast<std::ptrdiff_t>(columns.size());
            for (std::int32_t i = 0; i < rows.rows; ++i)
                for (typename Matrix::InnerIterator entry(matrix, rows.first + i); entry; ++entry) {
                    auto& mark = last[static_cast<std::size_t>(entry.col())];
                    if (mark == groups_.size()) continue;
                    mark = groups_.size();
                    columns.push_back(static_cast<std::int32_t>(entry.col()));
                }
            std::sort(columns.begin() + begin, columns.end());
            groups_.back().chunks = static_cast<std::int32_t>(static_cast<std::ptrdiff_t>(columns.size()) - begin);
        }
        return columns;
    }

    // A chunk costs about as much as two coefficients more than it holds.
    [[nodiscard]] int cheapest_width(const std::vector<std::int32_t>& columns, std::span<const RowGroup> groups) const {
        constexpr std::array<int, 3> widths = {2, 4, 6};
        std::array<double, 3> cost = {};
        for (std::size_t w = 0; w < widths.size(); ++w) {
            std::size_t at = 0;
            for (std::size_t k = 0; k < groups.size(); ++k) {
                const std::size_t end = at + static_cast<std::size_t>(groups_[k].chunks);
                std::int32_t reached = -1;
                for (; at < end; ++at) {
                    if (columns[at] < reached) continue;
                    reached = columns[at] + widths[w];
                    cost[w] += widths[w] + 2;
                }
            }
        }
        return widths[static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin())];
    }

    std::vector<Group> groups_;
    int width_ = 2;
    std::vector<std::int32_t> start_;  // first column of each chunk
    std::vector<double> value_;
};

}  // namespace delassus::sdk
