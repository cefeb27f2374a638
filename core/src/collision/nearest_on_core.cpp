// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "collision/narrow_phase.hpp"

namespace delassus::collision {
namespace {

/// From the nearest point, which is not the point itself if the point is outside.
void outside(const Vector3d& point, const Vector3d& fallback, double& distance, Vector3d& normal,
             const Vector3d& nearest) {
    const Vector3d difference = point - nearest;
    distance = difference.norm();
    normal = distance > 0.0 ? Vector3d(difference / distance) : fallback;
}

void on_box(const Vector3d& half, const Vector3d& point, double& distance, Vector3d& normal, Vector3d& nearest) {
    nearest = point.cwiseMax(-half).cwiseMin(half);
    if (nearest != point) return outside(point, Vector3d::UnitZ(), distance, normal, nearest);
    Eigen::Index axis = 0;
    distance = (point.cwiseAbs() - half).maxCoeff(&axis);
    normal = std::copysign(1.0, point[axis]) * Vector3d::Unit(axis);
    nearest = point - distance * normal;
}

void on_cylinder(double radius, double half, const Vector3d& point, double& distance, Vector3d& normal,
                 Vector3d& nearest) {
    const double across = std::hypot(point.x(), point.y());
    const Vector3d radial = across > 0.0 ? Vector3d(point.x() / across, point.y() / across, 0.0) : Vector3d::UnitX();
    const double side = across - radius, cap = std::abs(point.z()) - half;
    if (side > 0.0 && cap > 0.0) {
        nearest = radius * radial + std::copysign(half, point.z()) * Vector3d::UnitZ();
        return outside(point, radial, distance, normal, nearest);
    }
    distance = std::max(side, cap);
    normal = cap >= side ? Vector3d(std::copysign(1.0, point.z()) * Vector3d::UnitZ()) : radial;
    nearest = point - distance * normal;
}

}  // namespace

void nearest_on_core(const Solid& solid, const Vector3d& point, double& distance, Vector3d& normal, Vector3d& nearest) {
    switch (solid.kind) {
        case ShapeKind::Box:
            return on_box(solid.half, point, distance, normal, nearest);
        case ShapeKind::Cylinder:
            return on_cylinder(solid.cylinder_radius, solid.half_length, point, distance, normal, nearest);
        default:
            nearest = Vector3d(0.0, 0.0, std::clamp(point.z(), -solid.half_length, solid.half_length));
            return outside(point, Vector3d::UnitX(), distance, normal, nearest);
    }
}

}  // namespace delassus::collision
