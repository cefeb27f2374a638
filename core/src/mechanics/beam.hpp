// SPDX-License-Identifier: BSD-3-Clause
// A straight beam between two bodies that turns and moves by any amount: the derivation is in beam.cpp.
#pragma once

#include <array>

#include "delassus/multibody.hpp"
#include "mechanics/row.hpp"

namespace delassus::mechanics {

class Beam {
public:
    /// at: where the bodies are when the beam is unstressed and straight. Throws InputError if its ends coincide.
    Beam(const BeamParameters& parameters, const Placements& at);

    static constexpr int size = 2, freedoms = 6;
    [[nodiscard]] const std::array<BodyIndex, 2>& bodies() const { return bodies_; }
    /// The beam's axes at the start, x along it: world frame.
    [[nodiscard]] static Matrix3d axes(const BeamParameters& parameters);

    using Ends = std::array<Placement, 2>;
    /// Force (world frame) and torque about the mass centre (body frame) on the first body, then on the second.
    using Forces = Eigen::Matrix<double, 12, 1>;
    using Matrix = Eigen::Matrix<double, 12, 12, Eigen::RowMajor>;
    [[nodiscard]] double energy(const Ends& at) const;
    void force(const Ends& at, Forces& result) const;
    /// −∂f/∂q along increments, and −∂f/∂v.
    void stiffness(const Ends& at, Matrix& result) const;
    void damping(const Ends& at, Matrix& result) const;
    [[nodiscard]] bool damped() const { return damping_time_ > 0.0; }

private:
    struct Kinematics;
    [[nodiscard]] Kinematics kinematics(const Ends& at) const;

    std::array<BodyIndex, 2> bodies_;
    std::array<Vector3d, 2> arm_;   // s̄: from the mass centre to the end, body frame
    std::array<Matrix3d, 2> turn_;  // B̄: the beam's axes in the body frame
    double length_, damping_time_;
    Vector3d stretching_, bending_;  // the diagonals of N and Q
};

}  // namespace delassus::mechanics
