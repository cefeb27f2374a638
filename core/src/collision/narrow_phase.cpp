// SPDX-License-Identifier: BSD-3-Clause
#include "collision/narrow_phase.hpp"

#include <Eigen/Geometry>

#include "mechanics/contact_feature.hpp"

namespace delassus::collision {
namespace {

/// Point core of one against the core of the other, in closed form.
Separation point_separation(const Placed& a, const Placed& b, const Vector3d& offset, bool point_is_a) {
    const Placed& other = point_is_a ? b : a;
    const Vector3d point = point_is_a ? Vector3d(-offset) : offset;
    Separation result;
    Vector3d normal, nearest;
    nearest_on_core(*other.solid, other.rotation.transpose() * point, result.distance, normal, nearest);
    normal = other.rotation * normal;
    nearest = point - result.distance * normal;
    if (point_is_a) {
        result.normal = -normal;
        result.point_b = offset + nearest;
    } else {
        result.normal = normal;
        result.point_a = nearest;
        result.point_b = offset;
    }
    return result;
}

Separation segment_separation(const Placed& a, const Placed& b, const Vector3d& offset) {
    const Vector3d u = a.solid->half_length * a.axis(), v = b.solid->half_length * b.axis();
    Separation result;
    nearest_of_segments(-u, 2.0 * u, offset - v, 2.0 * v, result.point_a, result.point_b);
    const Vector3d difference = result.point_b - result.point_a;
    result.distance = difference.norm();
    if (result.distance > 0.0) {
        result.normal = difference / result.distance;
    } else {
        const Vector3d across = u.cross(v);
        result.normal = across.norm() > 0.0 ? across.normalized() : u.unitOrthogonal();
    }
    return result;
}

/// Whether nearest_on_core knows the kind.
bool simple(ShapeKind kind) {
    return kind != ShapeKind::Convex && kind != ShapeKind::Plane;
}

}  // namespace

void NarrowPhase::collide(Placed& a, Placed& b, double envelope, std::vector<ContactPoint>& contacts) {
    const Vector3d offset = b.position - a.position;
    const ShapeKind kind_a = a.solid->kind, kind_b = b.solid->kind;
    if (a.solid->terrain) return terrain_.collide(a, b, true, envelope, contacts);
    if (b.solid->terrain) return terrain_.collide(b, a, false, envelope, contacts);
    const double limit = envelope + a.solid->radius + b.solid->radius;
    points_.clear();
    if (kind_a == ShapeKind::Plane) {
        manifold_.on_plane(b, -offset, a.axis(), true, limit, points_);
        for (CorePoint& point : points_) {
            point.point_a += offset;
            point.point_b += offset;
        }
    } else if (kind_b == ShapeKind::Plane) {
        manifold_.on_plane(a, offset, b.axis(), false, limit, points_);
    } else if (kind_a == ShapeKind::Sphere && simple(kind_b)) {
        points_.push_back(point_separation(a, b, offset, true));
    } else if (kind_b == ShapeKind::Sphere && simple(kind_a)) {
        points_.push_back(point_separation(a, b, offset, false));
    } else if (kind_a == ShapeKind::Capsule && kind_b == ShapeKind::Capsule) {
        const Separation nearest = segment_separation(a, b, offset);
        a.rotate_core();
        b.rotate_core();
        if (nearest.distance < limit) manifold_.between(a, b, offset, nearest, limit, points_);
    } else {
        const bool round = a.is_cylinder() || b.is_cylinder();
        const auto nearest =
            round ? cylinder_separation(a, b, offset, limit) : polytope_separation(a, b, offset, limit);
        if (nearest) manifold_.between(a, b, offset, *nearest, limit, points_);
    }
    for (const CorePoint& point : points_) {
        ContactPoint contact;
        contact.gap = point.distance - a.solid->radius - b.solid->radius;
        if (!(contact.gap < envelope)) continue;
        const Vector3d on_a = a.position + point.point_a + a.solid->radius * point.normal;
        const Vector3d on_b = a.position + point.point_b - b.solid->radius * point.normal;
        for (std::size_t i = 0; i < 3; ++i) {
            contact.point_a[i] = on_a[static_cast<Eigen::Index>(i)];
            contact.point_b[i] = on_b[static_cast<Eigen::Index>(i)];
            contact.normal[i] = point.normal[static_cast<Eigen::Index>(i)];
        }
        contact.feature = point.feature;
        contacts.push_back(contact);
    }
}

}  // namespace delassus::collision
