// SPDX-License-Identifier: BSD-3-Clause
// Static equilibria of systems that have nodes alone, by Newton's method.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <Eigen/SparseLU>

#include "delassus/multibody.hpp"
#include "support/system_derivatives.hpp"

namespace delassus::tests {

using Sparse = Eigen::SparseMatrix<double>;

template <class Add>
Sparse sparse_matrix(std::int32_t n, Add&& add) {
    MatrixAssembler assembler;
    assembler.begin(n, n);
    add(assembler);
    const SparseMatrix& matrix = assembler.finish();
    return Sparse(Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
        n, n, matrix.entries(), matrix.row_start.data(), matrix.column.data(), matrix.value.data()));
}

inline Sparse stiffness_of(const MultibodySystem& system, const State& state) {
    return sparse_matrix(system.n(), [&](auto& H) { system.add_stiffness(state, 1.0, Tangent::Exact, H); });
}

inline VectorXd force_of(const MultibodySystem& system, const State& state) {
    VectorXd force = VectorXd::Zero(system.n());
    system.add_force(state, 1.0, force.data());
    return force;
}

/// Where the system's forces and `load` (n) balance, from `state` on; the load comes in equal parts.
inline State equilibrium_under(const MultibodySystem& system, State state, const VectorXd& load, int parts = 1) {
    for (int part = 1; part <= parts; ++part) {
        double residual = 1.0;
        for (int iteration = 0; iteration < 30 && residual > 1e-11; ++iteration) {
            const VectorXd force = force_of(system, state) + load * part / parts;
            residual = force.norm() / std::max(load.norm(), 1e-300);
            if (residual <= 1e-11) break;
            const Eigen::SparseLU<Sparse> factor(stiffness_of(system, state));
            const VectorXd step = factor.solve(force);
            state = moved(system, state, step);
            // The smallest step that rounding lets count.
            if (step.norm() < 1e-14 * (1.0 + VectorXd::Map(state.q.data(), system.n()).norm())) residual = 0.0;
        }
        EXPECT_LE(residual, 1e-9) << "part " << part;
    }
    return state;
}

}  // namespace delassus::tests
