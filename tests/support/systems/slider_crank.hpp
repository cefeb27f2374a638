// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "support/systems/dense_tangent.hpp"

namespace delassus::tests {

/// Crank, rod and slider in planar absolute coordinates (x, y, θ) each: three pins, and a guide that holds y and θ of
/// the slider. A spring with a damper pulls the slider. 9 velocities, 8 constraints.
class SliderCrank : public DynamicalSystem {
public:
    [[nodiscard]] std::int32_t n() const override { return 9; }
    [[nodiscard]] std::vector<std::int32_t> constraint_blocks() const override { return {2, 2, 2, 2}; }

    /// Crank at 45° to the guide, turning with 10 rad/s.
    [[nodiscard]] State initial_state() const override {
        const double crank = std::acos(-1.0) / 4.0, speed = 10.0;
        const double rod = std::asin(-0.3 * std::sin(crank) / 0.8);
        const double rod_speed = -0.3 * std::cos(crank) * speed / (0.8 * std::cos(rod));
        State s;
        const auto along = [](double length, double angle, double rate, double* q, double* v) {
            q[0] += length * std::cos(angle);
            q[1] += length * std::sin(angle);
            v[0] -= length * std::sin(angle) * rate;
            v[1] += length * std::cos(angle) * rate;
        };
        s.q.assign(9, 0.0);
        s.v.assign(9, 0.0);
        for (std::size_t body = 0; body < 3; ++body) {
            along(body == 0 ? 0.15 : 0.3, crank, speed, &s.q[3 * body], &s.v[3 * body]);
            if (body > 0) along(body == 1 ? 0.4 : 0.8, rod, rod_speed, &s.q[3 * body], &s.v[3 * body]);
        }
        s.q[2] = crank;
        s.v[2] = speed;
        s.q[5] = rod;
        s.v[5] = rod_speed;
        return s;
    }

    void add_mass(const State&, double factor, MatrixAssembler& M) const override {
        for (std::int32_t i = 0; i < 9; ++i) M.add(i, i, factor * mass_[i]);
    }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        for (std::int32_t i = 0; i < 9; ++i) result[i] += factor * mass_[i] * x[i];
    }
    void add_force(const State& s, double factor, double* result) const override {
        for (const std::int32_t y : {1, 4, 7}) result[y] -= factor * 9.81 * mass_[y];
        result[6] -= factor * (50.0 * (s.q[6] - 0.8) + 2.0 * s.v[6]);
    }
    void add_stiffness(const State&, double factor, Tangent, MatrixAssembler& H) const override {
        H.add(6, 6, factor * 50.0);
    }
    void add_damping(const State&, double factor, Tangent, MatrixAssembler& H) const override {
        H.add(6, 6, factor * 2.0);
    }

    void constraint(const State& s, double* C) const override {
        std::fill_n(C, 8, 0.0);
        for (const End& end : ends) {
            const double angle = s.q[end.body + 2];
            C[end.row] += end.sign * (s.q[end.body] + end.arm * std::cos(angle));
            C[end.row + 1] += end.sign * (s.q[end.body + 1] + end.arm * std::sin(angle));
        }
        C[6] = s.q[7];
        C[7] = s.q[8];
    }
    void add_constraint_jacobian(const State& s, std::int32_t first_row, MatrixAssembler& D) const override {
        for (const End& end : ends) {
            const double angle = s.q[end.body + 2];
            const auto row = first_row + end.row;
            D.add(row, end.body, end.sign);
            D.add(row, end.body + 2, -end.sign * end.arm * std::sin(angle));
            D.add(row + 1, end.body + 1, end.sign);
            D.add(row + 1, end.body + 2, end.sign * end.arm * std::cos(angle));
        }
        D.add(first_row + 6, 7, 1.0);
        D.add(first_row + 7, 8, 1.0);
    }
    void constraint_curvature(const State& s, double* c) const override {
        std::fill_n(c, 8, 0.0);
        for (const End& end : ends) {
            const double angle = s.q[end.body + 2], rate = s.v[end.body + 2];
            c[end.row] -= end.sign * end.arm * std::cos(angle) * rate * rate;
            c[end.row + 1] -= end.sign * end.arm * std::sin(angle) * rate * rate;
        }
    }
    void add_constraint_stiffness(const State& s, const double* lambda, double factor, Tangent,
                                  MatrixAssembler& H) const override {
        for (const End& end : ends) {
            const double angle = s.q[end.body + 2];
            H.add(end.body + 2, end.body + 2,
                  -factor * end.sign * end.arm *
                      (lambda[end.row] * std::cos(angle) + lambda[end.row + 1] * std::sin(angle)));
        }
    }

private:
    /// A point of a pin: at ±arm along the body's axis.
    struct End {
        std::int32_t row, body;
        double arm, sign;
    };
    static constexpr std::array<End, 5> ends = {
        {{0, 0, -0.15, 1.0}, {2, 0, 0.15, 1.0}, {2, 3, -0.4, -1.0}, {4, 3, 0.4, 1.0}, {4, 6, 0.0, -1.0}}};
    std::array<double, 9> mass_ = {1.0, 1.0, 0.0075, 2.0, 2.0, 0.1067, 1.5, 1.5, 0.01};
};

}  // namespace delassus::tests
