// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/partitioned.hpp"

namespace delassus {

/// Visits the entries of an own row of a local matrix, as visit(column, value); columns count through all processes.
template <class Visit>
void for_entries(const LocalMatrix& matrix, std::int64_t row, Visit&& visit) {
    const auto begin = static_cast<std::size_t>(matrix.row_start[static_cast<std::size_t>(row)]);
    const auto end = static_cast<std::size_t>(matrix.row_start[static_cast<std::size_t>(row) + 1]);
    for (auto k = begin; k < end; ++k) visit(matrix.column[k], matrix.value[k]);
}

}  // namespace delassus
