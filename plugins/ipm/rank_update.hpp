// SPDX-License-Identifier: BSD-3-Clause
// The operation in which large factorisations spend their time.
#pragma once

#include <Eigen/Core>

namespace delassus::ipm {

/// The lower triangle of C −= A Aᵀ. C: as many rows and columns as A has rows; both by columns. Uses AVX2 where the
/// processor has it.
void subtract_square(Eigen::MatrixXd& C, const Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>& A);

}  // namespace delassus::ipm
