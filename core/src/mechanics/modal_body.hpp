// SPDX-License-Identifier: BSD-3-Clause
// An elastic body of few modes in a floating frame.
//
// The node i of the mesh, with the lumped mass m_i and the place X_i in the frame at rest, is at
//
//     x_i = c + A u_i,   u_i = X_i + Φ_i s,        v_i = ċ + A (ω × u_i + Φ_i ṡ)
//
// with the frame (c, A), its angular velocity ω in its own axes and the amplitudes s of k modes. q = (c, A, s) and
// v = (ċ, ω, ṡ). The modes (modal_reduction.hpp) satisfy, at rest,
//
//     Σ m_i X_i = 0,   Σ m_i Φ_i = 0,   Σ m_i X_i × Φ_i = 0,   Σ m_i Φ_iᵀ Φ_i = m I
//
// so that c is the mass centre for every s, and the frame is Buckens' (the linearised mean axes): the velocities ṡ
// have no angular momentum at s = 0. With the second moments of mass Q and the products N,
//
//     Q(s) = Σ m_i u_i u_iᵀ = Q₀ + Σ_a s_a Q_a + Σ_ab s_a s_b P_ab,      J(s) = tr(Q) I − Q
//     L(s) = Σ m_i u_i × Φ_i,   its column b being Σ_a s_a N_ab,         N_ab = Σ m_i Φ_ia × Φ_ib = −N_ba
//
// the kinetic energy is, without any sum over nodes,
//
//     T = ½ m |ċ|² + ½ ω · J ω + ω · L ṡ + ½ m |ṡ|²
//
// and the equations of Lagrange for s, and of Euler for the angular momentum h = J ω + L ṡ in the axes of the frame,
// are
//
//     m c̈ = f
//     J ω̇ + L s̈ = −J̇ ω − ω × h + τ                          (L̇ ṡ = 0, as N is antisymmetric)
//     Lᵀ ω̇ + m s̈ = −2 W ṡ + ½ ∂(ω · J ω)/∂s − m Ω² (s + τ_d ṡ),     W = Σ_i ω_i N^iᵀ, N^i_ab = N_ab · e_i
//
// with the diagonal Ω² of squared angular frequencies and the damping time τ_d. Damping by the mass is −α M v. All of
// it is exact for the mesh with these modes, at any speed; elasticity is linear in s. So fast spin softens a body by
// its inertia, but centrifugal tension does not stiffen it against bending.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "delassus/matrix_assembler.hpp"
#include "mechanics/rotation.hpp"

namespace delassus::mechanics {

using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What the dynamics need of a mesh and its k modes. Symmetric tensors have the entries xx, yy, zz, xy, xz, yz.
struct ModalInertia {
    double mass = 0.0;                       ///< kg
    std::array<double, 6> moments{};         ///< Q₀, kg m²
    std::array<VectorXd, 6> linear_moments;  ///< of Q_a, k
    std::array<MatrixXd, 6> square_moments;  ///< of P_ab, k × k, symmetric
    std::array<MatrixXd, 3> products;        ///< N^i_ab, k × k, antisymmetric
    VectorXd squares;                        ///< of Ω², rad²/s²
    double damping_time = 0.0;               ///< τ_d, s
    double damping_rate = 0.0;               ///< α, 1/s
    [[nodiscard]] Eigen::Index modes() const { return squares.size(); }
};

/// Where a modal body is and how it moves. Columns of v: c at column, θ at column + 3, s from column + 6 on.
struct ModalPlacement {
    Vector3d x = Vector3d::Zero();
    Matrix3d A = Matrix3d::Identity();
    Vector3d v = Vector3d::Zero(), omega = Vector3d::Zero();
    VectorXd s, s_dot;
    std::int32_t column = -1;
};

/// A point of a modal body, or the mean of several: place + shape s, in the axes of the frame.
struct ModalPoint {
    Vector3d place = Vector3d::Zero();  ///< m
    Matrix3Xd shape;                    ///< 3 × k
    [[nodiscard]] Vector3d at(const VectorXd& s) const { return place + shape * s; }
};

/// The dynamics at one placement. Results are added. The columns of matrices are those of θ and s, 3 + k.
class ModalDynamics {
public:
    /// Both outlive it.
    ModalDynamics(const ModalInertia& body, const ModalPlacement& at);

    [[nodiscard]] const Matrix3d& inertia() const { return J_; }
    [[nodiscard]] Vector3d angular_momentum() const { return h_; }  ///< about the mass centre, in the frame
    [[nodiscard]] double kinetic_energy() const;
    [[nodiscard]] double elastic_energy() const;

    /// M over θ and s; c has m I.
    [[nodiscard]] MatrixXd mass() const;
    /// result += factor M x; both 6 + k.
    void multiply_mass(double factor, const double* x, double* result) const;
    /// result += factor f, without weight; 6 + k.
    void add_force(double factor, double* result) const;
    /// −∂f/∂q, and −∂f/∂v without that of the torque −ω × J ω. Damping by the mass is part of both, but not its
    /// α m I over c.
    [[nodiscard]] MatrixXd stiffness() const;
    [[nodiscard]] MatrixXd damping() const;
    /// ∂(M a)/∂q for a = (α, σ) of θ and s; 3 + k.
    [[nodiscard]] MatrixXd inertial_stiffness(const Vector3d& turning, const VectorXd& amplitudes) const;

private:
    using Six = std::array<VectorXd, 6>;
    /// Column a: (tr(Q_a) I − Q_a) w for the tensors Q_a with these entries.
    [[nodiscard]] static Matrix3Xd turned(const Six& moments, const Vector3d& w);
    /// Row i: (N^i x)ᵀ.
    [[nodiscard]] Matrix3Xd products_with(const VectorXd& x) const;
    /// Σ_i w_i N^iᵀ.
    [[nodiscard]] MatrixXd weighted(const Vector3d& w) const;

    const ModalInertia& body_;
    const ModalPlacement& at_;
    Six slopes_;  // ∂Q/∂s
    Matrix3d J_, J_dot_;
    Matrix3Xd L_;
    Vector3d h_;
};

}  // namespace delassus::mechanics
