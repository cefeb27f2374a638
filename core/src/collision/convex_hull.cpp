// SPDX-License-Identifier: BSD-3-Clause
#include "collision/convex_hull.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace delassus::collision {
namespace {

struct Triangle {
    std::array<std::int32_t, 3> vertices;
    Vector3d normal;  ///< unit
    double offset;
    double area;
};

Triangle triangle(const std::vector<Vector3d>& points, std::int32_t a, std::int32_t b, std::int32_t c) {
    const Vector3d area = (points[b] - points[a]).cross(points[c] - points[a]);
    const Vector3d normal = area.normalized();
    return {{a, b, c}, normal, normal.dot(points[a]), 0.5 * area.norm()};
}

/// The index of the largest value.
template <typename Value>
std::int32_t farthest(const std::vector<Vector3d>& points, Value&& value) {
    std::int32_t best = 0;
    for (std::int32_t i = 1; i < static_cast<std::int32_t>(points.size()); ++i) {
        if (value(points[i]) > value(points[best])) best = i;
    }
    return best;
}

/// Adds the points one by one: the triangles that see a point go, and their horizon is joined to it. A point within
/// tolerance (m) of the hull is taken as inside.
std::vector<Triangle> triangulated_hull(const std::vector<Vector3d>& points, double tolerance) {
    const std::int32_t a = farthest(points, [&](const Vector3d& p) { return -p.x(); });
    const std::int32_t b = farthest(points, [&](const Vector3d& p) { return (p - points[a]).norm(); });
    const Vector3d along = (points[b] - points[a]).normalized();
    const std::int32_t c = farthest(points, [&](const Vector3d& p) { return (p - points[a]).cross(along).norm(); });
    const Vector3d across = (points[b] - points[a]).cross(points[c] - points[a]).normalized();
    const std::int32_t d = farthest(points, [&](const Vector3d& p) { return std::abs(across.dot(p - points[a])); });
    const double height = across.dot(points[d] - points[a]);
    if (!(std::abs(height) > tolerance)) return {};
    std::vector<Triangle> hull;
    const bool above = height > 0.0;
    for (const auto& [i, j, k] : {std::array{a, c, b}, std::array{a, b, d}, std::array{b, c, d}, std::array{c, a, d}})
        hull.push_back(above ? triangle(points, i, j, k) : triangle(points, i, k, j));

    std::vector<Triangle> kept;
    for (std::int32_t p = 0; p < static_cast<std::int32_t>(points.size()); ++p) {
        kept.clear();
        std::set<std::pair<std::int32_t, std::int32_t>> removed;
        for (const Triangle& face : hull) {
            if (face.normal.dot(points[p]) - face.offset <= tolerance) {
                kept.push_back(face);
            } else {
                for (int i = 0; i < 3; ++i) removed.emplace(face.vertices[i], face.vertices[(i + 1) % 3]);
            }
        }
        for (const auto& [tail, head] : removed) {
            if (!removed.contains({head, tail})) kept.push_back(triangle(points, tail, head, p));
        }
        hull.swap(kept);
    }
    return hull;
}

/// Numbers the planes: a triangle joins its neighbour's plane if its vertices are within tolerance (m) of it. Large
/// triangles come first, because their normals are the best.
std::vector<std::int32_t> planes(const std::vector<Vector3d>& points, const std::vector<Triangle>& hull,
                                 double tolerance) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> owner;
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(hull.size()); ++t) {
        for (int i = 0; i < 3; ++i) owner[{hull[t].vertices[i], hull[t].vertices[(i + 1) % 3]}] = t;
    }
    std::vector<std::int32_t> order(hull.size()), plane(hull.size(), -1);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::int32_t i, std::int32_t j) { return hull[i].area > hull[j].area; });
    for (const std::int32_t seed : order) {
        if (plane[seed] >= 0) continue;
        std::vector<std::int32_t> open{seed};
        plane[seed] = seed;
        while (!open.empty()) {
            const Triangle face = hull[open.back()];
            open.pop_back();
            for (int i = 0; i < 3; ++i) {
                const auto next = owner.find({face.vertices[(i + 1) % 3], face.vertices[i]});
                if (next == owner.end() || plane[next->second] >= 0) continue;
                const Triangle& candidate = hull[next->second];
                const bool flat =
                    candidate.normal.dot(hull[seed].normal) > 0.5 &&
                    std::all_of(candidate.vertices.begin(), candidate.vertices.end(), [&](std::int32_t v) {
                        return std::abs(hull[seed].normal.dot(points[v]) - hull[seed].offset) <= tolerance;
                    });
                if (!flat) continue;
                plane[next->second] = seed;
                open.push_back(next->second);
            }
        }
    }
    return plane;
}

}  // namespace

