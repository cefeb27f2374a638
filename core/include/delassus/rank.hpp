// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "delassus/export.hpp"
#include "delassus/problem.hpp"

namespace delassus {

/// An estimate of the rank of N = D H⁻¹ Dᵀ + E for a definite H: the number of reactions that motion determines. It is
/// the rank of D where E = 0, that of E in a reduced problem, and with both that of [D E] (as N = [D E] diag(H⁻¹, E⁺)
/// [D E]ᵀ). Rows are scaled to unit length first. Dense QR with column pivoting up to some seconds of work, directions
/// below 1e-10 count as zero; beyond, SuiteSparseQR (where it is missing Eigen's sparse QR, which is slow) with 1e-8,
/// which may be a few too many where rows are nearly dependent. Empty if the factorisation failed, usually for lack of
/// memory.
[[nodiscard]] DELASSUS_API std::optional<std::int32_t> estimate_rank(const Problem& problem);

}  // namespace delassus
