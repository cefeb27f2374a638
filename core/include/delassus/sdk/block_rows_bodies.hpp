// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/block_rows.hpp (sdk/compiled_once.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "delassus/sdk/block_rows.hpp"
#include "delassus/sdk/compiled_once.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION std::vector<RowGroup> row_groups(const ConeRange& cones) {
    std::vector<RowGroup> groups;
    for (const delassus_cone& cone : cones) {
        const std::int32_t rows = is_separable(cone) ? 1 : cone.rows;
        for (std::int32_t i = 0; i < cone.rows; i += rows) groups.push_back({cone.first_row + i, rows});
    }
    return groups;
}

DELASSUS_SDK_FUNCTION BlockRows::BlockRows(const Matrix& matrix, std::span<const RowGroup> groups, const double* left,
                                           const double* right, const Team& team) {
    const std::vector<std::int32_t> columns = columns_of(matrix, groups);
    width_ = cheapest_width(columns, groups);
    std::size_t at = 0;
    std::ptrdiff_t values = 0;
    start_.reserve(columns.size());
    for (std::size_t k = 0; k < groups.size(); ++k) {
        Group& group = groups_[k];
        group.value = values;
        group.chunk = static_cast<std::ptrdiff_t>(start_.size());
        const std::size_t end = at + static_cast<std::size_t>(group.chunks);  // still its number of columns
        std::int32_t reached = -1;
        for (; at < end; ++at) {
            if (columns[at] < reached) continue;
            start_.push_back(columns[at]);
            reached = columns[at] + width_;
        }
        group.chunks = static_cast<std::int32_t>(static_cast<std::ptrdiff_t>(start_.size()) - group.chunk);
        values += static_cast<std::ptrdiff_t>(group.chunks) * group.rows * width_;
    }
    value_.resize(static_cast<std::size_t>(values));
    team.run([&](int member) {
        const auto [first, last] = team.share(groups_.size(), member);
        for (std::size_t k = first; k < last; ++k) fill(matrix, groups_[k], left, right);
    });
}

DELASSUS_SDK_FUNCTION void BlockRows::fill(const Matrix& matrix, const Group& group, const double* left,
                                           const double* right) {
    const std::int32_t* start = start_.data() + group.chunk;
    for (std::int32_t i = 0; i < group.rows; ++i) {
        int place = 0;  // columns ascend
        for (Matrix::InnerIterator entry(matrix, group.first + i); entry; ++entry) {
            const auto column = static_cast<std::int32_t>(entry.col());
            while (column >= start[place] + width_) ++place;
            const double scale = (left ? left[group.first + i] : 1.0) * (right ? right[column] : 1.0);
            value_[static_cast<std::size_t>(group.value + column - start[place]) +
                   place_of_chunk(width_, group.rows, group.chunks, place, i)] = scale * entry.value();
        }
    }
}

DELASSUS_SDK_FUNCTION BlockRows BlockRows::reordered(std::span<const std::int32_t> order, bool renumber) const {
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

DELASSUS_SDK_FUNCTION void BlockRows::multiply(const double* v, const double* offset, double* result, std::size_t first,
                                               std::size_t last) const {
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

DELASSUS_SDK_FUNCTION void BlockRows::transpose_multiply_add(const double* v, double* result) const {
    with_width(width_, [&]<int Width>() {
        for (const Group& group : groups_)
            with_rows(group.rows, [&]<int Rows>() {
                const double* delta = v + group.first;
                bool zero = true;  // open contacts are many
                for (int i = 0; i < Rows; ++i) zero = zero && delta[i] == 0.0;
                if (!zero)
                    transpose_multiply_group<Rows, Width>(values(group), starts(group), group.chunks, delta, result);
            });
    });
}

// Where all rows of a group have the same columns, as those of a contact have as a rule, these are the group's.
DELASSUS_SDK_FUNCTION bool BlockRows::append_shared_columns(const Matrix& matrix, const RowGroup& rows,
                                                            std::vector<std::int32_t>& columns) {
    if (!matrix.isCompressed()) return false;
    const auto* start = matrix.outerIndexPtr() + rows.first;
    const auto* first = matrix.innerIndexPtr() + start[0];
    const auto length = start[1] - start[0];
    for (std::int32_t i = 1; i < rows.rows; ++i)
        if (start[i + 1] - start[i] != length || !std::equal(first, first + length, matrix.innerIndexPtr() + start[i]))
            return false;
    columns.insert(columns.end(), first, first + length);
    return true;
}

// The columns that each group touches, ascending, one group after another; fills groups_, with the number of
// columns in place of chunks.
DELASSUS_SDK_FUNCTION std::vector<std::int32_t> BlockRows::columns_of(const Matrix& matrix,
                                                                      std::span<const RowGroup> groups) {
    groups_.reserve(groups.size());
    std::vector<std::int32_t> columns;
    columns.reserve(static_cast<std::size_t>(matrix.nonZeros()));
    std::vector<std::size_t> last(static_cast<std::size_t>(matrix.cols()), 0);
    for (const RowGroup& rows : groups) {
        groups_.push_back({0, 0, rows.first, rows.rows, 0});
        const auto begin = static_cast<std::ptrdiff_t>(columns.size());
        if (append_shared_columns(matrix, rows, columns)) {
            groups_.back().chunks = static_cast<std::int32_t>(static_cast<std::ptrdiff_t>(columns.size()) - begin);
            continue;
        }
        for (std::int32_t i = 0; i < rows.rows; ++i)
            for (Matrix::InnerIterator entry(matrix, rows.first + i); entry; ++entry) {
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
DELASSUS_SDK_FUNCTION int BlockRows::cheapest_width(const std::vector<std::int32_t>& columns,
                                                    std::span<const RowGroup> groups) const {
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

}  // namespace delassus::sdk
