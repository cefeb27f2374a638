// SPDX-License-Identifier: BSD-3-Clause
// The frame halfway between the ends of a beam, and its variation: the derivation is in beam.cpp.
#pragma once

#include "mechanics/rotation.hpp"

namespace delassus::mechanics {

/// w, y and z as functions of s = φ·φ, with their derivatives.
struct BeamFactors {
    double w, y, z, w_s, y_s, z_s;
};
BeamFactors beam_factors(double s);

struct BeamFrame {
    BeamFrame() = default;
    /// Axes of the two ends.
    BeamFrame(const Matrix3d& first, const Matrix3d& second);

    Vector3d phi;  ///< log(R₁ᵀ R₂)
    Matrix3d R;    ///< R₁ exp(φ/2)
    BeamFactors f;
    Matrix3d W, Z;  ///< δφ = W b, μ = c + Z b

    /// ∂(W v)/∂φ for fixed v.
    [[nodiscard]] Matrix3d change_of_W(const Vector3d& v) const {
        const double along = phi.dot(v);
        return 2.0 * (f.w_s * v + f.y_s * along * phi) * phi.transpose() +
               f.y * (along * Matrix3d::Identity() + phi * v.transpose());
    }
    /// ∂(Z v)/∂φ for fixed v.
    [[nodiscard]] Matrix3d change_of_Z(const Vector3d& v) const {
        return 0.5 * f.z * skew(v) - f.z_s * phi.cross(v) * phi.transpose();
    }
};

}  // namespace delassus::mechanics
