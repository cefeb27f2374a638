// SPDX-License-Identifier: BSD-3-Clause
#include "collision/solid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "collision/hull_polytope.hpp"
#include "delassus/error.hpp"

namespace delassus::collision {
namespace {

// Contacts number vertices and edges in 15 bits; a hull of v vertices has fewer than 3 v edges.
constexpr std::size_t kMostVertices = 10000;

Polytope hull_of(const Shape& shape, std::int32_t index) {
    std::vector<Vector3d> points;
    for (const auto& vertex : shape.mesh->vertices) points.emplace_back(vertex[0], vertex[1], vertex[2]);
    Polytope hull = hull_polytope(points);
    if (hull.faces.size() < 4)
        throw InputError(fmt::format("Shape {}: the mesh has no volume; its vertices should span a solid.", index));
    if (hull.vertices.size() > kMostVertices) {
        throw InputError(
            fmt::format("Shape {}: the convex hull of the mesh has {} vertices; it should have at most {}.", index,
                        hull.vertices.size(), kMostVertices));
    }
    if (shape.margin == 0.0) return hull;
    const Vector3d center = centroid(hull);
    double depth = hull.faces[0].offset - hull.faces[0].normal.dot(center);
    for (const auto& face : hull.faces) depth = std::min(depth, face.offset - face.normal.dot(center));
    if (shape.margin >= 0.999 * depth) {
        throw InputError(fmt::format(
            "Shape {}: the margin {} m leaves nothing of the mesh; it should be smaller than {:.6g} m, the distance of "
            "the centroid from the nearest face.",
            index, shape.margin, depth));
    }
    return shrink(hull, shape.margin, center);
}

}  // namespace

Solid make_solid(const Shape& shape, std::int32_t index) {
    Solid solid;
    solid.kind = shape.kind;
    const auto& size = shape.size;
    switch (shape.kind) {
        case ShapeKind::Sphere:
            solid.radius = size[0];
            solid.core = point_polytope();
            break;
        case ShapeKind::Capsule:
            solid.radius = size[0];
            solid.half_length = size[1];
            solid.core = segment_polytope(size[1]);
            break;
        case ShapeKind::Box:
            solid.radius = shape.margin;
            solid.half = Vector3d(size[0], size[1], size[2]).array() - shape.margin;
            solid.core = box_polytope(solid.half);
            break;
        case ShapeKind::Cylinder:
            solid.radius = shape.margin;
            solid.cylinder_radius = size[0] - shape.margin;
            solid.half_length = size[1] - shape.margin;
            solid.core = prism_polytope(solid.cylinder_radius, solid.half_length, kPrismSides);
            break;
        case ShapeKind::Convex:
            solid.radius = shape.margin;
            solid.core = hull_of(shape, index);
            for (const Vector3d& vertex : solid.core.vertices) solid.half = solid.half.cwiseMax(vertex.cwiseAbs());
            break;
        case ShapeKind::Plane:
            break;
        case ShapeKind::Terrain:
        case ShapeKind::HeightField:
            solid.radius = shape.margin;
            solid.terrain = std::make_shared<const Terrain>(*shape.mesh);
            break;
    }
    solid.reach = solid.core.reach() + solid.radius;
    return solid;
}

void Placed::rotate_core() {
    if (rotated) return;
    rotated = true;
    const Polytope& core = solid->core;
    vertices.resize(core.vertices.size());
    normals.resize(core.faces.size());
    directions.resize(core.edges.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i].noalias() = rotation * core.vertices[i];
    for (std::size_t i = 0; i < normals.size(); ++i) normals[i].noalias() = rotation * core.faces[i].normal;
    for (std::size_t i = 0; i < directions.size(); ++i) directions[i].noalias() = rotation * core.edges[i].direction;
}

Vector3d Placed::support(const Vector3d& direction) const {
    if (is_cylinder()) {
        const double along = axis().dot(direction);
        Vector3d across = direction - along * axis();
        // Near the axis this is mostly rounding, part of it along the axis, until it is projected again.
        across -= axis().dot(across) * axis();
        const double length = across.norm();
        Vector3d point = (along < 0.0 ? -solid->half_length : solid->half_length) * axis();
        if (length > 1e-14 * std::abs(along)) point += solid->cylinder_radius / length * across;
        return point;
    }
    const Polytope& core = solid->core;
    if (core.is_large())
        return rotation * core.vertices[core.furthest(core.vertices, rotation.transpose() * direction)];
    return vertices[core.furthest(vertices, direction)];
}

Vector3d half_extent(const Placed& placed) {
    const Solid& solid = *placed.solid;
    const Matrix3d magnitude = placed.rotation.cwiseAbs();
    Vector3d half = Vector3d::Constant(solid.radius);
    switch (solid.kind) {
        case ShapeKind::Box:
        case ShapeKind::Convex:
            return half + magnitude * solid.half;
        case ShapeKind::Capsule:
            return half + solid.half_length * magnitude.col(2);
        case ShapeKind::Cylinder:
            for (Eigen::Index i = 0; i < 3; ++i) {
                const double cosine = std::min(1.0, magnitude(i, 2));
                half[i] += solid.half_length * cosine + solid.cylinder_radius * std::sqrt(1.0 - cosine * cosine);
            }
            return half;
        default:
            return half;
    }
}

}  // namespace delassus::collision
