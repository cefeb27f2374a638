// SPDX-License-Identifier: BSD-3-Clause
// Contacts of convex solids with a terrain.
#pragma once

#include "collision/manifold.hpp"
#include "collision/terrain.hpp"

namespace delassus::collision {

class TerrainContacts {
public:
    /// Appends the points of the pair nearer than envelope (m); shape_a and shape_b are left to the caller.
    void collide(const Placed& terrain, const Placed& shape, bool terrain_is_a, double envelope,
                 std::vector<ContactPoint>& contacts);

private:
    /// Lengths in the terrain's frame. Points on the cores, the normal from the terrain to the shape.
    struct Point {
        double distance = 0.0;
        Vector3d normal, on_terrain, on_shape;
        std::int32_t vertex = -1;   ///< of the shape's core, or −1 at a sharp edge
        std::int32_t place = 0;     ///< the facet; of a sharp edge its number
        std::uint32_t feature = 0;  ///< at a sharp edge: of the edge and the shape, by Manifold
    };
    /// points_ from the triangles near a box.
    void find(const Terrain& surface, const AlignedBox3d& box, double limit, double depth);
    void on_triangle(const Terrain& surface, const Terrain::Triangle& triangle, double limit, double depth);
    /// Whether a point below a triangle by depth is nearer to a part of the surface that lies below its plane.
    [[nodiscard]] bool belongs_elsewhere(const Terrain& surface, const Terrain::Triangle& triangle,
                                         const Vector3d& point, double depth) const;
    void on_edge(const Terrain& surface, std::int32_t edge, double limit, double depth);
    void put_edge_point(std::int32_t number, const Separation& point, const Vector3d& origin, std::uint32_t feature);
    void leave_out_copies();
    void name_features(bool terrain_is_a);

    Manifold manifold_;
    Placed local_, segment_;
    Solid segment_solid_;
    std::vector<std::int32_t> triangles_, edges_;
    std::vector<FacingPoint> facing_;
    std::vector<CorePoint> core_points_;
    std::vector<Point> points_, kept_;
};

}  // namespace delassus::collision
