// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "support/systems/dense_tangent.hpp"

namespace delassus::tests {

/// A mass on a spring of length r that swings by an angle θ: a stiff nonlinear oscillator without constraints, whose
/// mass matrix diag(m, m r²) depends on q and whose inertial forces on v.
class ElasticPendulum : public DynamicalSystem {
public:
    explicit ElasticPendulum(double stiffness = 100.0) : k_(stiffness) {}

    [[nodiscard]] std::int32_t n() const override { return 2; }
    [[nodiscard]] State initial_state() const override { return {0.0, {1.1, 1.0}, {0.0, 0.5}}; }

    void add_mass(const State& s, double factor, MatrixAssembler& M) const override {
        M.add(0, 0, factor * m_);
        M.add(1, 1, factor * m_ * s.q[0] * s.q[0]);
    }
    void multiply_mass(const State& s, double factor, const double* x, double* result) const override {
        result[0] += factor * m_ * x[0];
        result[1] += factor * m_ * s.q[0] * s.q[0] * x[1];
    }
    void add_force(const State& s, double factor, double* result) const override {
        const double r = s.q[0], sine = std::sin(s.q[1]), cosine = std::cos(s.q[1]);
        result[0] += factor * (m_ * r * s.v[1] * s.v[1] - k_ * (r - 1.0) + m_ * g_ * cosine);
        result[1] += factor * (-2.0 * m_ * r * s.v[0] * s.v[1] - m_ * g_ * r * sine);
    }
    void add_stiffness(const State& s, double factor, Tangent tangent, MatrixAssembler& H) const override {
        const double sine = std::sin(s.q[1]), cosine = std::cos(s.q[1]);
        Eigen::Matrix2d K;
        K << k_ - m_ * s.v[1] * s.v[1], m_ * g_ * sine,  //
            2.0 * m_ * s.v[0] * s.v[1] + m_ * g_ * sine, m_ * g_ * s.q[0] * cosine;
        add_tangent<2>(K, 0, factor, tangent, H);
    }
    void add_damping(const State& s, double factor, Tangent tangent, MatrixAssembler& H) const override {
        Eigen::Matrix2d R;
        R << 0.0, -2.0 * m_ * s.q[0] * s.v[1], 2.0 * m_ * s.q[0] * s.v[1], 2.0 * m_ * s.q[0] * s.v[0];
        add_tangent<2>(R, 0, factor, tangent, H);
    }
    void add_inertial_stiffness(const State& s, const double* acceleration, double factor, Tangent tangent,
                                MatrixAssembler& H) const override {
        Eigen::Matrix2d A;
        A << 0.0, 0.0, 2.0 * m_ * s.q[0] * acceleration[1], 0.0;
        add_tangent<2>(A, 0, factor, tangent, H);
    }
    [[nodiscard]] double energy(const State& s) const override {
        const double r = s.q[0];
        return 0.5 * m_ * (s.v[0] * s.v[0] + r * r * s.v[1] * s.v[1]) + 0.5 * k_ * (r - 1.0) * (r - 1.0) -
               m_ * g_ * r * std::cos(s.q[1]);
    }

private:
    double m_ = 1.0, g_ = 9.81, k_;
};

}  // namespace delassus::tests
