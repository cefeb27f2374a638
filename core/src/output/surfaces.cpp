// SPDX-License-Identifier: BSD-3-Clause
#include "output/surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace delassus {
namespace {

// A surface of revolution about z: rings of (radius, z) from bottom to top. A ring of radius zero is one point.
struct Ring {
    double radius, z;
};

Mesh revolved(const std::vector<Ring>& rings, int around) {
    Mesh mesh;
    std::vector<std::int32_t> first;
    std::vector<int> count;
    for (const auto& ring : rings) {
        first.push_back(static_cast<std::int32_t>(mesh.vertices.size()));
        count.push_back(ring.radius == 0.0 ? 1 : around);
        for (int i = 0; i < count.back(); ++i) {
            const double angle = 2.0 * std::numbers::pi * i / around;
            mesh.vertices.push_back({ring.radius * std::cos(angle), ring.radius * std::sin(angle), ring.z});
        }
    }
    for (std::size_t r = 0; r + 1 < rings.size(); ++r)
        for (int i = 0; i < around; ++i) {
            const auto corner = [&](std::size_t ring, int place) { return first[ring] + place % count[ring]; };
            const std::int32_t a = corner(r, i), b = corner(r, i + 1), c = corner(r + 1, i + 1), d = corner(r + 1, i);
            if (count[r] > 1) mesh.triangles.push_back({a, b, c});
            if (count[r + 1] > 1) mesh.triangles.push_back({a, c, d});
        }
    return mesh;
}

/// Half circles of radius r around (0, ±l), with the poles.
Mesh capsule(double r, double l, int around) {
    const int steps = around / 4;
    std::vector<Ring> rings;
    for (int half = 0; half < 2; ++half)
        for (int i = 0; i <= steps; ++i) {
            if (half == 1 && i == 0 && l == 0.0) continue;  // a sphere's equator is there already
            const double angle = 0.5 * std::numbers::pi * ((half == 0 ? -1.0 : 0.0) + static_cast<double>(i) / steps);
            const bool pole = (half == 0 && i == 0) || (half == 1 && i == steps);
            rings.push_back({pole ? 0.0 : r * std::cos(angle), r * std::sin(angle) + (half == 0 ? -l : l)});
        }
    return revolved(rings, around);
}

Mesh box(const Vector3& half) {
    Mesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.vertices.push_back({(corner & 1) != 0 ? half[0] : -half[0], (corner & 2) != 0 ? half[1] : -half[1],
                                 (corner & 4) != 0 ? half[2] : -half[2]});
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

Mesh in_own_frame(const Shape& shape, double plane_size, int around) {
    const auto& [a, b, c] = shape.size;
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return capsule(a, 0.0, around);
        case ShapeKind::Box:
            return box(shape.size);
        case ShapeKind::Capsule:
            return capsule(a, b, around);
        case ShapeKind::Cylinder:
            return revolved({{0.0, -b}, {a, -b}, {a, b}, {0.0, b}}, around);
        case ShapeKind::Convex:
        case ShapeKind::Terrain:
        case ShapeKind::HeightField:
            return *shape.mesh;
        case ShapeKind::Plane:
            break;
    }
    const double s = plane_size;
    return {{{-s, -s, 0.0}, {s, -s, 0.0}, {s, s, 0.0}, {-s, s, 0.0}}, {{0, 1, 2}, {0, 2, 3}}};
}

}  // namespace

// With q = (w, u): A p = p + 2 w (u × p) + 2 u × (u × p).
Vector3 transformed(const Pose& pose, const Vector3& p) {
    const auto& [w, x, y, z] = pose.orientation;
    const Vector3 s{y * p[2] - z * p[1], z * p[0] - x * p[2], x * p[1] - y * p[0]};
    return {pose.position[0] + p[0] + 2.0 * (w * s[0] + y * s[2] - z * s[1]),
            pose.position[1] + p[1] + 2.0 * (w * s[1] + z * s[0] - x * s[2]),
            pose.position[2] + p[2] + 2.0 * (w * s[2] + x * s[1] - y * s[0])};
}

int corners_of_circles(std::span<const Shape> shapes) {
    constexpr std::ptrdiff_t most_triangles = 50000;
    const auto round = std::count_if(shapes.begin(), shapes.end(), [](const Shape& shape) {
        return shape.kind == ShapeKind::Sphere || shape.kind == ShapeKind::Capsule || shape.kind == ShapeKind::Cylinder;
    });
    int corners = 24;
    while (corners > 8 && round * corners * (corners - 2) > most_triangles) corners -= 4;
    return corners;
}

Mesh surface_of(const Shape& shape, double plane_size, int corners) {
    Mesh mesh = in_own_frame(shape, plane_size, corners);
    for (auto& vertex : mesh.vertices) vertex = transformed(shape.pose, vertex);
    return mesh;
}

}  // namespace delassus
