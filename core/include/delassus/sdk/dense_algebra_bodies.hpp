// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/dense_algebra.hpp (sdk/compiled_once.hpp).
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/dense_algebra.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION SymmetricEigen::SymmetricEigen(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
    found_ = true;
    if (matrix.rows() == 0) return;  // Eigen looks for the largest entry of none
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
    found_ = solver.info() == Eigen::Success;
    values_ = solver.eigenvalues();
    vectors_ = solver.eigenvectors();
}

DELASSUS_SDK_FUNCTION Eigen::MatrixXd SymmetricEigen::with(const Vector& values) const {
    return vectors_ * values.asDiagonal() * vectors_.transpose();
}

DELASSUS_SDK_FUNCTION Eigen::Matrix3d inverse_of_definite(const Eigen::Matrix3d& matrix) {
    return matrix.llt().solve(Eigen::Matrix3d::Identity());
}

DELASSUS_SDK_FUNCTION bool invert_definite(Eigen::MatrixXd& matrix) {
    const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
    if (factor.info() != Eigen::Success) return false;
    matrix = factor.solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
    return true;
}

}  // namespace delassus::sdk
