// SPDX-License-Identifier: BSD-3-Clause
#include "collision/hull_polytope.hpp"

#include <Eigen/Geometry>
#include <utility>

#include "mechanics/convex_hull.hpp"

namespace delassus::collision {

Polytope hull_polytope(const std::vector<Vector3d>& points) {
    std::vector<Vector3> given;
    for (const Vector3d& point : points) given.push_back({point.x(), point.y(), point.z()});
    const ConvexHull hull = convex_hull(given);
    std::vector<Vector3d> vertices;
    for (const Vector3& vertex : hull.vertices) vertices.emplace_back(vertex[0], vertex[1], vertex[2]);
    return polytope_of_loops(std::move(vertices), hull.faces);
}

// Polar duality: about a centre inside, the face n · x = o of the shrunk polytope is the point n/o; the hull of these
// points has a face for each vertex of the shrunk polytope, N · y = O, and the vertex is N/O.
Polytope shrink(const Polytope& polytope, double distance, const Vector3d& center) {
    std::vector<Vector3d> dual;
    for (const auto& face : polytope.faces)
        dual.push_back(face.normal / (face.offset - distance - face.normal.dot(center)));
    const Polytope polar = hull_polytope(dual);
    std::vector<Vector3d> vertices;
    for (const auto& face : polar.faces) vertices.push_back(center + face.normal / face.offset);
    return hull_polytope(vertices);
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
