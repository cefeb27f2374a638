// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "support/systems/dense_tangent.hpp"

namespace delassus::tests {

/// A point mass at (x, y) with C = x² + y² − L² = 0, L = 1, g = 9.81; from (−1, 0) at rest.
class PlanarPendulum : public DynamicalSystem {
public:
    explicit PlanarPendulum(State initial = {0.0, {-1.0, 0.0}, {0.0, 0.0}}) : initial_(std::move(initial)) {}

    [[nodiscard]] std::int32_t n() const override { return 2; }
    [[nodiscard]] std::vector<std::int32_t> constraint_blocks() const override { return {1}; }
    [[nodiscard]] State initial_state() const override { return initial_; }
    [[nodiscard]] bool has_stiffness() const override { return false; }

    void add_mass(const State&, double factor, MatrixAssembler& M) const override {
        M.add(0, 0, factor);
        M.add(1, 1, factor);
    }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        result[0] += factor * x[0];
        result[1] += factor * x[1];
    }
    void add_force(const State&, double factor, double* result) const override { result[1] -= factor * 9.81; }
    void constraint(const State& s, double* C) const override { C[0] = s.q[0] * s.q[0] + s.q[1] * s.q[1] - 1.0; }
    void add_constraint_jacobian(const State& s, std::int32_t first_row, MatrixAssembler& D) const override {
        D.add(first_row, 0, 2.0 * s.q[0]);
        D.add(first_row, 1, 2.0 * s.q[1]);
    }
    void constraint_curvature(const State& s, double* c) const override {
        c[0] = 2.0 * (s.v[0] * s.v[0] + s.v[1] * s.v[1]);
    }
    void add_constraint_stiffness(const State&, const double* lambda, double factor, Tangent,
                                  MatrixAssembler& H) const override {
        H.add(0, 0, 2.0 * factor * lambda[0]);
        H.add(1, 1, 2.0 * factor * lambda[0]);
    }
    [[nodiscard]] double energy(const State& s) const override {
        return 0.5 * (s.v[0] * s.v[0] + s.v[1] * s.v[1]) + 9.81 * s.q[1];
    }

private:
    State initial_;
};

/// A pendulum whose pivot moves by p(t) = 0.1 sin 3t along x: C = (x − p)² + y² − 1 depends on time.
class DrivenPendulum : public PlanarPendulum {
public:
    DrivenPendulum() : PlanarPendulum({0.0, {std::sqrt(0.75), -0.5}, {1.3, std::sqrt(3.0)}}) {}

    void constraint(const State& s, double* C) const override {
        const double d = s.q[0] - pivot(s.t);
        C[0] = d * d + s.q[1] * s.q[1] - 1.0;
    }
    void add_constraint_jacobian(const State& s, std::int32_t first_row, MatrixAssembler& D) const override {
        D.add(first_row, 0, 2.0 * (s.q[0] - pivot(s.t)));
        D.add(first_row, 1, 2.0 * s.q[1]);
    }
    void constraint_rate(const State& s, double* C_t) const override {
        C_t[0] = -2.0 * (s.q[0] - pivot(s.t)) * 0.3 * std::cos(3.0 * s.t);
    }
    void constraint_curvature(const State& s, double* c) const override {
        const double speed = s.v[0] - 0.3 * std::cos(3.0 * s.t);
        c[0] = 2.0 * (speed * speed + s.v[1] * s.v[1]) + 2.0 * (s.q[0] - pivot(s.t)) * 9.0 * pivot(s.t);
    }

private:
    static double pivot(double t) { return 0.1 * std::sin(3.0 * t); }
};

}  // namespace delassus::tests
