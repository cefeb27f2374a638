// SPDX-License-Identifier: BSD-3-Clause
// The rotation group: unit quaternions, the exponential map, and its tangent. Rotation vectors are in the body frame.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "support/frames.hpp"

namespace delassus::mechanics {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// The quaternion of the rotation by |θ| about θ: (cos |θ|/2, sin(|θ|/2)/|θ| θ) (seed eq. 54). Any |θ|; near zero
/// sin(x)/x is taken by its series, which has no division.
inline Quaterniond exponential(const Vector3d& theta) {
    const double square = theta.squaredNorm();
    const double half = 0.5 * std::sqrt(square);
    const double factor = square < 1e-4 ? 0.5 - square / 48.0 + square * square / 3840.0 : 0.5 * std::sin(half) / half;
    return {std::cos(half), factor * theta.x(), factor * theta.y(), factor * theta.z()};
}

/// The rotation vector of a unit quaternion, |θ| ≤ π.
inline Vector3d logarithm(const Quaterniond& rotation) {
    const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
    const Vector3d v = sign * rotation.vec();
    const double sine = v.norm(), cosine = sign * rotation.w();
    // θ = 2 atan2(|v|, w) v/|v|; for small |v|, 2 asin(|v|)/|v| = 2 (1 + |v|²/6 + 3|v|⁴/40).
    const double square = sine * sine;
    const double factor =
        sine < 1e-3 ? 2.0 * (1.0 + square / 6.0 + 0.075 * square * square) : 2.0 * std::atan2(sine, cosine) / sine;
    return factor * v;
}

/// q ∘ exp(θ), normalised: the product of two unit quaternions is one up to rounding, and one Newton step of the norm
/// takes that away, so that it does not add up over steps.
inline Quaterniond rotated(const Quaterniond& q, const Vector3d& theta) {
    Quaterniond result = q * exponential(theta);
    result.coeffs() *= 1.5 - 0.5 * result.squaredNorm();
    return result;
}

/// T(θ)⁻¹ with exp(θ + T⁻¹ε) = exp(θ) ∘ exp(ε) + O(ε²):
///     T⁻¹ = I + ½[θ]× + (1/|θ|² − (1 + cos|θ|)/(2|θ| sin|θ|)) [θ]×²
/// (Iserles, Munthe-Kaas, Nørsett and Zanna, Lie-group methods, appendix B). |θ| < 2π.
inline Matrix3d inverse_tangent_of(const Vector3d& theta) {
    const double square = theta.squaredNorm();
    double factor;
    if (square < 1e-2) {
        factor = 1.0 / 12.0 + square * (1.0 / 720.0 + square * (1.0 / 30240.0 + square / 1209600.0));
    } else {
        const double angle = std::sqrt(square);
        factor = 1.0 / square - 0.5 / (angle * std::tan(0.5 * angle));
    }
    const Matrix3d cross = skew(theta);
    return Matrix3d::Identity() + 0.5 * cross + factor * cross * cross;
}

}  // namespace delassus::mechanics
