// SPDX-License-Identifier: BSD-3-Clause
// Convex polytopes: vertices, edges, polygons. A segment and a point are polytopes without faces.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace delassus::collision {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Polytope {
    struct Face {
        Vector3d normal;                  ///< unit, outward
        double offset = 0.0;              ///< normal · x of its plane, m
        std::vector<std::int32_t> loop;   ///< vertices, counter-clockwise from outside
        std::vector<std::int32_t> edges;  ///< edges[i] joins loop[i] and loop[i + 1]
    };
    struct Edge {
        std::int32_t tail = 0, head = 0;
        std::int32_t left = -1, right = -1;  ///< faces, −1 for a segment
        Vector3d direction;                  ///< unit; along normal(left) × normal(right)
    };
    std::vector<Vector3d> vertices;  ///< m
    std::vector<Face> faces;
    std::vector<Edge> edges;
    /// Where there are many vertices, those that edges join to vertex i: neighbours[first_neighbour[i]] and on, up to
    /// first_neighbour[i + 1]; and the vertices furthest along x, −x, y, −y, z, −z. Empty otherwise.
    std::vector<std::int32_t> first_neighbour, neighbours, furthest_along_axes;

    [[nodiscard]] bool is_large() const { return !neighbours.empty(); }

    /// The vertex that is furthest along a direction, at: the vertices as they are or turned. Of equals the first; in a
    /// large polytope the first that edges between equals lead to.
    [[nodiscard]] std::size_t furthest(const std::vector<Vector3d>& at, const Vector3d& direction) const;

    /// Largest distance of a vertex from the origin, m.
    [[nodiscard]] double reach() const;
};

[[nodiscard]] Polytope point_polytope();
/// From −half to +half along z.
[[nodiscard]] Polytope segment_polytope(double half);
[[nodiscard]] Polytope box_polytope(const Vector3d& half);
/// The prism along z over a regular polygon inscribed in a circle. The loops of both caps begin on the x axis.
[[nodiscard]] Polytope prism_polytope(double radius, double half, std::int32_t sides);

/// From vertices and the loops of the faces: finds normals and edges.
[[nodiscard]] Polytope polytope_of_loops(std::vector<Vector3d> vertices,
                                         const std::vector<std::vector<std::int32_t>>& loops);

}  // namespace delassus::collision
