// SPDX-License-Identifier: BSD-3-Clause
// LU factors of an unsymmetric sparse matrix, by Eigen.
#pragma once

#include <Eigen/SparseLU>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// P A Q = L U with partial pivoting.
class SparseLu {
public:
    /// A: square. False where a pivot is zero.
    [[nodiscard]] bool factorize(const SparseColumns& A);

    /// A⁻¹ v, after a factorize that was true.
    [[nodiscard]] Vector solve(const Vector& v) const;

private:
    Eigen::SparseLU<SparseColumns> factor_;
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/sparse_lu_bodies.hpp"
#endif
