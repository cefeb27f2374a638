// SPDX-License-Identifier: BSD-3-Clause
// A sparse matrix by groups of rows that share their columns: the three rows of a contact touch the same two bodies, so
// one column index serves three values.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// Rows first … first + rows − 1 of a matrix.
struct RowGroup {
    std::int32_t first = 0;
    std::int32_t rows = 0;
};

/// The rows of a problem by what is projected together: the blocks of friction, and single rows of the other kinds.
inline std::vector<RowGroup> row_groups(std::span<const delassus_cone> cones) {
    std::vector<RowGroup> groups;
    for (const delassus_cone& cone : cones) {
        const std::int32_t rows = is_separable(cone) ? 1 : cone.rows;
        for (std::int32_t i = 0; i < cone.rows; i += rows) groups.push_back({cone.first_row + i, rows});
    }
    return groups;
}

class BlockRows {
public:
    BlockRows() = default;

    /// Copies matrix, scaled by diag(left) · matrix · diag(right); a null pointer is an identity. The groups follow one
    /// another and cover all rows. Zeros that the rows of a group do not share are stored.
    template <class Matrix>
    BlockRows(const Matrix& matrix, std::span<const RowGroup> groups, const double* left, const double* right) {
        groups_.reserve(groups.size());
        std::vector<std::int32_t> position(static_cast<std::size_t>(matrix.cols()), -1);
        for (const RowGroup& rows : groups) {
            Group group{rows.first, rows.rows, 0, index_.size(), value_.size()};
            for (std::int32_t i = 0; i < rows.rows; ++i) {
                for (typename Matrix::InnerIterator entry(matrix, rows.first + i); entry; ++entry) {
                    auto& place = position[static_cast<std::size_t>(entry.col())];
                    if (place >= 0) continue;
                    place = 0;
                    index_.push_back(static_cast<std::int32_t>(entry.col()));
                }
            }
            const auto begin = index_.begin() + static_cast<std::ptrdiff_t>(group.index);
            std::sort(begin, index_.end());
            group.columns = static_cast<std::int32_t>(index_.end() - begin);
            for (std::int32_t k = 0; k < group.columns; ++k) position[static_cast<std::size_t>(begin[k])] = k;
            value_.resize(group.value + static_cast<std::size_t>(group.columns) * static_cast<std::size_t>(rows.rows));
            for (std::int32_t i = 0; i < rows.rows; ++i) {
                for (typename Matrix::InnerIterator entry(matrix, rows.first + i); entry; ++entry) {
                    const auto j = static_cast<std::size_t>(entry.col());
                    const double scale = (left ? left[rows.first + i] : 1.0) * (right ? right[j] : 1.0);
                    value_[group.value + static_cast<std::size_t>(position[j] * rows.rows + i)] = scale * entry.value();
                }
            }
            for (std::int32_t k = 0; k < group.columns; ++k) position[static_cast<std::size_t>(begin[k])] = -1;
            if (group.columns > 0) groups_.push_back(group);
        }
    }

    /// Stored values, shared zeros included: the cost of a product.
    [[nodiscard]] std::size_t entries() const { return value_.size(); }

    /// result += matrix · v. result: rows; v: columns.
    void multiply_add(const double* v, double* result) const {
        for (const Group& group : groups_) {
            const std::int32_t* index = index_.data() + group.index;
            const double* value = value_.data() + group.value;
            double* out = result + group.first;
            if (group.rows == 3) {
                double sum0 = 0.0, sum1 = 0.0, sum2 = 0.0;
                for (std::int32_t k = 0; k < group.columns; ++k, value += 3) {
                    const double factor = v[index[k]];
                    sum0 += value[0] * factor;
                    sum1 += value[1] * factor;
                    sum2 += value[2] * factor;
                }
                out[0] += sum0;
                out[1] += sum1;
                out[2] += sum2;
            } else if (group.rows == 2) {
                double sum0 = 0.0, sum1 = 0.0;
                for (std::int32_t k = 0; k < group.columns; ++k, value += 2) {
                    const double factor = v[index[k]];
                    sum0 += value[0] * factor;
                    sum1 += value[1] * factor;
                }
                out[0] += sum0;
                out[1] += sum1;
            } else {
                for (std::int32_t k = 0; k < group.columns; ++k, value += group.rows)
                    for (std::int32_t i = 0; i < group.rows; ++i) out[i] += value[i] * v[index[k]];
            }
        }
    }

    /// result += matrixᵀ · v. result: columns; v: rows.
    void transpose_multiply_add(const double* v, double* result) const {
        for (const Group& group : groups_) {
            const std::int32_t* index = index_.data() + group.index;
            const double* value = value_.data() + group.value;
            const double* in = v + group.first;
            if (group.rows == 3) {
                const double v0 = in[0], v1 = in[1], v2 = in[2];
                if (v0 == 0.0 && v1 == 0.0 && v2 == 0.0) continue;  // open contacts are many
                for (std::int32_t k = 0; k < group.columns; ++k, value += 3)
                    result[index[k]] += value[0] * v0 + value[1] * v1 + value[2] * v2;
            } else {
                for (std::int32_t k = 0; k < group.columns; ++k, value += group.rows) {
                    double sum = 0.0;
                    for (std::int32_t i = 0; i < group.rows; ++i) sum += value[i] * in[i];
                    result[index[k]] += sum;
                }
            }
        }
    }

private:
    struct Group {
        std::int32_t first, rows, columns;
        std::size_t index, value;  // where the group starts in index_ and value_
    };
    std::vector<Group> groups_;
    std::vector<std::int32_t> index_;
    std::vector<double> value_;  // column by column within a group
};

}  // namespace delassus::sdk
