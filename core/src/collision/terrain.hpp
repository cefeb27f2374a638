// SPDX-License-Identifier: BSD-3-Clause
// A surface of triangles that does not move: what its features are, and which of them are near a box.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "delassus/collision.hpp"

namespace delassus::collision {

using Eigen::Vector3d;
using AlignedBox3d = Eigen::AlignedBox3d;

/// Lengths in m, in the shape's frame. Made once; a detection only reads.
class Terrain {
public:
    enum class EdgeKind : std::uint8_t {
        Flat,     ///< its triangles lie in one plane
        Concave,  ///< a valley
        Convex,   ///< a ridge
        Rim       ///< has one triangle
    };
    struct Triangle {
        std::array<std::int32_t, 3> corners;  ///< counter-clockwise from above
        std::array<EdgeKind, 3> kinds{};      ///< of the edges from corner k to k + 1
        std::array<std::int32_t, 3> sharp_edge{
            -1, -1, -1};                 ///< their numbers among sharp_edges(), −1 for flat and concave ones
        std::array<Vector3d, 3> inward;  ///< unit, in the plane, normal to the edges, into the triangle
        Vector3d normal;                 ///< unit, upward
        std::int32_t facet = 0;          ///< triangles of one facet lie in one plane and hang together
    };
    /// A ridge or a rim: what may touch otherwise than along a triangle's normal.
    struct SharpEdge {
        std::int32_t tail = 0, head = 0;
        std::array<std::int32_t, 2> triangles{-1, -1};  ///< the second is −1 at a rim
        std::array<Vector3d, 2> inward;                 ///< of its triangles
    };

    /// The mesh has been checked (check_terrain).
    explicit Terrain(const Mesh& mesh);

    [[nodiscard]] const std::vector<Vector3d>& vertices() const { return vertices_; }
    [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
    [[nodiscard]] const std::vector<SharpEdge>& sharp_edges() const { return sharp_edges_; }
    [[nodiscard]] const AlignedBox3d& box() const { return nodes_[0].box; }

    /// Triangles whose boxes meet a box, ascending.
    void near(const AlignedBox3d& box, std::vector<std::int32_t>& triangles) const;

    /// Whether no point of the surface about a vertex lies further along a direction, up to an angle (rad).
    [[nodiscard]] bool is_top(std::int32_t vertex, const Vector3d& direction, double angle) const;

    /// Height of a point above the plane of a triangle.
    [[nodiscard]] double height(const Triangle& triangle, const Vector3d& point) const {
        return triangle.normal.dot(point - vertices_[triangle.corners[0]]);
    }
    /// The point of a triangle that is nearest to a point.
    [[nodiscard]] Vector3d nearest(const Triangle& triangle, const Vector3d& point) const;

private:
    struct Node {
        AlignedBox3d box;
        std::int32_t first = 0, count = 0;  ///< of order_; count 0: the children are first and first + 1
    };
    void find_edges();
    void find_facets(const std::vector<std::array<std::int32_t, 3>>& neighbours);
    void build(std::int32_t node, std::int32_t first, std::int32_t count, const std::vector<AlignedBox3d>& boxes);

    std::vector<Vector3d> vertices_;
    std::vector<Triangle> triangles_;
    std::vector<SharpEdge> sharp_edges_;
    std::vector<std::int32_t> first_neighbour_, neighbour_;  ///< of vertices: those that edges join them to
    std::vector<Node> nodes_;
    std::vector<std::int32_t> order_;
};

}  // namespace delassus::collision
