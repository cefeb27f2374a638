// SPDX-License-Identifier: BSD-3-Clause
#include "scene/hull.hpp"

#include <utility>

#include "delassus/error.hpp"
#include "mechanics/convex_hull.hpp"

namespace delassus::scene {

Mesh hull_of_points(const std::vector<Vector3>& points) {
    ConvexHull hull = convex_hull(points);
    if (hull.faces.empty()) throw InputError("the points of a convex shape must span a volume");
    Mesh mesh;
    mesh.vertices = std::move(hull.vertices);
    for (const auto& loop : hull.faces)
        for (std::size_t i = 1; i + 1 < loop.size(); ++i) mesh.triangles.push_back({loop[0], loop[i], loop[i + 1]});
    return mesh;
}

}  // namespace delassus::scene
