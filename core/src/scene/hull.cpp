// SPDX-License-Identifier: BSD-3-Clause
#include "scene/hull.hpp"

#include "collision/convex_hull.hpp"
#include "delassus/error.hpp"

namespace delassus::scene {

Mesh hull_of_points(const std::vector<Vector3>& points) {
    std::vector<collision::Vector3d> vectors;
    for (const auto& point : points) vectors.emplace_back(point[0], point[1], point[2]);
    const auto hull = collision::convex_hull(vectors);
    if (hull.faces.size() < 4) throw InputError("the points of a convex shape must span a volume");
    Mesh mesh;
    for (const auto& vertex : hull.vertices) mesh.vertices.push_back({vertex[0], vertex[1], vertex[2]});
    for (const auto& face : hull.faces)
        for (std::size_t i = 1; i + 1 < face.loop.size(); ++i)
            mesh.triangles.push_back({face.loop[0], face.loop[i], face.loop[i + 1]});
    return mesh;
}

}  // namespace delassus::scene
