// SPDX-License-Identifier: BSD-3-Clause
// Sparse matrices of the library as dense ones.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "delassus/problem.hpp"

namespace delassus::tests {

/// In a matrix of these sizes: an absent one (0 × 0) is zero.
inline Eigen::MatrixXd dense(const SparseMatrix& matrix, Eigen::Index rows, Eigen::Index columns) {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(rows, columns);
    for (std::int32_t i = 0; i < matrix.rows; ++i)
        for (auto k = matrix.row_start[static_cast<std::size_t>(i)];
             k < matrix.row_start[static_cast<std::size_t>(i) + 1]; ++k)
            result(i, matrix.column[static_cast<std::size_t>(k)]) = matrix.value[static_cast<std::size_t>(k)];
    return result;
}

inline Eigen::MatrixXd dense(const SparseMatrix& matrix) {
    return dense(matrix, matrix.rows, matrix.columns);
}

inline Eigen::VectorXd dense(const std::vector<double>& v) {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

inline Eigen::Index rank(const SparseMatrix& matrix) {
    return Eigen::FullPivLU<Eigen::MatrixXd>(dense(matrix)).rank();
}

}  // namespace delassus::tests
