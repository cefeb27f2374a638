// SPDX-License-Identifier: BSD-3-Clause
// Holds what a DynamicalSystem says of its derivatives against central differences.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "delassus/dynamical_system.hpp"
#include "support/dense.hpp"

namespace delassus::tests {

using Eigen::MatrixXd;
using Eigen::VectorXd;

inline State moved(const DynamicalSystem& system, const State& state, const VectorXd& delta) {
    State result = state;
    system.increment(state.q.data(), delta.data(), result.q.data());
    return result;
}

/// Central differences of a vector function along increments of the position.
template <class Function>
MatrixXd along_positions(const DynamicalSystem& system, const State& state, Function&& function) {
    const double step = 1e-6;
    MatrixXd result;
    for (std::int32_t j = 0; j < system.n(); ++j) {
        const VectorXd delta = step * VectorXd::Unit(system.n(), j);
        const VectorXd change =
            (function(moved(system, state, delta)) - function(moved(system, state, -delta))) / (2.0 * step);
        if (j == 0) result.setZero(change.size(), system.n());
        result.col(j) = change;
    }
    return result;
}

inline void expect_near(const MatrixXd& actual, const MatrixXd& expected, double tolerance, const char* what) {
    const double size = 1.0 + (expected.size() ? expected.cwiseAbs().maxCoeff() : 0.0);
    ASSERT_EQ(actual.rows(), expected.rows()) << what;
    ASSERT_EQ(actual.cols(), expected.cols()) << what;
    if (expected.size() == 0) return;
    EXPECT_LE((actual - expected).cwiseAbs().maxCoeff(), tolerance * size) << what << "\nactual\n"
                                                                           << actual << "\nby differences\n"
                                                                           << expected;
}

/// Every derivative of the system at a state. lambda: m. less_of_symmetric: the symmetric tangent of K is symmetric,
/// but less than the symmetric part.
inline void expect_derivatives(const DynamicalSystem& system, const State& state, const VectorXd& lambda,
                               double tolerance = 1e-7, bool less_of_symmetric = false) {
    const std::int32_t n = system.n(), m = system.m();
    const auto force = [&](const State& at) {
        VectorXd f = VectorXd::Zero(n);
        system.add_force(at, 1.0, f.data());
        return f;
    };
    const auto matrix = [&](std::int32_t rows, auto&& add) {
        MatrixAssembler assembler;
        assembler.begin(rows, n);
        add(assembler);
        return dense(assembler.finish());
    };
    const MatrixXd K = matrix(n, [&](auto& H) { system.add_stiffness(state, 1.0, Tangent::Exact, H); });
    expect_near(K, -along_positions(system, state, force), tolerance, "K");
    const MatrixXd symmetric = matrix(n, [&](auto& H) { system.add_stiffness(state, 1.0, Tangent::Symmetric, H); });
    const MatrixXd& part = less_of_symmetric ? symmetric : K;
    expect_near(symmetric, 0.5 * (part + part.transpose()), 1e-12, "symmetric part of K");

    const double step = 1e-6;
    MatrixXd R_expected(n, n);
    for (std::int32_t j = 0; j < n; ++j) {
        State up = state, down = state;
        up.v[static_cast<std::size_t>(j)] += step;
        down.v[static_cast<std::size_t>(j)] -= step;
        R_expected.col(j) = -(force(up) - force(down)) / (2.0 * step);
    }
    const MatrixXd R = matrix(n, [&](auto& H) {
        system.add_damping(state, 1.0, Tangent::Exact, H);
        system.add_gyroscopic_damping(state, 1.0, Tangent::Exact, H);
    });
    expect_near(R, R_expected, tolerance, "R");
    const MatrixXd M = matrix(n, [&](auto& H) { system.add_mass(state, 1.0, H); });
    VectorXd Mx = VectorXd::Zero(n);
    const VectorXd x = VectorXd::LinSpaced(n, -1.0, 2.0);
    system.multiply_mass(state, 1.0, x.data(), Mx.data());
    expect_near(M * x, Mx, 1e-12, "M x");
    if (m == 0) return;

    const auto constraint = [&](const State& at) {
        VectorXd C(m);
        system.constraint(at, C.data());
        return C;
    };
    const auto jacobian = [&](const State& at) {
        return matrix(m, [&](auto& D) { system.add_constraint_jacobian(at, 0, D); });
    };
    const MatrixXd D = jacobian(state);
    expect_near(D, along_positions(system, state, constraint), tolerance, "C_q");
    State later = state, earlier = state;
    later.t += step;
    earlier.t -= step;
    VectorXd C_t(m);
    system.constraint_rate(state, C_t.data());
    expect_near(C_t, (constraint(later) - constraint(earlier)) / (2.0 * step), tolerance, "C_t");
    const auto reaction = [&](const State& at) { return VectorXd(jacobian(at).transpose() * lambda); };
    expect_near(
        matrix(n, [&](auto& H) { system.add_constraint_stiffness(state, lambda.data(), 1.0, Tangent::Exact, H); }),
        along_positions(system, state, reaction), tolerance, "constraint stiffness");

    // C̈ at v̇ = 0 is the derivative of Ċ = C_q v + C_t along the motion, in which body-frame velocities stay constant.
    const auto velocity = [&](double time) {
        State at = moved(system, state, time * Eigen::Map<const VectorXd>(state.v.data(), n));
        at.t += time;
        VectorXd rate(m);
        system.constraint_rate(at, rate.data());
        return VectorXd(jacobian(at) * Eigen::Map<const VectorXd>(state.v.data(), n) + rate);
    };
    VectorXd curvature(m);
    system.constraint_curvature(state, curvature.data());
    expect_near(curvature, (velocity(step) - velocity(-step)) / (2.0 * step), 20.0 * tolerance, "curvature");
}

/// increment and difference are inverses, and T⁻¹ is the derivative that it claims to be.
inline void expect_group(const DynamicalSystem& system, const State& state, const VectorXd& delta) {
    const std::int32_t n = system.n();
    const State there = moved(system, state, delta);
    VectorXd back(n);
    system.difference(state.q.data(), there.q.data(), back.data());
    expect_near(back, delta, 1e-12, "difference of increment");
    std::vector<DiagonalBlock3> blocks;
    system.inverse_tangent(delta.data(), blocks);
    MatrixXd expected(n, n), actual = MatrixXd::Identity(n, n);
    const double step = 1e-6;
    for (std::int32_t j = 0; j < n; ++j) {
        VectorXd up(n), down(n);
        const VectorXd epsilon = step * VectorXd::Unit(n, j);
        system.difference(state.q.data(), moved(system, there, epsilon).q.data(), up.data());
        system.difference(state.q.data(), moved(system, there, -epsilon).q.data(), down.data());
        expected.col(j) = (up - down) / (2.0 * step);
    }
    for (const auto& block : blocks)
        actual.block<3, 3>(block.first, block.first) =
            Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.value);
    expect_near(actual, expected, 1e-8, "inverse tangent");
}

}  // namespace delassus::tests
