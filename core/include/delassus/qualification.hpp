// SPDX-License-Identifier: BSD-3-Clause
// Constraint qualifications: whether the reactions of a problem are unique, and whether they are bounded.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/problem.hpp"
#include "delassus/registry.hpp"

namespace delassus {

enum class Answer { Yes, No, Undecided };

/// All rows of the problem count, also those of contacts that will open. A subset of the rows qualifies at least as
/// well.
struct Qualification {
    /// Linear independence (LICQ): rank of N = number of rows. Then reactions are unique. Undecided: no rank was found.
    Answer independent = Answer::Undecided;
    std::int32_t rows = 0;             ///< m
    std::optional<std::int32_t> rank;  ///< as estimate_rank()
    /// Free rows, whose reactions have no bound: their number and their rank. Without free rows both are 0.
    std::int32_t free_rows = 0;
    std::optional<std::int32_t> free_rank;

    /// Pointed friction cone (seed, eq. 206; Stewart and Trinkle; Anitescu and Potra): no λ ∈ Υ but 0 has Dᵀλ = 0 (in a
    /// reduced problem, E λ = 0). Then the set of reactions is bounded; it may still have more than one point.
    Answer pointed = Answer::Undecided;
    /// The smallest ‖Dᵀλ‖ over λ ∈ Υ with a sum of normal reactions of 1, blocks scaled to a mean row norm of 1 (‖·‖ of
    /// a reduced problem: (λᵀEλ)^½). Zero: not pointed. Infinite where there are only free rows.
    double pointedness = 0.0;
    /// Where pointed is No: the reactions that cancel, in the problem's rows, normals with a sum of 1; m. Else empty.
    std::vector<double> cancelling;
};

/// Solves one convex problem with the solvers of the registry (auto). Compliance E is left out unless n = 0: it is a
/// statement about the geometry. Throws Unsupported if no solver can.
[[nodiscard]] DELASSUS_API Qualification qualify(const Problem& problem, const Registry& registry);

}  // namespace delassus
