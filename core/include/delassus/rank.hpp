// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "delassus/export.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// An estimate of the rank of N = D H⁻¹ Dᵀ + E for a definite H: the number of reactions that motion determines.
/// Rows are scaled to unit length first; singular directions below 1e-10 count as zero. For E = 0 it is the rank of D
/// (dense QR with column pivoting up to 3000 rows and columns, sparse QR beyond); for a reduced problem that of E; with
/// both, that of [D E]. Empty where m exceeds 3000 and E is present.
[[nodiscard]] DELASSUS_API std::optional<std::int32_t> estimate_rank(const Problem& problem);

}  // namespace delassus
