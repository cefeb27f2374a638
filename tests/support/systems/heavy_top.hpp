// SPDX-License-Identifier: BSD-3-Clause
// The heavy top of Brüls, Cardona and Arnold (Mechanism and Machine Theory 48, 2012): a body that turns about a fixed
// point O under its weight, with its mass centre at X = (0, 1, 0) from O in the body frame.
#pragma once

#include "support/systems/dense_tangent.hpp"
#include "support/systems/rotation.hpp"

namespace delassus::tests {

struct HeavyTopData {
    double mass = 15.0, gravity = 9.81;
    Vector3 X{0.0, 1.0, 0.0}, inertia{0.234375, 0.46875, 0.234375}, omega{0.0, 150.0, -4.61538};
};

/// On R³ × SO(3): q = (x, quaternion), v = (ẋ, Ω), C = x − A X = 0.
class HeavyTop : public DynamicalSystem {
public:
    [[nodiscard]] std::int32_t n() const override { return 6; }
    [[nodiscard]] std::int32_t position_size() const override { return 7; }
    [[nodiscard]] std::vector<std::int32_t> constraint_blocks() const override { return {3}; }
    [[nodiscard]] State initial_state() const override {
        const Vector3 speed = data_.omega.cross(data_.X);
        return {0.0,
                {data_.X.x(), data_.X.y(), data_.X.z(), 1.0, 0.0, 0.0, 0.0},
                {speed.x(), speed.y(), speed.z(), data_.omega.x(), data_.omega.y(), data_.omega.z()}};
    }

    void increment(const double* q, const double* delta, double* result) const override {
        for (int i = 0; i < 3; ++i) result[i] = q[i] + delta[i];
        rotate(q + 3, delta + 3, result + 3);
    }
    void difference(const double* from, const double* to, double* delta) const override {
        for (int i = 0; i < 3; ++i) delta[i] = to[i] - from[i];
        rotation_between(from + 3, to + 3, delta + 3);
    }
    void inverse_tangent(const double* delta, std::vector<DiagonalBlock3>& blocks) const override {
        blocks.assign(1, inverse_tangent_of_rotation(3, delta + 3));
    }

    void add_mass(const State&, double factor, MatrixAssembler& M) const override {
        for (std::int32_t i = 0; i < 3; ++i) M.add(i, i, factor * data_.mass);
        for (std::int32_t i = 0; i < 3; ++i) M.add(3 + i, 3 + i, factor * data_.inertia[i]);
    }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        for (int i = 0; i < 3; ++i) result[i] += factor * data_.mass * x[i];
        for (int i = 0; i < 3; ++i) result[3 + i] += factor * data_.inertia[i] * x[3 + i];
    }
    void add_force(const State& s, double factor, double* result) const override {
        const Vector3 omega = rate(s);
        result[2] -= factor * data_.mass * data_.gravity;
        Eigen::Map<Vector3>(result + 3) -= factor * omega.cross(data_.inertia.cwiseProduct(omega));
    }
    void add_damping(const State& s, double factor, Tangent tangent, MatrixAssembler& H) const override {
        const Vector3 omega = rate(s);
        const Matrix3 J = data_.inertia.asDiagonal();
        add_tangent<3>(hat(omega) * J - hat(J * omega), 3, factor, tangent, H);
    }

    void constraint(const State& s, double* C) const override {
        Eigen::Map<Vector3>{C} = Eigen::Map<const Vector3>(s.q.data()) - quaternion_at(&s.q[3]) * data_.X;
    }
    void add_constraint_jacobian(const State& s, std::int32_t first_row, MatrixAssembler& D) const override {
        const Matrix3 turning = quaternion_at(&s.q[3]).toRotationMatrix() * hat(data_.X);
        for (std::int32_t i = 0; i < 3; ++i) {
            D.add(first_row + i, i, 1.0);
            for (std::int32_t j = 0; j < 3; ++j) D.add(first_row + i, 3 + j, turning(i, j));
        }
    }
    void constraint_curvature(const State& s, double* c) const override {
        const Vector3 omega = rate(s);
        Eigen::Map<Vector3>{c} = -(quaternion_at(&s.q[3]) * omega.cross(omega.cross(data_.X)));
    }
    void add_constraint_stiffness(const State& s, const double* lambda, double factor, Tangent tangent,
                                  MatrixAssembler& H) const override {
        const Vector3 in_body = quaternion_at(&s.q[3]).conjugate() * Vector3(Eigen::Map<const Vector3>{lambda});
        add_tangent<3>(-hat(data_.X) * hat(in_body), 3, factor, tangent, H);
    }
    [[nodiscard]] double energy(const State& s) const override {
        const Vector3 omega = rate(s);
        return 0.5 * data_.mass * Eigen::Map<const Vector3>(s.v.data()).squaredNorm() +
               0.5 * omega.dot(data_.inertia.cwiseProduct(omega)) + data_.mass * data_.gravity * s.q[2];
    }

private:
    static Vector3 rate(const State& s) { return Eigen::Map<const Vector3>(&s.v[3]); }
    HeavyTopData data_;
};

/// The same body by its rotation alone, with its inertia about O; no constraint.
class HeavyTopReduced : public DynamicalSystem {
public:
    HeavyTopReduced() : inertia_(Matrix3(data_.inertia.asDiagonal()) - data_.mass * hat(data_.X) * hat(data_.X)) {}

    [[nodiscard]] std::int32_t n() const override { return 3; }
    [[nodiscard]] std::int32_t position_size() const override { return 4; }
    [[nodiscard]] State initial_state() const override {
        return {0.0, {1.0, 0.0, 0.0, 0.0}, {data_.omega.x(), data_.omega.y(), data_.omega.z()}};
    }
    void increment(const double* q, const double* delta, double* result) const override { rotate(q, delta, result); }
    void difference(const double* from, const double* to, double* delta) const override {
        rotation_between(from, to, delta);
    }
    void inverse_tangent(const double* delta, std::vector<DiagonalBlock3>& blocks) const override {
        blocks.assign(1, inverse_tangent_of_rotation(0, delta));
    }
    void add_mass(const State&, double factor, MatrixAssembler& M) const override {
        add_tangent<3>(inertia_, 0, factor, Tangent::Exact, M);
    }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        Eigen::Map<Vector3>{result} += factor * inertia_ * Eigen::Map<const Vector3>(x);
    }
    void add_force(const State& s, double factor, double* result) const override {
        const Vector3 omega = Eigen::Map<const Vector3>(s.v.data());
        Eigen::Map<Vector3>{result} += factor * (data_.X.cross(weight(s)) - omega.cross(inertia_ * omega));
    }
    void add_stiffness(const State& s, double factor, Tangent tangent, MatrixAssembler& H) const override {
        add_tangent<3>(-hat(data_.X) * hat(weight(s)), 0, factor, tangent, H);
    }
    void add_damping(const State& s, double factor, Tangent tangent, MatrixAssembler& H) const override {
        const Vector3 omega = Eigen::Map<const Vector3>(s.v.data());
        add_tangent<3>(hat(omega) * inertia_ - hat(inertia_ * omega), 0, factor, tangent, H);
    }

private:
    /// In the body frame.
    [[nodiscard]] Vector3 weight(const State& s) const {
        return quaternion_at(s.q.data()).conjugate() * Vector3(0.0, 0.0, -data_.mass * data_.gravity);
    }
    HeavyTopData data_;
    Matrix3 inertia_;
};

}  // namespace delassus::tests
