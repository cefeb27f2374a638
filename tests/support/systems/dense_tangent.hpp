// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "delassus/dynamical_system.hpp"

namespace delassus::tests {

/// H += factor · A, or its symmetric part, on the rows and columns from first.
template <int N>
void add_tangent(Eigen::Matrix<double, N, N> A, std::int32_t first, double factor, Tangent tangent,
                 MatrixAssembler& H) {
    if (tangent == Tangent::Symmetric) A = (0.5 * (A + A.transpose())).eval();
    for (std::int32_t i = 0; i < N; ++i)
        for (std::int32_t j = 0; j < N; ++j) H.add(first + i, first + j, factor * A(i, j));
}

}  // namespace delassus::tests
