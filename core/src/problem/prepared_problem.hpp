// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

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
    std::unique_ptr<sdk::DelassusOperator> operator_of_definite;

    void lay_out();
    void detect_structure();
    void derive_needs();
    void identify();
};

}  // namespace delassus
