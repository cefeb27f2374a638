// SPDX-License-Identifier: BSD-3-Clause
// Where a body is whose motion is prescribed.
//
//     x(t) = c + Q(φ(t)) (x₀ − c) + d(t),   A(t) = Q(φ(t)) A₀,   Q(φ) the rotation by φ about n
//
// with the pose x₀, A₀ that is given, the point c and the axis n. With r = Q (x₀ − c):
//
//     ẋ = φ̇ n × r + ḋ,   ẍ = φ̈ n × r + φ̇² n × (n × r) + d̈,   ω̄ = φ̇ A₀ᵀ n,   ω̄˙ = φ̈ A₀ᵀ n
#pragma once

#include "delassus/multibody.hpp"
#include "mechanics/row.hpp"

namespace delassus::mechanics {

/// What stands for columns of a body whose motion is prescribed: a number of its own below −1.
inline std::int32_t prescribed_column(BodyIndex body) {
    return -2 - body;
}

class PrescribedMotion {
public:
    /// given: the pose of which the motion leads away.
    PrescribedMotion(const BodyMotion& motion, const Pose& given);

    [[nodiscard]] Pose pose(double t) const;
    /// Position, orientation, velocities and accelerations at a time; the column stays.
    void place(double t, Placement& at) const;
    /// The same, with the velocities that lead from the pose at t to that at t + h: so that gaps close by what the body
    /// moves.
    void place_for_step(double t, double h, Placement& at) const;

    /// rad/s
    [[nodiscard]] double turning_rate(double t) const { return angle_.rate(t); }
    /// Whether the axis about which it turns goes through a point of the body; and along a direction of it, if that is
    /// not 0.
    [[nodiscard]] bool turns_about(const Vector3d& point, const Vector3d& direction) const;

private:
    [[nodiscard]] Quaterniond turn(double t) const;

    std::array<Motion, 3> translation_;
    Motion angle_;
    Vector3d axis_, own_axis_;  // n, and A₀ᵀ n
    Vector3d point_, arm_;      // c, x₀ − c
    Quaterniond orientation_;   // A₀
    double start_;              // φ(0)
};

}  // namespace delassus::mechanics
