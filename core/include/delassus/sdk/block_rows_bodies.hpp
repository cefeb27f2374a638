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
    lay_out(matrix, groups);
    std::vector<std::int32_t>().swap(columns_);
    start_.shrink_to_fit();
    fill(matrix, groups, left, right, team);
}

DELASSUS_SDK_FUNCTION void BlockRows::lay_out(const Matrix& matrix, std::span<const RowGroup> groups) {
    find_columns(matrix, groups);
    width_ = cheapest_width();
    std::size_t at = 0;
    start_.clear();
    for (Group& group : groups_) {
        group.chunk = static_cast<std::ptrdiff_t>(start_.size());
        const std::size_t end = at + static_cast<std::size_t>(group.chunks);  // still its number of columns
        std::int32_t reached = -1;
        for (; at < end; ++at) {
            if (columns_[at] < reached) continue;
            start_.push_back(columns_[at]);
            reached = columns_[at] + width_;
        }
        group.chunks = static_cast<std::int32_t>(static_cast<std::ptrdiff_t>(start_.size()) - group.chunk);
    }
    place_values();
}

DELASSUS_SDK_FUNCTION void BlockRows::place_values() {
    std::ptrdiff_t values = 0;
    for (Group& group : groups_) {
        group.value = values;
        values += static_cast<std::ptrdiff_t>(group.chunks) * group.rows * width_;
    }
    value_.resize(static_cast<std::size_t>(values));
}

DELASSUS_SDK_FUNCTION void BlockRows::reorder(std::span<const std::int32_t> order, bool renumber) {
    const std::vector<Group> before = std::move(groups_);
    const std::vector<std::int32_t> starts_before = std::move(start_);
    groups_.clear();
    groups_.reserve(order.size());
    start_.clear();
    start_.reserve(starts_before.size());
    std::int32_t row = 0;
    for (const std::int32_t k : order) {
        Group group = before[static_cast<std::size_t>(k)];
        const auto first = starts_before.begin() + group.chunk;
        group.chunk = static_cast<std::ptrdiff_t>(start_.size());
        start_.insert(start_.end(), first, first + group.chunks);
        if (renumber) group.first = row;
        row += group.rows;
        groups_.push_back(group);
    }
    place_values();
}

DELASSUS_SDK_FUNCTION void BlockRows::fill(const Matrix& matrix, std::span<const RowGroup> rows, const double* left,
                                           const double* right, const Team& team) {
    team.run([&](int member) {
        const auto [first, last] = team.share(groups_.size(), member);
        for (std::size_t k = first; k < last; ++k) fill_group(matrix, rows[k], groups_[k], left, right);
    });
}

DELASSUS_SDK_FUNCTION void BlockRows::renumber_columns(std::span<const std::int32_t> range) {
    for (std::int32_t& start : start_) start = width_ * range[static_cast<std::size_t>(start / width_)];
}

