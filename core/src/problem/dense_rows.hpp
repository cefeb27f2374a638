// SPDX-License-Identifier: BSD-3-Clause
// Rows of D as small dense matrices, for passes that every step repeats. All rows of a contact have their entries in
// the same columns, six for each body, so indices and entries of vectors are read once for all of them.
#pragma once

#include <Eigen/Core>

#include "delassus/sdk/problem_view.hpp"

namespace delassus {

/// The rows of one cone with `length` entries each, in the same columns.
template <int length>
struct DenseRows {
    using Array = Eigen::Array<double, length, 1>;

    std::int32_t count;
    const std::int32_t* column;  ///< length
    const double* value;         ///< row-major, count × length

    [[nodiscard]] Eigen::Map<const Array> row(std::int32_t i) const {
        return Eigen::Map<const Array>(value + static_cast<std::ptrdiff_t>(i) * length);
    }
    /// The entries of a vector in the columns.
    template <class Vector>
    [[nodiscard]] Array gather(const Vector& vector) const {
        Array result;
        for (int k = 0; k < length; ++k) result[k] = vector[column[k]];
        return result;
    }
};

/// Prefetches the entries one page ahead of a row: the prefetching of the processor itself ends at each page.
inline void prefetch_after(const delassus_matrix& D, std::int32_t row) {
    const auto ahead = static_cast<std::ptrdiff_t>(D.row_start[row]) + 512;
    if (ahead >= D.entries) return;
    __builtin_prefetch(D.value + ahead);
    __builtin_prefetch(D.column + ahead);
}

/// Calls visit(DenseRows) and returns true if the cone's rows, which share their columns, have the length of a contact
/// of one body (6) or two (12). Returns false otherwise.
template <class Visitor>
bool for_dense_rows(const delassus_matrix& D, const delassus_cone& cone, Visitor&& visit) {
    const auto begin = D.row_start[cone.first_row];
    switch (D.row_start[cone.first_row + 1] - begin) {
        case 6:
            visit(DenseRows<6>{cone.rows, D.column + begin, D.value + begin});
            return true;
        case 12:
            visit(DenseRows<12>{cone.rows, D.column + begin, D.value + begin});
            return true;
        default:
            return false;
    }
}

}  // namespace delassus
