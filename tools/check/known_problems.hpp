// SPDX-License-Identifier: BSD-3-Clause
// Small problems whose solutions are known in closed form.
//
// Each is built backwards: H, D, E and the cones are written down, then x, and λ and u that fulfil λ ∈ Υ ⊥ u ∈ Υ*; the
// right-hand sides follow as a = H x − Dᵀλ and b = u − D x − E λ. Entries are small integers and simple fractions, so
// that the solution is exact up to the rounding of those two lines.
#pragma once

#include <vector>

#include "delassus/problem.hpp"

namespace delassus::check {

struct KnownProblem {
    Problem problem;
    Solution solution;
    std::vector<double> u;         ///< m; D x + E λ + b at the solution, without De Saxcé term
    bool lambda_is_unique = true;  ///< x always is

    /// a and b for the present H, D, E, x, λ and u.
    void set_right_hand_side();

    /// Another right-hand side, the same matrices: x moves, and λ and u grow where all cones allow it. k = 0, 1, 2, …
    [[nodiscard]] KnownProblem with_right_hand_side(int k) const;

    /// The same pattern and the same solution, H and E multiplied by a factor > 0.
    [[nodiscard]] KnownProblem with_values(double factor) const;
};

/// Each capability, except those of warm starts and distribution, is needed by at least one of them.
[[nodiscard]] std::vector<KnownProblem> known_problems();

/// Towers of 100 bodies on one another: iterative solvers need many iterations for them. They cover every kind of cone,
/// both laws, and H diagonal and reduced.
[[nodiscard]] std::vector<KnownProblem> towers();

/// Free rows that repeat one another and ask for different velocities: there is no solution.
[[nodiscard]] Problem inconsistent_problem();

/// A freedom without inertia that no row holds, with a load on it: there is no solution.
[[nodiscard]] Problem singular_problem();

}  // namespace delassus::check
