// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "delassus/dynamical_system.hpp"

namespace delassus::tests {

/// A rigid body in the plane over the ground z = 0, which its corners touch with friction: q = (x, z, φ) of the mass
/// centre, mass 1. A drag c v acts on its centre.
class PlanarBlock : public DynamicalSystem {
public:
    struct Parameters {
        double inertia = 1.0;
        std::array<double, 2> gravity = {0.0, -9.81};
        double drag = 0.0;
        double friction = 0.0, restitution = 0.0;
        std::vector<std::array<double, 2>> corners;  ///< in the body's frame
    };
    PlanarBlock(Parameters parameters, State initial) : p_(std::move(parameters)), initial_(std::move(initial)) {}

    [[nodiscard]] std::int32_t n() const override { return 3; }
    [[nodiscard]] State initial_state() const override { return initial_; }
    [[nodiscard]] bool has_unilateral() const override { return true; }
    [[nodiscard]] bool has_stiffness() const override { return p_.drag > 0.0; }

    void add_mass(const State&, double factor, MatrixAssembler& M) const override {
        for (std::int32_t i = 0; i < 3; ++i) M.add(i, i, factor * (i == 2 ? p_.inertia : 1.0));
    }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        for (int i = 0; i < 3; ++i) result[i] += factor * (i == 2 ? p_.inertia : 1.0) * x[i];
    }
    void add_force(const State& s, double factor, double* result) const override {
        for (std::size_t i = 0; i < 2; ++i) result[i] += factor * (p_.gravity[i] - p_.drag * s.v[i]);
    }
    void add_damping(const State&, double factor, Tangent, MatrixAssembler& H) const override {
        for (std::int32_t i = 0; i < 2; ++i) H.add(i, i, factor * p_.drag);
    }
    void collect_unilateral(const State& s, double, UnilateralRows& rows) override {
        rows.clear();
        const double c = std::cos(s.q[2]), sine = std::sin(s.q[2]);
        for (std::size_t k = 0; k < p_.corners.size(); ++k) {
            const double x = c * p_.corners[k][0] - sine * p_.corners[k][1],
                         z = sine * p_.corners[k][0] + c * p_.corners[k][1];
            rows.entries(0, std::array{0.0, 1.0, x});
            rows.end_row(s.q[1] + z);
            if (p_.friction > 0.0) {
                rows.entries(0, std::array{1.0, 0.0, -z});
                rows.end_row();
            }
            rows.end_block(p_.friction > 0.0 ? Cone::friction(p_.friction, 2) : Cone::nonnegative(1), k + 1,
                           p_.restitution);
        }
    }
    [[nodiscard]] double energy(const State& s) const override {
        return 0.5 * (s.v[0] * s.v[0] + s.v[1] * s.v[1] + p_.inertia * s.v[2] * s.v[2]) - p_.gravity[0] * s.q[0] -
               p_.gravity[1] * s.q[1];
    }

private:
    Parameters p_;
    State initial_;
};

}  // namespace delassus::tests
