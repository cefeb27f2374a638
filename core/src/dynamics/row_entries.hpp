// SPDX-License-Identifier: BSD-3-Clause
// Walks over the entries of some rows of a sparse matrix, and speeds of unilateral rows (internal).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "delassus/dynamical_system.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// act(row, column, value) for the entries of so many rows from the first on.
template <class Act>
void for_each_entry(const SparseMatrix& matrix, std::size_t first, std::size_t rows, const Act& act) {
    for (std::size_t row = first; row < first + rows; ++row)
        for (auto e = static_cast<std::size_t>(matrix.row_start[row]);
             e < static_cast<std::size_t>(matrix.row_start[row + 1]); ++e)
            act(row, static_cast<std::size_t>(matrix.column[e]), matrix.value[e]);
}

/// A row of D diag(H)⁻¹ Dᵀ at a column. diagonal: of H; columns of D ascend.
inline double coupling(const SparseMatrix& D, const std::vector<double>& diagonal, std::size_t row, std::size_t other) {
    const auto begin = D.column.begin() + D.row_start[other], end = D.column.begin() + D.row_start[other + 1];
    double sum = 0.0;
    for_each_entry(D, row, 1, [&](std::size_t, std::size_t column, double value) {
        const auto found = std::lower_bound(begin, end, static_cast<std::int32_t>(column));
        if (found != end && *found == static_cast<std::int32_t>(column))
            sum += value * D.value[static_cast<std::size_t>(found - D.column.begin())] / diagonal[column];
    });
    return sum;
}

/// The diagonal entry of D diag(H)⁻¹ Dᵀ at a row. diagonal: of H.
inline double mobility_of(const SparseMatrix& D, const std::vector<double>& diagonal, std::size_t row) {
    double sum = 0.0;
    for_each_entry(D, row, 1,
                   [&](std::size_t, std::size_t column, double value) { sum += value * value / diagonal[column]; });
    return sum;
}

/// The speed of a row at velocities v, n, with the rates that prescribed motions have at the state of the rows itself.
inline double speed_now(const UnilateralRows& rows, std::size_t row, const double* v) {
    return rows.speed(row, v) - rows.rows()[row].rate + rows.rows()[row].rate_now;
}

}  // namespace delassus
