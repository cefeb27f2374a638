// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "delassus/errors.hpp"
#include "delassus/needs.hpp"
#include "delassus/sdk/delassus_operator.hpp"
#include "problem/structure.hpp"

namespace delassus {

struct PreparedProblem::Implementation {
    Problem problem;
    Structure structure = Structure::Reduced;
    BlockPartition blocks;
    std::vector<delassus_cone> cones;
    delassus_problem raw{};
    /// Factored where H is definite or n = 0; null otherwise. The error meter measures with it.
    std::shared_ptr<sdk::DelassusOperator> operator_of_definite;
    mutable std::unique_ptr<ErrorMeter> meter;
    RedundancyCheck redundancy;

    /// Takes the place of what was there; H⁻¹ is kept as far as H is the same.
    void take(Problem other);
    /// Structure of H, needs and identities, after new matrices; same_H: H is the one that was factored.
    void prepare_matrices(bool same_H);
    void lay_out();
    /// raw's pointers to the arrays of the problem and the cones' numbers, which lay_out() placed.
    void point_to_arrays();
    /// Whether the other problem has its entries, and cones of the same kinds, in the same places.
    [[nodiscard]] bool same_places(const Problem& other) const;
    /// Copies the numbers of a problem with the same places.
    void copy_values(const Problem& other);
    void detect_structure();
    void derive_needs();
    /// The needs that come with the law, in place of another law's.
    void set_law_needs();
    void identify();
};

}  // namespace delassus
