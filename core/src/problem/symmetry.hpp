// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "delassus/problem.hpp"

namespace delassus {

/// Where a square matrix A differs most from its transpose.
struct Asymmetry {
    double relative = 0.0;  ///< max |A − Aᵀ| / max |A|, 0 for a zero matrix
    std::int32_t row = -1;  ///< of that entry, counted from 0; −1 if A is exactly symmetric
    std::int32_t column = -1;
};

/// Asymmetry up to this relative size is rounding.
inline constexpr double symmetry_tolerance = 1e-10;

/// Calls visit(row, column, value, mirrored) for every place where the square, well-formed matrix or its transpose
/// has an entry, in the order of rows, then columns.
template <class Visit>
void visit_with_transpose(const SparseMatrix& matrix, Visit visit) {
    const SparseMatrix transposed = matrix.transposed();
    for (std::int32_t row = 0; row < matrix.rows; ++row) {
        std::int32_t k = matrix.row_start[row];
        std::int32_t t = transposed.row_start[row];
        const std::int32_t k_end = matrix.row_start[row + 1];
        const std::int32_t t_end = transposed.row_start[row + 1];
        while (k < k_end || t < t_end) {
            const std::int32_t left = k < k_end ? matrix.column[k] : matrix.columns;
            const std::int32_t right = t < t_end ? transposed.column[t] : matrix.columns;
            const double value = left <= right ? matrix.value[k] : 0.0;
            const double mirrored = right <= left ? transposed.value[t] : 0.0;
            visit(row, std::min(left, right), value, mirrored);
            k += left <= right ? 1 : 0;
            t += right <= left ? 1 : 0;
        }
    }
}

/// The value at a place; 0 where a well-formed matrix has no entry. The matrix has the members of SparseMatrix, with
/// indices of any size.
template <class Matrix, class Index>
double entry_of(const Matrix& matrix, Index row, Index column) {
    const auto begin = matrix.column.begin() + matrix.row_start[static_cast<std::size_t>(row)];
    const auto end = matrix.column.begin() + matrix.row_start[static_cast<std::size_t>(row) + 1];
    const auto found = std::lower_bound(begin, end, column);
    return found != end && *found == column ? matrix.value[static_cast<std::size_t>(found - matrix.column.begin())]
                                            : 0.0;
}

/// Allocates nothing.
inline Asymmetry asymmetry_of(const SparseMatrix& matrix) {
    double largest = 0.0;
    for (const double v : matrix.value) largest = std::max(largest, std::abs(v));
    Asymmetry result;
    if (largest == 0.0) return result;
    for (std::int32_t row = 0; row < matrix.rows; ++row) {
        for (std::int32_t k = matrix.row_start[row]; k < matrix.row_start[row + 1]; ++k) {
            const double value = matrix.value[k], mirrored = entry_of(matrix, matrix.column[k], row);
            // Divided first, since the difference of two large entries may overflow.
            const double difference = std::abs(value / largest - mirrored / largest);
            if (difference > result.relative || (result.row < 0 && value != mirrored))
                result = {std::max(difference, result.relative), row, matrix.column[k]};
        }
    }
    return result;
}

/// (A + Aᵀ)/2, on the union of both patterns.
inline SparseMatrix symmetric_part(const SparseMatrix& matrix) {
    SparseMatrix result = SparseMatrix::zero(matrix.rows, matrix.columns);
    visit_with_transpose(matrix, [&](std::int32_t row, std::int32_t column, double value, double mirrored) {
        result.column.push_back(column);
        result.value.push_back(value == mirrored ? value : 0.5 * value + 0.5 * mirrored);
        ++result.row_start[row + 1];
    });
    for (std::int32_t row = 0; row < result.rows; ++row) result.row_start[row + 1] += result.row_start[row];
    return result;
}

}  // namespace delassus
