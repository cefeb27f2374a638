// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/convex_hull.hpp"

#include <algorithm>
#include <cmath>

#include "support/module.hpp"

namespace delassus {
namespace {

constexpr double kFlat = 1e-7;  // of the extent

/// The points moved and scaled into the unit ball about the first one. Empty where they are not finite, or all equal.
std::vector<Vector3> in_unit_ball(const std::vector<Vector3>& points) {
    const Vector3 origin = points.front();
    std::vector<Vector3> moved;
    double extent = 0.0;
    for (const Vector3& point : points) {
        moved.push_back({point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]});
        const double distance = std::hypot(moved.back()[0], moved.back()[1], moved.back()[2]);
        if (!std::isfinite(distance)) return {};
        extent = std::max(extent, distance);
    }
    if (extent == 0.0) return {};
    for (Vector3& point : moved)
        for (double& coordinate : point) coordinate /= extent;
    return moved;
}

/// Drops points that lie inside a straight edge, where only two faces meet, and loops that are left with no area.
void drop_straight(std::vector<std::vector<std::int32_t>>& loops, std::size_t points) {
    std::vector<int> faces_at(points, 0);
    for (const auto& loop : loops)
        for (const auto point : loop) ++faces_at[static_cast<std::size_t>(point)];
    for (auto& loop : loops)
        std::erase_if(loop, [&](std::int32_t point) { return faces_at[static_cast<std::size_t>(point)] < 3; });
    std::erase_if(loops, [](const auto& loop) { return loop.size() < 3; });
}

}  // namespace

ConvexHull convex_hull(const std::vector<Vector3>& points) {
    if (points.size() < 4) return {};
    const std::vector<Vector3> moved = in_unit_ball(points);
    if (moved.empty()) return {};
    const auto find_faces = reinterpret_cast<DelassusConvexHullFaces>(
        module_symbol("delassus_convex_hull", "delassus_convex_hull_faces", "a convex shape has no hull", "Qhull",
                      "; leave shapes of points and meshes out of the scene"));
    ConvexHull hull;
    find_faces(moved, kFlat, hull.faces);
    drop_straight(hull.faces, points.size());
    if (hull.faces.size() < 4) return {};

    std::vector<std::int32_t> number(points.size(), -1);
    for (const auto& loop : hull.faces)
        for (const auto point : loop) number[static_cast<std::size_t>(point)] = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (number[i] < 0) continue;
        number[i] = static_cast<std::int32_t>(hull.vertices.size());
        hull.vertices.push_back(points[i]);
    }
    for (auto& loop : hull.faces) {
        for (auto& point : loop) point = number[static_cast<std::size_t>(point)];
        std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
    }
    std::sort(hull.faces.begin(), hull.faces.end());
    return hull;
}

}  // namespace delassus
