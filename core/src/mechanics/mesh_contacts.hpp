// SPDX-License-Identifier: BSD-3-Clause
// Contacts between the surfaces of meshes.
#pragma once

#include <utility>

#include "mechanics/mesh_surface.hpp"

namespace delassus::mechanics {

/// Where two meshes touch or could within the step: their surfaces are offset by a radius each.
struct MeshContact {
    enum class Kind : std::uint8_t {
        Vertex,  ///< a is a node
        Side,    ///< one of the two is the middle of a quadratic side; surface_a < surface_b
        Edges    ///< two edges cross; surface_a < surface_b
    };
    Kind kind = Kind::Vertex;
    CarriedPoint a, b;  ///< on the surfaces themselves, without the radii
    std::int32_t surface_a = 0, surface_b = 0;
    Vector3d normal = Vector3d::Zero();      ///< unit, from a to b
    double gap = 0.0;                        ///< normal · (b − a) less both radii, at the beginning of the step, m
    std::array<std::uint64_t, 3> feature{};  ///< with the kind, the same from step to step: below 2²⁴, 2²⁴ and 2¹²
};

/// Finds contacts among a fixed set of surfaces.
class MeshContacts {
public:
    struct Surface {
        MeshSurface surface;
        double radius = 0.0;  ///< m
        std::int32_t material = 0;
        std::int32_t first_edge = 0, first_side = 0;  ///< their numbers among those of all surfaces
    };
    /// What moves a node otherwise than freely: −1 nothing, a number ≥ 0 for each body that carries nodes, −2 for what
    /// nothing moves. Points that the same thing moves do not touch.
    static constexpr std::int32_t free = -1, immovable = -2;

    /// radius: m, of the layer about the surface.
    void add(std::span<const ElementSide> sides, const std::vector<Vector3d>& position, double radius,
             std::int32_t material);
    /// holds: of all nodes of the system.
    void set_holds(std::vector<std::int32_t> holds) { holds_ = std::move(holds); }
    [[nodiscard]] const std::vector<Surface>& surfaces() const { return surfaces_; }

    /// contacts ← those whose gap is below the envelope (m; 0: the sum of both radii), or that the way of the step
    /// brings so near. x: positions of all nodes of the system; way: how they would move in the step if nothing touched
    /// them. First those of vertices, by their nodes, then the others by their surfaces.
    void find(std::span<const Vector3d> x, std::span<const Vector3d> way, double envelope,
              std::vector<MeshContact>& contacts);

private:
    /// A point of a over the surface b.
    struct Candidate {
        CarriedPoint foot;
        Vector3d normal = Vector3d::Zero();  ///< from b to the point
        double gap = 0.0;
        std::int32_t patch = 0;
        std::int32_t foot_vertex = -1;  ///< of b, where the foot is one
    };
    void find_near_pairs(double envelope);
    void touch(std::int32_t a, std::int32_t b, double envelope, std::vector<MeshContact>& contacts);
    void vertices_on_surface(std::int32_t a, std::int32_t b, bool second, std::vector<MeshContact>& contacts);
    void sides_on_surface(std::int32_t a, std::int32_t b, bool second, std::vector<MeshContact>& contacts);
    /// vertex: the point's, or −1.
    void on_triangle(const CarriedPoint& point, const Vector3d& outward, std::int32_t vertex,
                     const MeshSurface::Triangle& triangle);
    [[nodiscard]] double beyond_rim(const MeshSurface::Triangle& triangle, const Vector3d& foot, double share) const;
    void on_edge(std::int32_t vertex, const MeshSurface::Edge& edge);
    void on_vertex(std::int32_t vertex, std::int32_t other, std::int32_t patch);
    /// Whether the vertex of a may be pushed along a direction by a feature of b.
    [[nodiscard]] bool faces(std::int32_t vertex, const Vector3d& normal, bool sharp, double share) const;
    void leave_out_copies();
    void crossing_edges(std::int32_t a, std::int32_t b, std::vector<MeshContact>& contacts);
    void edge_on_edge(std::int32_t a, std::int32_t b, std::int32_t of_a, std::int32_t of_b,
                      std::vector<MeshContact>& contacts);
    [[nodiscard]] bool held_together(const CarriedPoint& a, const CarriedPoint& b) const;
    /// The share of the way after which a gap is in the envelope, or closed; gap(share) gives it and its rate.
    /// Negative: never.
    template <class Gap>
    [[nodiscard]] double meeting(bool over_face, Gap&& gap) const;

    std::vector<Surface> surfaces_;
    std::vector<std::int32_t> holds_;

    // Of the pair that is looked at.
    const MeshSurface *a_ = nullptr, *b_ = nullptr;
    double radii_ = 0.0, envelope_ = 0.0, depth_ = 0.0;
    bool still_ = true;  ///< its features cannot come nearer by more than the envelope
    std::vector<Candidate> candidates_;
    std::vector<std::int32_t> triangles_, near_edges_;
    std::vector<std::int32_t> edge_seen_, vertex_seen_;         // of b: the last point that looked at it
    std::vector<std::pair<std::int32_t, std::int32_t>> met_;    // vertices of the first over those of the second
    std::array<std::vector<std::int32_t>, 2> touching_;         // vertices of each, ascending
    std::array<std::vector<std::int32_t>, 2> on_nodes_;         // those of them that are over vertices of the other
    std::array<std::vector<std::int32_t>, 2> crossed_;          // vertices at which edges cross
    std::vector<std::pair<std::int32_t, std::int32_t>> pairs_;  // of surfaces
    std::vector<std::int32_t> order_;
    std::vector<char> has_normals_;
};

}  // namespace delassus::mechanics
