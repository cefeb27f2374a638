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

/// A unit vector normal to the given unit vector, made from the axis with the smallest component along it (the first of
/// equal ones). Continuous almost everywhere.
inline Eigen::Vector3d normal_to(const Eigen::Vector3d& direction) {
    int least = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(direction[i]) < std::abs(direction[least])) least = i;
    return (Eigen::Vector3d::Unit(least) - direction[least] * direction).normalized();
}

/// Two unit vectors t₁, t₂ with t₁ × t₂ = normal.
inline void tangents(const Eigen::Vector3d& normal, Eigen::Vector3d& first, Eigen::Vector3d& second) {
    first = normal_to(normal);
    second = normal.cross(first);
}

}  // namespace delassus
