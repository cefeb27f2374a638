// SPDX-License-Identifier: BSD-3-Clause
// Vectors in space.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace delassus {

/// [v]×, by which [v]× w = v × w.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
    Eigen::Matrix3d result;
    result << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return result;
}

/// A unit vector normal to a unit vector: the x axis without its part along `direction`, or the y axis where x is
/// nearly along it. Normals of grounds, walls and aligned boxes lie where it is continuous: it jumps at |direction.x| =
/// 0.9 only, so that rounding does not turn the frame of a contact at rest.
inline Eigen::Vector3d normal_to(const Eigen::Vector3d& direction) {
    const int axis = std::abs(direction.x()) < 0.9 ? 0 : 1;
    return (Eigen::Vector3d::Unit(axis) - direction[axis] * direction).normalized();
}

/// The rotation whose columns are a contact's directions: the normal, then its tangents. Three rows of a contact give
/// R r in space, and Rᵀ of a vector in space gives them back.
inline Eigen::Matrix3d contact_frame(const Eigen::Vector3d& normal) {
    Eigen::Matrix3d frame;
    frame.col(0) = normal;
    frame.col(1) = normal_to(normal);
    frame.col(2) = normal.cross(frame.col(1));
    return frame;
}

}  // namespace delassus
