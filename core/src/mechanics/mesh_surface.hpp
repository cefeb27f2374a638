// SPDX-License-Identifier: BSD-3-Clause
// The outer surface of a mesh of tetrahedra that deforms: its triangles, edges and vertices, and which of them are near
// a box.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mechanics/rotation.hpp"
#include "mechanics/solid_element.hpp"

namespace delassus::mechanics {

using Box3d = Eigen::AlignedBox3d;

inline std::size_t to_index(std::int32_t number) {
    return static_cast<std::size_t>(number);
}

/// A point that nodes carry: Σ weights[i] · position of nodes[i]. The weights sum to 1.
struct CarriedPoint {
    std::array<std::int32_t, 6> nodes{};  ///< of the system
    std::array<double, 6> weights{};
    std::size_t count = 0;
};

/// Lengths in m, world frame. Topology and sharpness are made once, from the positions at t = 0; the rest is as of the
/// last place(). A side with quadratic displacements counts as four flat triangles between its nodes where features are
/// told apart, and as the curved side that it is where distances are taken (project()).
class MeshSurface {
public:
    struct Triangle {
        std::array<std::int32_t, 3> corners{};  ///< vertices, counter-clockwise from outside
        std::array<std::int32_t, 3> edges{};    ///< from corner k to k + 1
        std::int32_t side = 0;                  ///< it is a part of
        std::int32_t part = 0;                  ///< of a quadratic side: 0, 1, 2 at its corners, 3 in the middle
        std::int32_t patch = 0;                 ///< triangles of one patch join over edges that are not sharp
        Vector3d normal = Vector3d::Zero();     ///< unit, outward
    };
    struct Edge {
        std::int32_t tail = 0, head = 0;                ///< vertices
        std::array<std::int32_t, 2> triangles{-1, -1};  ///< the second is −1 at a rim
        bool sharp = false;   ///< convex by more than 20° at t = 0, or a rim: crossing ones may touch
        bool convex = false;  ///< now, by more than rounding, or a rim
        bool inner = false;   ///< inside a quadratic side
    };

    /// sides: of nodes of the system, at these positions.
    MeshSurface(std::span<const ElementSide> sides, const std::vector<Vector3d>& position);

    /// x: positions of all nodes of the system; way: how they would move in the step, or empty. Both must outlive the
    /// use of the surface. Finds box() and the longest way; find_normals() is needed for all the rest.
    void place(std::span<const Vector3d> x, std::span<const Vector3d> way);
    /// Normals, which edges are convex, and the boxes that near() searches. Linear in the size of the surface.
    void find_normals();

    [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
    [[nodiscard]] const std::vector<Edge>& edges() const { return edges_; }
    [[nodiscard]] const std::vector<ElementSide>& sides() const { return sides_; }
    [[nodiscard]] const std::vector<std::int32_t>& sharp_edges() const { return sharp_edges_; }
    /// The node of each vertex, ascending.
    [[nodiscard]] const std::vector<std::int32_t>& nodes() const { return nodes_; }
    /// Around all positions on the way.
    [[nodiscard]] const Box3d& box() const { return box_; }
    /// The longest way of a node.
    [[nodiscard]] double longest_way() const { return longest_way_; }
    /// Mean length of the triangles' edges at t = 0.
    [[nodiscard]] double edge_length() const { return edge_length_; }

    /// Of a vertex, after a share of its way.
    [[nodiscard]] Vector3d at(std::int32_t vertex, double share = 0.0) const {
        const auto node = static_cast<std::size_t>(nodes_[static_cast<std::size_t>(vertex)]);
        return share == 0.0 ? x_[node] : Vector3d(x_[node] + share * way_[node]);
    }
    [[nodiscard]] Vector3d way(std::int32_t vertex) const {
        const auto node = static_cast<std::size_t>(nodes_[static_cast<std::size_t>(vertex)]);
        return way_.empty() ? Vector3d::Zero() : way_[node];
    }
    /// Unit, outward: the mean of the triangles about a vertex by their areas.
    [[nodiscard]] const Vector3d& normal(std::int32_t vertex) const {
        return normals_[static_cast<std::size_t>(vertex)];
    }
    [[nodiscard]] Vector3d normal_at(const Triangle& triangle, double share) const;
    /// Unit, in the plane of a triangle, normal to the edge and into the triangle.
    [[nodiscard]] Vector3d inward(const Triangle& triangle, const Edge& edge, double share) const;
    /// Whether no point of the surface about a vertex lies further along a direction, up to an angle (rad).
    [[nodiscard]] bool is_top(std::int32_t vertex, const Vector3d& direction, double angle, double share) const;
    [[nodiscard]] bool has_sharp_edge(std::int32_t vertex) const { return sharp_vertex_[to_index(vertex)] != 0; }
    [[nodiscard]] bool has_convex_edge(std::int32_t vertex) const { return convex_vertex_[to_index(vertex)] != 0; }

    /// Triangles whose boxes (around their way) meet a box, ascending.
    void near(const Box3d& box, std::vector<std::int32_t>& triangles) const;

    [[nodiscard]] CarriedPoint vertex_point(std::int32_t vertex) const;
    /// The point with the barycentric coordinates of a triangle: of a quadratic side by its shape functions.
    [[nodiscard]] CarriedPoint point_of(const Triangle& triangle, const Vector3d& coordinates) const;
    /// On a quadratic side that is curved: the point of it that is nearest to p, begun at a point of the triangle;
    /// normal ← the side's there. On flat sides and linear ones: point_of(), normal as it is.
    [[nodiscard]] CarriedPoint project(const Triangle& triangle, const Vector3d& coordinates, const Vector3d& p,
                                       double share, Vector3d& normal) const;
    /// Where a carried point of this surface is after a share of the way.
    [[nodiscard]] Vector3d place_of(const CarriedPoint& point, double share = 0.0) const;
    [[nodiscard]] Vector3d way_of(const CarriedPoint& point) const;

private:
    struct TreeNode {
        Box3d box;
        std::int32_t first = 0, count = 0;  ///< of order_; count 0: the children are first and first + 1
    };
    void find_edges();
    void find_patches();
    void build(std::int32_t node, std::int32_t first, std::int32_t count, const std::vector<Vector3d>& middles);
    [[nodiscard]] Vector3d side_coordinates(const Triangle& triangle, const Vector3d& coordinates) const;
    [[nodiscard]] CarriedPoint quadratic_point(const ElementSide& side, const Vector3d& coordinates) const;

    std::vector<ElementSide> sides_;
    std::vector<std::int32_t> nodes_;
    std::vector<Triangle> triangles_;
    std::vector<Edge> edges_;
    std::vector<std::int32_t> sharp_edges_;
    std::vector<std::int32_t> first_neighbour_, neighbour_;  // of vertices: those that edges join them to
    std::vector<char> sharp_vertex_, convex_vertex_;
    std::vector<Vector3d> normals_;
    std::vector<TreeNode> tree_;
    std::vector<std::int32_t> order_;
    std::span<const Vector3d> x_, way_;
    Box3d box_;
    double longest_way_ = 0.0, edge_length_ = 0.0;
};

}  // namespace delassus::mechanics
