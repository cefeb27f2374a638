// SPDX-License-Identifier: BSD-3-Clause
// The module delassus_sparse_rank: ranks by SuiteSparseQR, which the library itself is not linked with.
#pragma once

#include <cstdint>

extern "C" {

/// The rank of a rows × columns matrix given by compressed columns (column_start: columns + 1; row, value: an entry
/// each, rows ascending): columns whose remainder has a norm up to tolerance count as dependent. −1 where memory or
/// SuiteSparseQR failed.
using DelassusSparseRank = std::int64_t (*)(std::int64_t rows, std::int64_t columns, const std::int32_t* column_start,
                                            const std::int32_t* row, const double* value, double tolerance);
}
