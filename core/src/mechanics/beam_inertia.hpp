// SPDX-License-Identifier: BSD-3-Clause
// The consistent mass of a straight beam between two bodies: its inertia and its weight. The derivation is in
// beam_inertia.cpp.
#pragma once

#include "mechanics/beam.hpp"
#include "mechanics/beam_frame.hpp"

namespace delassus::mechanics {

class BeamInertia {
public:
    /// length: of the element, m. The bodies' mass centres are its ends, their axes those of the beam.
    BeamInertia(const ElasticBeamParameters& beam, double length, const std::array<BodyIndex, 2>& bodies);

    [[nodiscard]] const std::array<BodyIndex, 2>& bodies() const { return bodies_; }

    using Ends = Beam::Ends;
    using Forces = Beam::Forces;  ///< or velocities: v (world frame) and ω̄ (body frame) of both ends
    using Matrix = Beam::Matrix;
    /// M, and M x.
    void mass(const Ends& at, Matrix& result) const;
    void multiply_mass(const Ends& at, const Forces& x, Forces& result) const;
    /// Of weight and velocities. gravity: m/s², world frame.
    void force(const Ends& at, const Vector3d& gravity, Forces& result) const;
    /// −∂f/∂q along increments, and −∂f/∂v.
    void stiffness(const Ends& at, const Vector3d& gravity, Matrix& result) const;
    void damping(const Ends& at, Matrix& result) const;
    /// ∂(M a)/∂q for fixed a.
    void inertial_stiffness(const Ends& at, const Forces& a, Matrix& result) const;
    /// Whether 0.3 M + factor · ½(matrix + matrixᵀ) is definite.
    [[nodiscard]] bool leaves_definite(const Ends& at, const Matrix& matrix, double factor) const;
    [[nodiscard]] double kinetic_energy(const Ends& at) const;
    [[nodiscard]] double potential(const Ends& at, const Vector3d& gravity) const;
    /// Momentum, and angular momentum about the origin, world frame.
    void momentum(const Ends& at, Vector3d& linear, Vector3d& angular) const;

private:
    struct Kinematics;
    struct Centre;

    std::array<BodyIndex, 2> bodies_;
    double mass_, length_;
    Eigen::Matrix<double, 12, 12> inner_;  // M'
};

}  // namespace delassus::mechanics