// A row that fills its chunks is copied chunk by chunk.
DELASSUS_SDK_FUNCTION void BlockRows::fill_group(const Matrix& matrix, const RowGroup& rows, const Group& group,
                                                 const double* left, const double* right) {
    const std::int32_t* start = start_.data() + group.chunk;
    double* values = value_.data() + group.value;
    const auto place_of = [&](int chunk, std::int32_t row) {
        return values + place_of_chunk(width_, group.rows, group.chunks, chunk, row);
    };
    for (std::int32_t i = 0; i < group.rows; ++i) {
        const std::int32_t row = rows.first + i;
        const auto* outer = matrix.outerIndexPtr();
        const auto begin = outer[row];
        const auto entries = matrix.isCompressed() ? outer[row + 1] - begin : matrix.innerNonZeroPtr()[row];
        const double* value = matrix.valuePtr() + begin;
        if (!left && !right && entries == group.chunks * width_) {
            for (int chunk = 0; chunk < group.chunks; ++chunk)
                std::copy_n(value + chunk * width_, width_, place_of(chunk, i));
            continue;
        }
        for (int chunk = 0; chunk < group.chunks; ++chunk) std::fill_n(place_of(chunk, i), width_, 0.0);
        const auto* column = matrix.innerIndexPtr() + begin;
        int chunk = 0;  // columns ascend
        for (std::int32_t e = 0; e < entries; ++e) {
            while (column[e] >= start[chunk] + width_) ++chunk;
            const double scale = (left ? left[row] : 1.0) * (right ? right[column[e]] : 1.0);
            place_of(chunk, i)[column[e] - start[chunk]] = scale * value[e];
        }
    }
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

DELASSUS_SDK_FUNCTION void BlockRows::transpose_multiply_add(const double* v, double* result, std::size_t begin,
                                                             std::size_t end) const {
    with_width(width_, [&]<int Width>() {
        for (std::size_t k = begin; k < end; ++k) {
            const Group& group = groups_[k];
            with_rows(group.rows, [&]<int Rows>() {
                const double* delta = v + group.first;
                bool zero = true;  // open contacts are many
                for (int i = 0; i < Rows; ++i) zero = zero && delta[i] == 0.0;
                if (!zero)
                    transpose_multiply_group<Rows, Width>(values(group), starts(group), group.chunks, delta, result);
            });
        }
    });
}

// Where all rows of a group have the same columns, as those of a contact have as a rule, these are the group's.
DELASSUS_SDK_FUNCTION bool BlockRows::append_shared_columns(const Matrix& matrix, const RowGroup& rows) {
    if (!matrix.isCompressed()) return false;
    const auto* start = matrix.outerIndexPtr() + rows.first;
    const auto* first = matrix.innerIndexPtr() + start[0];
    const auto length = start[1] - start[0];
    for (std::int32_t i = 1; i < rows.rows; ++i)
        if (start[i + 1] - start[i] != length || !std::equal(first, first + length, matrix.innerIndexPtr() + start[i]))
            return false;
    columns_.insert(columns_.end(), first, first + length);
    return true;
}

// Fills columns_ and groups_, the latter with the number of columns in place of chunks.
DELASSUS_SDK_FUNCTION void BlockRows::find_columns(const Matrix& matrix, std::span<const RowGroup> groups) {
    groups_.clear();
    groups_.reserve(groups.size());
    columns_.clear();
    std::vector<std::size_t> last;
    for (const RowGroup& rows : groups) {
        groups_.push_back({0, 0, rows.first, rows.rows, 0});
        const auto begin = static_cast<std::ptrdiff_t>(columns_.size());
        if (!append_shared_columns(matrix, rows)) {
            last.resize(static_cast<std::size_t>(matrix.cols()), 0);
            for (std::int32_t i = 0; i < rows.rows; ++i)
                for (Matrix::InnerIterator entry(matrix, rows.first + i); entry; ++entry) {
                    auto& mark = last[static_cast<std::size_t>(entry.col())];
                    if (mark == groups_.size()) continue;
                    mark = groups_.size();
                    columns_.push_back(static_cast<std::int32_t>(entry.col()));
                }
            std::sort(columns_.begin() + begin, columns_.end());
        }
        groups_.back().chunks = static_cast<std::int32_t>(static_cast<std::ptrdiff_t>(columns_.size()) - begin);
    }
}

// A chunk costs about as much as two coefficients more than it holds. Many groups are judged by some of them.
DELASSUS_SDK_FUNCTION int BlockRows::cheapest_width() const {
    constexpr std::array<int, 3> widths = {2, 4, 6};
    constexpr std::size_t judged = 256;
    const std::size_t stride = std::max<std::size_t>(1, groups_.size() / judged);
    std::array<double, 3> cost = {};
    std::size_t at = 0;
    for (std::size_t k = 0; k < groups_.size(); ++k) {
        const auto begin = columns_.begin() + static_cast<std::ptrdiff_t>(at);
        at += static_cast<std::size_t>(groups_[k].chunks);
        if (k % stride != 0) continue;
        for (std::size_t w = 0; w < widths.size(); ++w) {
            std::int32_t reached = -1;
            for (auto column = begin; column != begin + groups_[k].chunks; ++column) {
                if (*column < reached) continue;
                reached = *column + widths[w];
                cost[w] += widths[w] + 2;
            }
        }
    }
    return widths[static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin())];
}

}  // namespace delassus::sdk