Polytope convex_hull(const std::vector<Vector3d>& points) {
    if (points.size() < 4) return {};
    double size = 0.0;
    for (const Vector3d& point : points) size = std::max(size, (point - points[0]).norm());
    const std::vector<Triangle> hull = triangulated_hull(points, 1e-12 * size);
    if (hull.empty()) return {};
    const std::vector<std::int32_t> plane = planes(points, hull, 1e-7 * size);

    // The border of a plane: directed edges whose opposite belongs to another plane.
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> plane_of;
    for (std::size_t t = 0; t < hull.size(); ++t) {
        for (int i = 0; i < 3; ++i) plane_of[{hull[t].vertices[i], hull[t].vertices[(i + 1) % 3]}] = plane[t];
    }
    std::map<std::int32_t, std::map<std::int32_t, std::int32_t>> borders;
    std::vector<std::set<std::int32_t>> planes_at(points.size());
    for (const auto& [edge, own] : plane_of) {
        const auto opposite = plane_of.find({edge.second, edge.first});
        if (opposite == plane_of.end() || opposite->second == own) continue;
        borders[own][edge.first] = edge.second;
        planes_at[edge.first].insert(own);
    }
    std::vector<std::int32_t> number(points.size(), -1);
    std::vector<Vector3d> vertices;
    std::vector<std::vector<std::int32_t>> loops;
    for (const auto& [own, next] : borders) {
        std::vector<std::int32_t> loop;
        std::int32_t vertex = next.begin()->first;
        for (std::size_t i = 0; i < next.size(); ++i) {
            // A vertex where only two planes meet lies inside a straight edge.
            if (planes_at[vertex].size() > 2) {
                if (number[vertex] < 0) {
                    number[vertex] = static_cast<std::int32_t>(vertices.size());
                    vertices.push_back(points[vertex]);
                }
                loop.push_back(number[vertex]);
            }
            const auto following = next.find(vertex);
            if (following == next.end()) break;
            vertex = following->second;
        }
        if (loop.size() >= 3) loops.push_back(std::move(loop));
    }
    return polytope_of_loops(std::move(vertices), loops);
}

// Polar duality: about a centre inside, the face n · x = o of the shrunk polytope is the point n/o; the hull of these
// points has a face for each vertex of the shrunk polytope, N · y = O, and the vertex is N/O.
Polytope shrink(const Polytope& polytope, double distance, const Vector3d& center) {
    std::vector<Vector3d> dual;
    for (const auto& face : polytope.faces)
        dual.push_back(face.normal / (face.offset - distance - face.normal.dot(center)));
    const Polytope polar = convex_hull(dual);
    std::vector<Vector3d> vertices;
    for (const auto& face : polar.faces) vertices.push_back(center + face.normal / face.offset);
    return convex_hull(vertices);
}

Vector3d centroid(const Polytope& polytope) {
    const Vector3d origin = polytope.vertices[0];
    Vector3d moment = Vector3d::Zero();
    double volume = 0.0;
    for (const auto& face : polytope.faces) {
        const Vector3d a = polytope.vertices[face.loop[0]] - origin;
        for (std::size_t i = 1; i + 1 < face.loop.size(); ++i) {
            const Vector3d b = polytope.vertices[face.loop[i]] - origin;
            const Vector3d c = polytope.vertices[face.loop[i + 1]] - origin;
            const double part = a.dot(b.cross(c));
            volume += part;
            moment += part * 0.25 * (a + b + c);
        }
    }
    return origin + moment / volume;
}

}  // namespace delassus::collision
