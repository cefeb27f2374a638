// SPDX-License-Identifier: BSD-3-Clause
// Convex hulls through the module delassus_convex_hull, which the first convex shape loads. So Qhull is mapped only
// into processes that have such shapes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "delassus/collision.hpp"

namespace delassus {

/// A convex polyhedron in one order: vertices as their points were given, each face from its smallest vertex on, faces
/// by their loops. Empty where the points span no volume.
struct ConvexHull {
    std::vector<Vector3> vertices;                 ///< m
    std::vector<std::vector<std::int32_t>> faces;  ///< loops of vertices, counter-clockwise from outside
};

/// The convex hull of points (m). Faces that deviate from a plane by less than 1e-7 of the points' extent are merged;
/// points inside a face or a straight edge are no vertices. Points that are fewer than four, in one plane or not finite
/// span no volume. Throws InputError where this build has no Qhull, and where Qhull fails.
[[nodiscard]] DELASSUS_API ConvexHull convex_hull(const std::vector<Vector3>& points);

}  // namespace delassus

// The module is built together with libdelassus_mechanics, so C++ types may cross here.
extern "C" {
/// delassus_convex_hull_faces of delassus_convex_hull.so: the faces of the hull as loops of points. points: at least
/// four, finite, within the unit ball about the origin. Leaves faces empty where the points span no volume.
using DelassusConvexHullFaces = void (*)(const std::vector<delassus::Vector3>& points, double tolerance,
                                         std::vector<std::vector<std::int32_t>>& faces);
}
