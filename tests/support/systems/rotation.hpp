// SPDX-License-Identifier: BSD-3-Clause
// Rotations as unit quaternions (w, x, y, z), angular velocities in the body frame.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "delassus/dynamical_system.hpp"

namespace delassus::tests {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

inline Matrix3 hat(const Vector3& a) {
    Matrix3 result;
    result << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    return result;
}

inline Eigen::Quaterniond quaternion_at(const double* q) {
    return {q[0], q[1], q[2], q[3]};
}

/// result ← p ∘ exp(δ), of unit length up to rounding however often it is done.
inline void rotate(const double* p, const double* delta, double* result) {
    const Vector3 half = 0.5 * Eigen::Map<const Vector3>(delta);
    const double angle = half.norm();
    const double sinc = angle < 1e-4 ? 1.0 - angle * angle / 6.0 : std::sin(angle) / angle;
    const Vector3 axis = sinc * half;
    const Eigen::Quaterniond end =
        (quaternion_at(p) * Eigen::Quaterniond(std::cos(angle), axis.x(), axis.y(), axis.z())).normalized();
    result[0] = end.w();
    Eigen::Map<Vector3>(result + 1) = end.vec();
}

/// δ ← log(from⁻¹ ∘ to), shorter than π.
inline void rotation_between(const double* from, const double* to, double* delta) {
    const Eigen::Quaterniond between = quaternion_at(from).conjugate() * quaternion_at(to);
    const double sign = between.w() < 0.0 ? -1.0 : 1.0;
    const double sine = between.vec().norm();
    const double factor = sine < 1e-12 ? 2.0 : 2.0 * std::atan2(sine, sign * between.w()) / sine;
    Eigen::Map<Vector3>{delta} = sign * factor * between.vec();
}

/// T⁻¹(δ) = 1 + ½ δ̂ + (1 − (φ/2) cot(φ/2))/φ² δ̂², φ = |δ|.
inline DiagonalBlock3 inverse_tangent_of_rotation(std::int32_t first, const double* delta) {
    const Vector3 d = Eigen::Map<const Vector3>(delta);
    const double phi = d.norm();
    const double factor = phi < 1e-2 ? 1.0 / 12.0 + phi * phi / 720.0 + phi * phi * phi * phi / 30240.0
                                     : (1.0 - 0.5 * phi / std::tan(0.5 * phi)) / (phi * phi);
    DiagonalBlock3 block{.first = first};
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.value) =
        Matrix3::Identity() + 0.5 * hat(d) + factor * hat(d) * hat(d);
    return block;
}

}  // namespace delassus::tests
