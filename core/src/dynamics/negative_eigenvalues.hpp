// SPDX-License-Identifier: BSD-3-Clause
// How many ways an equilibrium is unstable (internal).
#pragma once

#include <cstdint>

#include "delassus/export.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// The number of eigenvalues ω² < −shift of K x = ω² M x among the motions with D x = 0; of the symmetric part of K.
/// M has a positive diagonal, shift > 0. −1 where it is not found: singular, or more than 3000 rows in D.
[[nodiscard]] DELASSUS_API std::int32_t negative_eigenvalues(const SparseMatrix& K, const SparseMatrix& M, double shift,
                                                             const SparseMatrix& D);

}  // namespace delassus
