// SPDX-License-Identifier: BSD-3-Clause
// The angle of a revolute joint as a function of the configuration.
//
// With z and p, q = z × p fixed in the first body and z', p' fixed in the second (z' = z, p' = p at angle zero):
//     θ = atan2(p' · q, p' · p),    θ̇ = z · (ω_second − ω_first) = z' · ω̄_second − z · ω̄_first   while the joint holds.
//
// Two orientations tell θ modulo 2π. Where whole turns matter, q has the sum of z' · δθ_second − z · δθ_first over all
// increments of bodies that move freely. Those of bodies whose motion is prescribed have turned by a known vector. The
// angle is the value modulo 2π that is nearest to the sum of both.
#pragma once

#include <cmath>

#include "mechanics/placement.hpp"

namespace delassus::mechanics {

struct Angle {
    BodyIndex first = world_body, second = world_body;
    Vector3d z = Vector3d::UnitZ(), p = Vector3d::UnitX(), q = Vector3d::UnitY();  ///< frame of the first body
    /// z', p' and q' = z' × p': frame of the second body.
    Vector3d second_z = Vector3d::UnitZ(), second_p = Vector3d::UnitX(), second_q = Vector3d::UnitY();
    std::int32_t counted = -1;  ///< its number in Placements::angles; −1: nothing asks for whole turns

    /// Over whole turns where they are counted, else in (−π, π].
    [[nodiscard]] double value(const Placements& at) const {
        const double angle = within_a_turn(at[first].A, at[second].A);
        return counted < 0 ? angle : nearest(angle, at.angles[static_cast<std::size_t>(counted)] + prescribed_turn(at));
    }
    /// In (−π, π].
    [[nodiscard]] double within_a_turn(const Matrix3d& A_first, const Matrix3d& A_second) const {
        const Vector3d turned = A_second * second_p;
        return std::atan2(turned.dot(A_first * q), turned.dot(A_first * p));
    }
    /// The change of θ by these turns of the bodies, each in its own frame.
    [[nodiscard]] double change(const Vector3d& of_first, const Vector3d& of_second) const {
        return second_z.dot(of_second) - z.dot(of_first);
    }
    /// What bodies of prescribed motion have turned it by since t = 0.
    [[nodiscard]] double prescribed_turn(const Placements& at) const { return change(at[first].turn, at[second].turn); }
    /// The value of an angle modulo 2π that is nearest to `wanted`.
    static double nearest(double angle, double wanted) {
        return angle + 2.0 * M_PI * std::round((wanted - angle) / (2.0 * M_PI));
    }
    /// The coefficients of ω̄ of a body in θ̇; zero for others. Body frame.
    [[nodiscard]] Vector3d coefficients(const Placements& at, bool of_second) const {
        return of_second ? Vector3d(at[second].A.transpose() * (at[first].A * z)) : Vector3d(-z);
    }
    /// The part of θ̇ that bodies of prescribed motion have.
    [[nodiscard]] double prescribed_rate(const Placements& at) const { return prescribed_part(at, &Placement::omega); }
    /// θ̈ where no free body accelerates: with ω̄˙ = 0 also ω̇ = 0, and ż · (ω_second − ω_first) = (ω_first × z) ·
    /// ω_second.
    [[nodiscard]] double curvature(const Placements& at) const {
        return (at[first].A * at[first].omega.cross(z)).dot(at[second].A * at[second].omega) +
               prescribed_part(at, &Placement::turning);
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
