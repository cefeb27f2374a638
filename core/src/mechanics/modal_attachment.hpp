// SPDX-License-Identifier: BSD-3-Clause
// An interface of a modal body that a rigid body carries: three rows for the point and three for the orientation, or
// the first three alone for an interface that is a single node.
//
// The point, u = X + Ψ s in the frame (c, A), stays at the point c̄ of the rigid body (x, B):
//
//     C = c + A u − (x + B c̄) = 0
//
// The interface turns in the frame by the small rotation θ = Θ s. Its axes d_k = A (e_k + θ × e_k) stay those of the
// body, b_k = B b̄_k with b̄_k = B₀ᵀ A₀ e_k: for each cyclic (i, j, k)
//
//     C_i = ½ (d_k · b_j − d_j · b_k) = 0
//
// the axial vector of the relative rotation. The linear axes differ from those of exp(θ) by θ³ in these rows, as the
// terms of second order are symmetric. Each row is bilinear in vectors that are affine in s. With d = A d̂, of the
// shape Ψ_d (δd̂ = Ψ_d δs), and along increments (δc, ϑ, δs) with δA = A [ϑ]×:
//
//     J_d = (0, −A [d̂]×, A Ψ_d),      ḋ = A (ω × d̂ + Ψ_d ṡ),      d̈ at v̇ = 0: A (ω × (ω × d̂) + 2 ω × Ψ_d ṡ)
//     ∂(J_dᵀ y)/∂(ϑ, s) for fixed y, ŷ = Aᵀ y:   ( [d̂]× [ŷ]×   −[ŷ]× Ψ_d ;  Ψ_dᵀ [ŷ]×   0 )
//
// and for the point likewise with u, Ψ and the identity over c. The body's part is as in attachment.hpp.
#pragma once

#include "mechanics/modal_reduction.hpp"
#include "mechanics/row.hpp"

namespace delassus::mechanics {

struct ModalAttachment {
    std::int32_t reduced = 0;  ///< the modal body
    BodyIndex body = world_body;
    std::string name;
    std::vector<std::int32_t> nodes;       ///< numbered within the mesh
    ModalInterface interface;              ///< since finish(), as the next two
    Vector3d arm = Vector3d::Zero();       ///< c̄
    Matrix3d axes = Matrix3d::Identity();  ///< columns b̄_k
    std::int32_t first_row = 0;            ///< among all rows; none is ever left out

    [[nodiscard]] std::int32_t rows() const { return interface.turns() ? 6 : 3; }

    /// Rows of C.
    [[nodiscard]] VectorXd value(const ModalPlacement& at, const Placement& of_body) const;
    /// C_q over c, ϑ, s and then x, θ of the body: rows × (12 + k).
    [[nodiscard]] MatrixXd jacobian(const ModalPlacement& at, const Placement& of_body) const;
    /// C_t, which a prescribed motion of the body makes.
    [[nodiscard]] VectorXd rate(const ModalPlacement& at, const Placement& of_body) const;
    /// C̈ at v̇ = 0.
    [[nodiscard]] VectorXd curvature(const ModalPlacement& at, const Placement& of_body) const;
    /// ∂(C_qᵀ λ)/∂q over the columns of jacobian().
    [[nodiscard]] MatrixXd stiffness(const ModalPlacement& at, const Placement& of_body, const double* lambda) const;
};

}  // namespace delassus::mechanics
