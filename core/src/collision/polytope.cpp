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

namespace {

/// Fewer vertices are looked at one by one in less time.
constexpr std::size_t most_looked_at = 32;

std::size_t first_greatest(const std::vector<Vector3d>& at, const Vector3d& direction) {
    std::size_t best = 0;
    double most = at[0].dot(direction);
    for (std::size_t i = 1; i < at.size(); ++i) {
        const double value = at[i].dot(direction);
        if (value > most) {
            most = value;
            best = i;
        }
    }
    return best;
}

void find_neighbours(Polytope& polytope) {
    const std::size_t count = polytope.vertices.size();
    if (count <= most_looked_at) return;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        for (const double sign : {1.0, -1.0})
            polytope.furthest_along_axes.push_back(
                static_cast<std::int32_t>(first_greatest(polytope.vertices, sign * Vector3d::Unit(axis))));
    auto& first = polytope.first_neighbour;
    first.assign(count + 1, 0);
    for (const auto& edge : polytope.edges)
        for (const std::int32_t end : {edge.tail, edge.head}) ++first[static_cast<std::size_t>(end) + 1];
    for (std::size_t i = 0; i < count; ++i) first[i + 1] += first[i];
    polytope.neighbours.resize(2 * polytope.edges.size());
    std::vector<std::int32_t> next(first.begin(), first.end() - 1);
    for (const auto& edge : polytope.edges) {
        polytope.neighbours[static_cast<std::size_t>(next[static_cast<std::size_t>(edge.tail)]++)] = edge.head;
        polytope.neighbours[static_cast<std::size_t>(next[static_cast<std::size_t>(edge.head)]++)] = edge.tail;
    }
}

}  // namespace

// On a convex polytope a vertex from which no edge leads further along a direction is furthest: the climb ends there.
// A neighbour that is as far and comes before counts as further, so that the climb ends, and where it began is all the
// same but for ties.
std::size_t Polytope::furthest(const std::vector<Vector3d>& at, const Vector3d& direction) const {
    if (!is_large()) return first_greatest(at, direction);
    std::int32_t best = furthest_along_axes[0];
    double most = at[static_cast<std::size_t>(best)].dot(direction);
    const auto take_if_further = [&](std::int32_t vertex) {
        const double value = at[static_cast<std::size_t>(vertex)].dot(direction);
        if (value < most || (value == most && vertex >= best)) return;
        most = value;
        best = vertex;
    };
    for (const std::int32_t vertex : furthest_along_axes) take_if_further(vertex);
    for (std::int32_t from = -1; from != best;) {
        from = best;
        const auto place = static_cast<std::size_t>(from);
        for (std::int32_t k = first_neighbour[place]; k < first_neighbour[place + 1]; ++k)
            take_if_further(neighbours[static_cast<std::size_t>(k)]);
    }
    return static_cast<std::size_t>(best);
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
        bottom.push_back(2 * ((sides - i) % sides));
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
    find_neighbours(result);
    return result;
}

}  // namespace delassus::collision
