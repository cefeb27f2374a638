// SPDX-License-Identifier: BSD-3-Clause
// Algorithms of Eigen on small dense matrices that several solvers use.
#pragma once

#include <Eigen/Core>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// M = V diag(w) Vᵀ of a symmetric matrix.
class SymmetricEigen {
public:
    /// matrix: square; its lower triangle is read.
    explicit SymmetricEigen(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

    /// Whether the iteration converged.
    [[nodiscard]] bool found() const { return found_; }
    [[nodiscard]] const Vector& values() const { return values_; }  ///< w, ascending
    /// V diag(values) Vᵀ.
    [[nodiscard]] Eigen::MatrixXd with(const Vector& values) const;

private:
    bool found_;
    Vector values_;
    Eigen::MatrixXd vectors_;
};

/// M⁻¹ of a symmetric positive definite matrix, by Cholesky; without meaning for another.
[[nodiscard]] Eigen::Matrix3d inverse_of_definite(const Eigen::Matrix3d& matrix);

/// matrix ← its inverse, likewise. False if it is not positive definite; then it keeps its values.
[[nodiscard]] bool invert_definite(Eigen::MatrixXd& matrix);

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/dense_algebra_bodies.hpp"
#endif
