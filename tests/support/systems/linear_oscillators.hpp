// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "support/systems/dense_tangent.hpp"

namespace delassus::tests {

/// Two unit masses, q̈ = −K q, with K = Q diag(ω₁², ω₂²) Qᵀ, Q the rotation by 30°.
class LinearOscillators : public DynamicalSystem {
public:
    LinearOscillators(double omega_1, double omega_2, State initial) : initial_(std::move(initial)) {
        const double c = 0.5 * std::sqrt(3.0), s = 0.5, k1 = omega_1 * omega_1, k2 = omega_2 * omega_2;
        K_ << c * c * k1 + s * s * k2, c * s * (k1 - k2), c * s * (k1 - k2), s * s * k1 + c * c * k2;
    }
    [[nodiscard]] std::int32_t n() const override { return 2; }
    [[nodiscard]] State initial_state() const override { return initial_; }
    void add_mass(const State&, double factor, MatrixAssembler& M) const override {
        M.add(0, 0, factor);
        M.add(1, 1, factor);
    }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        result[0] += factor * x[0];
        result[1] += factor * x[1];
    }
    void add_force(const State& s, double factor, double* result) const override {
        Eigen::Map<Eigen::Vector2d>{result} -= factor * K_ * Eigen::Map<const Eigen::Vector2d>(s.q.data());
    }
    void add_stiffness(const State&, double factor, Tangent tangent, MatrixAssembler& H) const override {
        add_tangent<2>(K_, 0, factor, tangent, H);
    }
    [[nodiscard]] const Eigen::Matrix2d& stiffness() const { return K_; }
    [[nodiscard]] double energy(const State& s) const override {
        const Eigen::Map<const Eigen::Vector2d> q(s.q.data()), v(s.v.data());
        return 0.5 * v.squaredNorm() + 0.5 * q.dot(K_ * q);
    }

private:
    State initial_;
    Eigen::Matrix2d K_;
};

}  // namespace delassus::tests
