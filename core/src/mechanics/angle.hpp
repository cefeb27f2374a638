// SPDX-License-Identifier: BSD-3-Clause
// The angle of a revolute joint as a function of the configuration.
//
// With z and p, q = z × p fixed in the first body and p' fixed in the second (p' = p at angle zero):
//     θ = atan2(p' · q, p' · p),    θ̇ = z · (ω_second − ω_first)   while the joint holds.
#pragma once

#include <cmath>

#include "mechanics/row.hpp"

namespace delassus::mechanics {

struct Angle {
    BodyIndex first = world_body, second = world_body;
    Vector3d z = Vector3d::UnitZ(), p = Vector3d::UnitX(), q = Vector3d::UnitY();  ///< frame of the first body
    Vector3d second_p = Vector3d::UnitX(), second_q = Vector3d::UnitY();           ///< frame of the second body

    /// In (−π, π].
    [[nodiscard]] double value(const Placements& at) const {
        const Vector3d turned = at[second].A * second_p;
        const Matrix3d& A = at[first].A;
        return std::atan2(turned.dot(A * q), turned.dot(A * p));
    }
    /// The coefficients of ω̄ of a body in θ̇; zero for others. Body frame.
    [[nodiscard]] Vector3d coefficients(const Placements& at, bool of_second) const {
        return of_second ? Vector3d(at[second].A.transpose() * (at[first].A * z)) : Vector3d(-z);
    }
    [[nodiscard]] double rate(const Placements& at) const {
        return coefficients(at, true).dot(at[second].omega) + coefficients(at, false).dot(at[first].omega);
    }
    /// The parts of θ̇ and θ̈ that bodies of prescribed motion have.
    [[nodiscard]] double prescribed_rate(const Placements& at) const { return prescribed_part(at, &Placement::omega); }
    [[nodiscard]] double prescribed_acceleration(const Placements& at) const {
        return prescribed_part(at, &Placement::turning);
    }
    /// Derivative of coefficients(second) along θ of the second and of the first body: [Aᵀz]× and −A_sᵀA_f [z̄]×. Those
    /// of the first are constant.
    [[nodiscard]] Matrix3d turning(const Placements& at, bool along_second) const {
        const Matrix3d relative = at[second].A.transpose() * at[first].A;
        return along_second ? skew(relative * z) : Matrix3d(-relative * skew(z));
    }

private:
    [[nodiscard]] double prescribed_part(const Placements& at, Vector3d Placement::*of) const {
        double sum = 0.0;
        for (const bool of_second : {true, false})
            if (const auto& place = at[of_second ? second : first]; place.prescribed())
                sum += coefficients(at, of_second).dot(place.*of);
        return sum;
    }
};

}  // namespace delassus::mechanics
