// SPDX-License-Identifier: BSD-3-Clause
// Orders of convergence, measured: errors at one time for several step sizes, and the slope of their logarithms.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <vector>

#include "delassus/timestepper.hpp"
#include "support/system_derivatives.hpp"

namespace delassus::tests {

/// A state with the multipliers that belong to it.
struct Motion {
    State state;
    VectorXd lambda;
};

/// The accelerations and multipliers of a state by dense elimination.
inline std::pair<VectorXd, VectorXd> dense_accelerations(const DynamicalSystem& system, const State& state) {
    const auto n = system.n(), m = system.m();
    MatrixAssembler M, D;
    M.begin(n, n);
    system.add_mass(state, 1.0, M);
    D.begin(m, n);
    system.add_constraint_jacobian(state, 0, D);
    MatrixXd A = MatrixXd::Zero(n + m, n + m);
    A.topLeftCorner(n, n) = dense(M.finish());
    const MatrixXd jacobian = dense(D.finish());
    A.topRightCorner(n, m) = -jacobian.transpose();
    A.bottomLeftCorner(m, n) = jacobian;
    VectorXd right = VectorXd::Zero(n + m), curvature = VectorXd::Zero(m);
    system.add_force(state, 1.0, right.data());
    system.constraint_curvature(state, curvature.data());
    right.tail(m) = -curvature;
    const VectorXd solution = A.partialPivLu().solve(right);
    return {solution.head(n), solution.tail(m)};
}

/// The solution at t_end without any timestepper of the library: Runge–Kutta of order 4 for the accelerations that the
/// constraints allow, in coordinates u of the group about the beginning of each step.
inline Motion reference_solution(const DynamicalSystem& system, double t_end, int steps) {
    const double h = t_end / steps;
    Motion now{system.initial_state(), {}};
    const auto n = system.n();
    std::vector<DiagonalBlock3> blocks;
    const auto slope = [&](double after, const VectorXd& u, const VectorXd& v) {
        State stage{now.state.t + after, now.state.q, {v.begin(), v.end()}};
        system.increment(now.state.q.data(), u.data(), stage.q.data());
        system.inverse_tangent(u.data(), blocks);
        VectorXd du = v;
        for (const auto& block : blocks)
            du.segment<3>(block.first) =
                Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.value) * v.segment<3>(block.first);
        return std::pair{du, dense_accelerations(system, stage).first};
    };
    for (int step = 0; step < steps; ++step) {
        const VectorXd v = Eigen::Map<const VectorXd>(now.state.v.data(), n);
        const auto [u1, a1] = slope(0.0, VectorXd::Zero(n), v);
        const auto [u2, a2] = slope(0.5 * h, 0.5 * h * u1, v + 0.5 * h * a1);
        const auto [u3, a3] = slope(0.5 * h, 0.5 * h * u2, v + 0.5 * h * a2);
        const auto [u4, a4] = slope(h, h * u3, v + h * a3);
        const VectorXd u = h / 6.0 * (u1 + 2.0 * u2 + 2.0 * u3 + u4);
        const VectorXd end = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        system.increment(now.state.q.data(), u.data(), now.state.q.data());
        now.state.v.assign(end.begin(), end.end());
        now.state.t = (step + 1) * h;
    }
    now.lambda = dense_accelerations(system, now.state).second;
    return now;
}

/// Takes steps of equal size to t_end. smoothed: λ is (λ_{n−1} + 2λ_n + λ_{n+1})/4, for which one more step is taken;
/// it removes an error that changes its sign every step and grows linearly.
inline Motion run(DynamicalSystem& system, const std::string& method, const OptionTexts& options, double t_end,
                  int steps, StepSolver& solver, bool smoothed = false) {
    const auto stepper = make_timestepper(method, system, options);
    Motion result{system.initial_state(), {}};
    VectorXd before, last;
    const auto advance = [&](State& state) {
        const std::vector<double> lambda = stepper->step(state, t_end / steps, solver).multipliers;
        before = std::move(last);
        last = Eigen::Map<const VectorXd>(lambda.data(), static_cast<Eigen::Index>(lambda.size()));
    };
    for (int step = 0; step < steps; ++step) advance(result.state);
    result.lambda = last;
    if (!smoothed) return result;
    State beyond = result.state;
    const VectorXd sum = before + 2.0 * last;
    advance(beyond);
    result.lambda = 0.25 * (sum + last);
    return result;
}

/// Errors at t_end for each number of steps, and the order that fits them.
struct Convergence {
    std::vector<double> h, position, velocity, multiplier;

    /// The slope of log error over log h by least squares.
    [[nodiscard]] double order(const std::vector<double>& error) const {
        double sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0;
        for (std::size_t k = 0; k < h.size(); ++k) {
            const double x = std::log(h[k]), y = std::log(error[k]);
            sum_x += x;
            sum_y += y;
            sum_xx += x * x;
            sum_xy += x * y;
        }
        const auto count = static_cast<double>(h.size());
        return (count * sum_xy - sum_x * sum_y) / (count * sum_xx - sum_x * sum_x);
    }
};

inline Convergence measure(DynamicalSystem& system, const std::string& method, const OptionTexts& options, double t_end,
                           const std::vector<int>& steps, const Motion& reference, StepSolver& solver,
                           bool smoothed = false) {
    Convergence result;
    VectorXd difference(system.n());
    for (const int count : steps) {
        const auto end = run(system, method, options, t_end, count, solver, smoothed);
        system.difference(reference.state.q.data(), end.state.q.data(), difference.data());
        result.h.push_back(t_end / count);
        result.position.push_back(difference.norm());
        result.velocity.push_back((Eigen::Map<const VectorXd>(end.state.v.data(), system.n()) -
                                   Eigen::Map<const VectorXd>(reference.state.v.data(), system.n()))
                                      .norm());
        result.multiplier.push_back(end.lambda.size() == 0 ? 0.0 : (end.lambda - reference.lambda).norm());
    }
    return result;
}

}  // namespace delassus::tests
