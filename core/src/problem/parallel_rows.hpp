// SPDX-License-Identifier: BSD-3-Clause
// Rows that are multiples of one another, in the rows of a whole matrix or in those of one process.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "problem/structure.hpp"

namespace delassus {

/// Whether two of the rows of D for which is_rigid(row) holds are parallel. D has the members of SparseMatrix, with
/// indices of any size. directions: memory, one entry a row.
template <class Matrix, class IsRigid>
bool has_parallel_rows(const Matrix& D, IsRigid&& is_rigid, std::vector<RowDirection>& directions) {
    const auto start = [&](std::int32_t row) {
        return static_cast<std::size_t>(D.row_start[static_cast<std::size_t>(row)]);
    };
    directions.clear();
    for (std::int32_t row = 0; row < static_cast<std::int32_t>(D.rows); ++row) {
        const std::size_t begin = start(row), end = start(row + 1);
        if (!is_rigid(row) || begin == end || D.value[begin] == 0.0) continue;
        Hash hash;
        hash.add(D.column.data() + begin, (end - begin) * sizeof D.column[0]);
        // The ratio to the row's first entry, rounded so that parallel rows usually fall into one bucket.
        for (std::size_t k = begin; k < end; ++k) {
            const auto ratio = static_cast<float>(D.value[k] / D.value[begin]);
            hash.add(&ratio, sizeof ratio);
        }
        directions.push_back({hash.value(), row});
    }

    const auto parallel = [&](std::int32_t p, std::int32_t q) {
        const std::size_t p_begin = start(p), q_begin = start(q), length = start(p + 1) - p_begin;
        if (length != start(q + 1) - q_begin) return false;
        for (std::size_t k = 0; k < length; ++k) {
            if (D.column[p_begin + k] != D.column[q_begin + k]) return false;
            const double left = D.value[p_begin + k] * D.value[q_begin];
            const double right = D.value[q_begin + k] * D.value[p_begin];
            if (std::abs(left - right) > 1e-14 * (std::abs(left) + std::abs(right))) return false;
        }
        return true;
    };
    std::sort(directions.begin(), directions.end(), [](const RowDirection& first, const RowDirection& second) {
        return first.hash != second.hash ? first.hash < second.hash : first.row < second.row;
    });
    for (std::size_t i = 0; i < directions.size(); ++i)
        for (std::size_t j = i + 1; j < directions.size() && directions[j].hash == directions[i].hash; ++j)
            if (parallel(directions[i].row, directions[j].row)) return true;
    return false;
}

}  // namespace delassus
