// SPDX-License-Identifier: BSD-3-Clause
#include "collision/polytope.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace delassus::collision {

double Polytope::reach() const {
    double square = 0.0;
    for (const Vector3d& vertex : vertices) square = std::max(square, vertex.squaredNorm());
    return std::sqrt(square);
}

Polytope point_polytope() {
    Polytope result;
    result.vertices.push_back(Vector3d::Zero());
    return result;
}

Polytope segment_polytope(double half) {
    Polytope result;
    result.vertices = {Vector3d(0.0, 0.0, -half), Vector3d(0.0, 0.0, half)};
    result.edges.push_back({0, 1, -1, -1, Vector3d::UnitZ()});
    return result;
}

Polytope box_polytope(const Vector3d& half) {
    std::vector<Vector3d> vertices;
    for (int i = 0; i < 8; ++i) {
        vertices.emplace_back((i & 1) != 0 ? half.x() : -half.x(), (i & 2) != 0 ? half.y() : -half.y(),
                              (i & 4) != 0 ? half.z() : -half.z());
    }
    Polytope result = polytope_of_loops(
        std::move(vertices), {{1, 3, 7, 5}, {0, 4, 6, 2}, {2, 6, 7, 3}, {0, 1, 5, 4}, {4, 5, 7, 6}, {0, 2, 3, 1}});
    // The axes of a box are known without rounding.
    for (std::size_t face = 0; face < 6; ++face) {
        const auto axis = static_cast<Eigen::Index>(face / 2);
        result.faces[face].normal = (face % 2 == 0 ? 1.0 : -1.0) * Vector3d::Unit(axis);
        result.faces[face].offset = half[axis];
    }
    return result;
}

Polytope prism_polytope(double radius, double half, std::int32_t sides) {
    std::vector<Vector3d> vertices;
    std::vector<std::int32_t> top, bottom;
    std::vector<std::vector<std::int32_t>> loops;
    for (std::int32_t i = 0; i < sides; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / sides;
        vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), -half);
        vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), half);
        const std::int32_t next = (i + 1) % sides;
        loops.push_back({2 * i, 2 * next, 2 * next + 1, 2 * i + 1});
        top.push_back(2 * i + 1);
        bottom.push_back(2 * (sides - 1 - i));
    }
    loops.push_back(std::move(top));
    loops.push_back(std::move(bottom));
    return polytope_of_loops(std::move(vertices), loops);
}

Polytope polytope_of_loops(std::vector<Vector3d> vertices, const std::vector<std::vector<std::int32_t>>& loops) {
    Polytope result;
    result.vertices = std::move(vertices);
    for (const auto& loop : loops) {
        // Newell's normal: the sum over the fan, that is twice the area vector.
        Vector3d area = Vector3d::Zero();
        const Vector3d& origin = result.vertices[loop[0]];
        for (std::size_t i = 1; i + 1 < loop.size(); ++i)
            area += (result.vertices[loop[i]] - origin).cross(result.vertices[loop[i + 1]] - origin);
        Polytope::Face face;
        face.normal = area.normalized();
        face.offset = face.normal.dot(origin);
        for (const std::int32_t vertex : loop)
            face.offset = std::max(face.offset, face.normal.dot(result.vertices[vertex]));
        face.loop = loop;
        face.edges.resize(loop.size());
        result.faces.push_back(std::move(face));
    }
    // A face lies to the left of its own edges, so that of an edge from tail to head, left sees (tail, head) and right
    // sees (head, tail); the direction left × right is then from tail to head.
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> index;
    for (std::int32_t f = 0; f < static_cast<std::int32_t>(result.faces.size()); ++f) {
        Polytope::Face& face = result.faces[f];
        for (std::size_t i = 0; i < face.loop.size(); ++i) {
            const std::int32_t tail = face.loop[i];
            const std::int32_t head = face.loop[(i + 1) % face.loop.size()];
            const auto [place, added] = index.try_emplace(std::minmax(tail, head), 0);
            if (added) {
                place->second = static_cast<std::int32_t>(result.edges.size());
                result.edges.push_back(
                    {tail, head, f, -1, (result.vertices[head] - result.vertices[tail]).normalized()});
            } else {
                result.edges[place->second].right = f;
            }
            face.edges[i] = place->second;
        }
    }
    return result;
}

}  // namespace delassus::collision
