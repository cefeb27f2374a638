// SPDX-License-Identifier: BSD-3-Clause
// A node that a body carries: three rows.
//
// The node's place p stays at the point c̄ of the body's frame:
//
//     C = p − (x + A c̄) = 0,     C_q = [ I over the node | −I over x | A [c̄]× over θ ]
//
// with increments (δx, θ) of the body, δA = A [θ]×. Further
//
//     C̈ at v̇ = 0:       −A (ω × (ω × c̄)),   and −(v̇ + A (ω̇ × c̄)) more of a body whose motion is prescribed
//     C_t:               −(v + A (ω × c̄)) of such a body, else 0
//     ∂(C_θᵀ λ)/∂θ:      C_θᵀ λ = −c̄ × Aᵀλ and δ(Aᵀλ) = [Aᵀλ]× θ, so that it is −[c̄]× [Aᵀλ]×
#pragma once

#include "mechanics/row.hpp"

namespace delassus::mechanics {

struct Attachment {
    std::int32_t node = -1;
    BodyIndex body = world_body;
    Vector3d arm = Vector3d::Zero();  ///< c̄
    std::int32_t first_row = 0;       ///< of its three among all rows; none is ever left out

    [[nodiscard]] Vector3d place(const Placement& of_body) const { return of_body.x + of_body.A * arm; }
    [[nodiscard]] Vector3d velocity(const Placement& of_body) const {
        return of_body.v + of_body.A * of_body.omega.cross(arm);
    }
    [[nodiscard]] Vector3d curvature(const Placement& of_body) const {
        const Vector3d turning = of_body.omega.cross(of_body.omega.cross(arm));
        if (!of_body.prescribed()) return -(of_body.A * turning);
        return -(of_body.acceleration + of_body.A * (turning + of_body.turning.cross(arm)));
    }
    /// C_q over θ.
    [[nodiscard]] Matrix3d turn(const Placement& of_body) const { return of_body.A * skew(arm); }
    /// ∂(C_θᵀ λ)/∂θ.
    [[nodiscard]] Matrix3d stiffness(const Placement& of_body, const Vector3d& lambda) const {
        return -skew(arm) * skew(of_body.A.transpose() * lambda);
    }
};

}  // namespace delassus::mechanics
