// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/problem.hpp"

namespace delassus {
namespace {

void require_sizes(std::int32_t rows, std::int32_t columns) {
    if (rows < 0 || columns < 0 || rows == std::numeric_limits<std::int32_t>::max()) {
        throw InputError(fmt::format("A matrix cannot have {} rows and {} columns.", rows, columns));
    }
}

}  // namespace

SparseMatrix SparseMatrix::zero(std::int32_t rows, std::int32_t columns) {
    require_sizes(rows, columns);
    SparseMatrix matrix;
    matrix.rows = rows;
    matrix.columns = columns;
    matrix.row_start.assign(static_cast<std::size_t>(rows) + 1, 0);
    return matrix;
}

SparseMatrix SparseMatrix::from_triplets(std::int32_t rows, std::int32_t columns, std::vector<Triplet> triplets) {
    require_sizes(rows, columns);
    if (triplets.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
        throw InputError(
            fmt::format("A matrix of {} entries is too large; at most 2147483647 can be held.", triplets.size()));
    }
    for (const Triplet& t : triplets) {
        if (t.row < 0 || t.row >= rows || t.column < 0 || t.column >= columns) {
            throw InputError(
                fmt::format("The entry at row {}, column {} (counted from 0) lies outside the {} × {} matrix.", t.row,
                            t.column, rows, columns));
        }
    }
    const auto before = [](const Triplet& left, const Triplet& right) {
        return std::pair(left.row, left.column) < std::pair(right.row, right.column);
    };
    // Stable, so that equal places are added up in the order given.
    if (!std::is_sorted(triplets.begin(), triplets.end(), before)) {
        std::stable_sort(triplets.begin(), triplets.end(), before);
    }
    SparseMatrix matrix = zero(rows, columns);
    matrix.column.reserve(triplets.size());
    matrix.value.reserve(triplets.size());
    for (std::size_t k = 0; k < triplets.size(); ++k) {
        const Triplet& t = triplets[k];
        if (k > 0 && triplets[k - 1].row == t.row && triplets[k - 1].column == t.column) {
            matrix.value.back() += t.value;
            continue;
        }
        matrix.column.push_back(t.column);
        matrix.value.push_back(t.value);
        ++matrix.row_start[t.row + 1];
    }
    for (std::int32_t row = 0; row < rows; ++row) matrix.row_start[row + 1] += matrix.row_start[row];
    return matrix;
}

SparseMatrix SparseMatrix::transposed() const {
    SparseMatrix result = zero(columns, rows);
    for (const std::int32_t c : column) ++result.row_start[c + 1];
    for (std::int32_t row = 0; row < columns; ++row) result.row_start[row + 1] += result.row_start[row];
    result.column.resize(column.size());
    result.value.resize(value.size());
    std::vector<std::int32_t> next(result.row_start.begin(), result.row_start.end() - 1);
    for (std::int32_t row = 0; row < rows; ++row) {
        for (std::int32_t k = row_start[row]; k < row_start[row + 1]; ++k) {
            const std::int32_t place = next[column[k]]++;
            result.column[place] = row;
            result.value[place] = value[k];
        }
    }
    return result;
}

void SparseMatrix::multiply_add(double factor, const double* vector, double* result) const {
    for (std::int32_t row = 0; row < rows; ++row) result[row] += factor * row_times(row, vector);
}

void SparseMatrix::transpose_multiply_add(double factor, const double* vector, double* result) const {
    for (std::int32_t row = 0; row < rows; ++row) {
        const double scaled = factor * vector[row];
        for (std::int32_t k = row_start[row]; k < row_start[row + 1]; ++k) result[column[k]] += scaled * value[k];
    }
}

}  // namespace delassus
