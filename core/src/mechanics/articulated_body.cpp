// SPDX-License-Identifier: BSD-3-Clause
// Forward dynamics of trees by articulated bodies.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "delassus/timestepper.hpp"
#include "mechanics/kinematic_tree.hpp"

namespace delassus::mechanics {

// Featherstone 2008, section 7.3. A link with all that it carries answers an acceleration a = (ω̇, v̇) by the wrench
// I a + p that its joint must put on it, if the joints beyond it are left to themselves. With the link's own inertia
// and p = −f to begin with, and from the tips to the ground,
//
//     U = I S,   D = Sᵀ U,   y = −Sᵀ p
//     a = a′ + S u̇,  a′ = (what the parent's acceleration makes) + c,   Sᵀ(I a + p) = 0:   u̇ = D⁻¹ (y − Uᵀ a′)
//     on the parent:  I − U D⁻¹ Uᵀ   and   p + (I − U D⁻¹ Uᵀ) c + U D⁻¹ y
//
// taken about the mass centre of the parent: with X = [1 0; −[d]× 1], Xᵀ I X and Xᵀ p. An armature a of the joint,
// whose rotor turns with the coordinate, adds a u̇ to Sᵀ(I a + p): D = Sᵀ U + a.

// Of a massless body with one freedom, D is what is left of the inertia that it carries after the joints beyond it have
// given way. Where one of those has the same axis, that is rounding.
void KinematicTree::require_resistance(std::size_t k, double least) const {
    constexpr double rounding = 1e-13;
    const Link& link = links_[k];
    const bool slides = link.kind == LinkJoint::Prismatic || link.kind == LinkJoint::Cylindrical;
    if (least > rounding * (slides ? link.carried_mass : link.carried_inertia)) return;
    throw StepFailure(
        fmt::format("the body \"{}\" has no mass, and nothing that it carries resists its joint here: another axis is "
                    "parallel to it",
                    link.name));
}

template <int freedoms>
void KinematicTree::eliminate(std::size_t k) {
    const Link& link = links_[k];
    const LinkMotion& own = motions_[k];
    Articulated& body = articulated_[k];
    auto U = body.U.leftCols<freedoms>();
    if constexpr (freedoms > 0) {
        const auto angular = own.angular.leftCols<freedoms>();
        const auto linear = own.linear.leftCols<freedoms>();
        U.template topRows<3>().noalias() = body.turning * angular + body.mixed * linear;
        U.template bottomRows<3>().noalias() = body.mixed.transpose() * angular + body.moving * linear;
        Eigen::Matrix<double, freedoms, freedoms> D =
            angular.transpose() * U.template topRows<3>() + linear.transpose() * U.template bottomRows<3>();
        D.diagonal() += link.armature.head<freedoms>();
        if (link.mass == 0.0) require_resistance(k, D.diagonal().minCoeff());
        body.force.head<freedoms>() =
            -(angular.transpose() * body.bias.angular + linear.transpose() * body.bias.linear);
        if constexpr (freedoms <= 3) {
            body.inverse.topLeftCorner<freedoms, freedoms>() = D.inverse();
        } else {
            body.inverse.topLeftCorner<freedoms, freedoms>() =
                D.llt().solve(Eigen::Matrix<double, freedoms, freedoms>::Identity());
        }
    }
    if (link.parent == 0) return;
    Matrix3d turning = body.turning, mixed = body.mixed, moving = body.moving;
    Vector3d torque = body.bias.angular, force = body.bias.linear;
    if constexpr (freedoms > 0) {
        const Eigen::Matrix<double, 6, freedoms> V = U * body.inverse.topLeftCorner<freedoms, freedoms>();
        turning.noalias() -= V.template topRows<3>() * U.template topRows<3>().transpose();
        mixed.noalias() -= V.template topRows<3>() * U.template bottomRows<3>().transpose();
        moving.noalias() -= V.template bottomRows<3>() * U.template bottomRows<3>().transpose();
        torque.noalias() += V.template topRows<3>() * body.force.head<freedoms>();
        force.noalias() += V.template bottomRows<3>() * body.force.head<freedoms>();
    }
    torque.noalias() += turning * own.turn_bias + mixed * own.bias;
    force.noalias() += mixed.transpose() * own.turn_bias + moving * own.bias;
    Articulated& base = articulated_[static_cast<std::size_t>(link.parent)];
    const Matrix3d d = skew(own.d);
    base.moving += moving;
    base.turning.noalias() += turning + d * mixed.transpose();
    mixed.noalias() += d * moving;
    base.turning.noalias() -= mixed * d;
    base.mixed += mixed;
    base.bias.angular += torque + own.d.cross(force);
    base.bias.linear += force;
}

template <int freedoms>
void KinematicTree::resolve(std::size_t k, double* u_dot) {
    const Link& link = links_[k];
    const LinkMotion& own = motions_[k];
    const Spatial& base = acceleration_[static_cast<std::size_t>(link.parent)];
    Spatial& moved = acceleration_[k];
    moved.angular = base.angular + own.turn_bias;
    moved.linear = base.linear + base.angular.cross(own.d) + own.bias;
    if constexpr (freedoms > 0) {
        const Articulated& body = articulated_[k];
        const auto U = body.U.leftCols<freedoms>();
        const Eigen::Matrix<double, freedoms, 1> rest =
            body.force.head<freedoms>() - (U.template topRows<3>().transpose() * moved.angular +
                                           U.template bottomRows<3>().transpose() * moved.linear);
        Eigen::Map<Eigen::Matrix<double, freedoms, 1>> result(u_dot + link.column);
        result.noalias() = body.inverse.topLeftCorner<freedoms, freedoms>() * rest;
        moved.angular.noalias() += own.angular.leftCols<freedoms>() * result;
        moved.linear.noalias() += own.linear.leftCols<freedoms>() * result;
    }
}

namespace {

/// Calls visit with the number of freedoms as a constant.
template <class Visitor>
void with_freedoms(std::int32_t freedoms, Visitor&& visit) {
    switch (freedoms) {
        case 0:
            return visit(std::integral_constant<int, 0>());
        case 1:
            return visit(std::integral_constant<int, 1>());
        case 2:
            return visit(std::integral_constant<int, 2>());
        case 3:
            return visit(std::integral_constant<int, 3>());
        default:
            return visit(std::integral_constant<int, 6>());
    }
}

}  // namespace

void KinematicTree::accelerate(const double* f, double* u_dot) {
    for (std::size_t k = 1; k < links_.size(); ++k) {
        const double* own = f + links_[k].body_column;
        Articulated& body = articulated_[k];
        body.turning = inertia(k);
        body.mixed.setZero();
        body.moving = links_[k].mass * Matrix3d::Identity();
        body.bias.angular.noalias() = -(motions_[k].A * Eigen::Map<const Vector3d>(own + 3));
        body.bias.linear = -Eigen::Map<const Vector3d>(own);
    }
    for (std::size_t k = links_.size() - 1; k > 0; --k)
        with_freedoms(links_[k].freedoms, [&](auto count) { eliminate<count.value>(k); });
    for (std::size_t k = 1; k < links_.size(); ++k)
        with_freedoms(links_[k].freedoms, [&](auto count) { resolve<count.value>(k, u_dot); });
}

}  // namespace delassus::mechanics
