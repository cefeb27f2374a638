// SPDX-License-Identifier: BSD-3-Clause
// Whether an answer proves that a problem has no solution (docs/errors.md).
#pragma once

#include <span>

#include "delassus/needs.hpp"

namespace delassus {

/// A lower bound of the size ‖(R⁻¹x, S⁻¹λ)‖ / ‖S r‖ of every solution. The answer (x, λ) of a solver that claims that
/// there is none proves it; 0 if the answer proves nothing. R = |diag H|^(−½); S and r are those of docs/errors.md with
/// R² in place of H⁻¹. x: n, lambda: m.
[[nodiscard]] double proven_size(const PreparedProblem& problem, std::span<const double> x,
                                 std::span<const double> lambda);

/// From this size on there is no solution for practical purposes. Rounding leaves no proof of more than about 1/ε times
/// the size of the contradiction.
inline constexpr double beyond_all_sizes = 1e8;

}  // namespace delassus
