// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/prescribed_motion.hpp"

#include <cmath>

#include "mechanics/model.hpp"

namespace delassus::mechanics {

namespace {

Vector3d at_time(const std::array<Motion, 3>& motions, std::function<double(double)> Motion::*part, double t) {
    Vector3d result = Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i)
        if (motions[i].*part) result[static_cast<Eigen::Index>(i)] = (motions[i].*part)(t);
    return result;
}

}  // namespace

PrescribedMotion::PrescribedMotion(const BodyMotion& motion, const Pose& given)
    : translation_(motion.translation),
      angle_(motion.angle.value ? motion.angle : Motion::constant(0.0)),
      axis_(vector(motion.axis).normalized()),
      point_(motion.point ? vector(*motion.point) : vector(given.position)),
      arm_(vector(given.position) - point_),
      orientation_(quaternion(given.orientation)) {
    own_axis_ = orientation_.conjugate() * axis_;
    start_ = angle_.value(0.0);
}

Quaterniond PrescribedMotion::turn(double t) const {
    const double half = 0.5 * angle_.value(t);
    const Vector3d v = std::sin(half) * axis_;
    return {std::cos(half), v.x(), v.y(), v.z()};
}

Pose PrescribedMotion::pose(double t) const {
    const Quaterniond Q = turn(t), A = (Q * orientation_).normalized();
    return {array(point_ + Q * arm_ + at_time(translation_, &Motion::value, t)), {A.w(), A.x(), A.y(), A.z()}};
}

bool PrescribedMotion::turns_about(const Vector3d& point, const Vector3d& direction) const {
    constexpr double rounding = 1e-9;
    const Vector3d arm = point + orientation_.conjugate() * arm_;
    return own_axis_.cross(arm).norm() <= rounding * (1.0 + arm.norm()) &&
           own_axis_.cross(direction).norm() <= rounding * direction.norm();
}

void PrescribedMotion::place(double t, Placement& at) const {
    const Quaterniond Q = turn(t);
    const Vector3d r = Q * arm_;
    const double rate = angle_.rate(t), acceleration = angle_.acceleration(t);
    at.x = point_ + r + at_time(translation_, &Motion::value, t);
    at.A = (Q * orientation_).normalized().toRotationMatrix();
    at.v = rate * axis_.cross(r) + at_time(translation_, &Motion::rate, t);
    at.omega = rate * own_axis_;
    at.acceleration = acceleration * axis_.cross(r) + rate * rate * axis_.cross(axis_.cross(r)) +
                      at_time(translation_, &Motion::acceleration, t);
    at.turning = acceleration * own_axis_;
    at.turn = (angle_.value(t) - start_) * own_axis_;
}

void PrescribedMotion::place_for_step(double t, double h, Placement& at) const {
    place(t, at);
    const Vector3d end = point_ + turn(t + h) * arm_ + at_time(translation_, &Motion::value, t + h);
    at.v = (end - at.x) / h;
    at.omega = (angle_.value(t + h) - angle_.value(t)) / h * own_axis_;
}

}  // namespace delassus::mechanics
