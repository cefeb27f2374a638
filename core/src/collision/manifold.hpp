// SPDX-License-Identifier: BSD-3-Clause
// Several points between flat faces and parallel edges.
#pragma once

#include "collision/separation.hpp"

namespace delassus::collision {

/// A contact point between cores, relative to the position of a.
using CorePoint = Separation;

/// A point of a core that faces a direction, relative to its position, and the vertex that it is.
struct FacingPoint {
    Vector3d point;
    std::int32_t vertex;
};

/// The most points of a pair; of a pair with a cylinder, whose caps have up to four rim points beside six vertices.
constexpr std::size_t kMostPoints = 8, kMostPointsOfCaps = 10;

class Manifold {
public:
    /// All points between the cores whose distance along the normal is less than limit (m), ordered by feature.
    void between(Placed& a, Placed& b, const Vector3d& offset, const Separation& nearest, double limit,
                 std::vector<CorePoint>& points);
    /// Against the plane through point (relative to other) with that normal.
    void on_plane(Placed& other, const Vector3d& point, const Vector3d& normal, bool plane_is_a, double limit,
                  std::vector<CorePoint>& points);
    /// The corners of the face, edge or vertex of a core that faces a direction most; the core has been rotated.
    void facing(const Placed& placed, const Vector3d& direction, std::vector<FacingPoint>& points);

private:
    /// A corner and the edge that leaves it.
    struct Corner {
        Vector3d point;
        std::int32_t vertex = -1;       ///< of the incident shape, or −1
        std::int32_t other = -1;        ///< vertex of the reference face where vertex and edge are −1
        std::int32_t edge = -1;         ///< of the incident shape, with cut
        std::int32_t cut = -1;          ///< edge of the reference shape that made this corner
        std::int32_t leaving = -1;      ///< edge of the incident shape
        std::int32_t leaving_cut = -1;  ///< position in the reference loop, where leaving is −1
    };
    static Corner rim_corner(const Vector3d& point, std::int32_t name);
    [[nodiscard]] std::size_t nearest_corner(const Vector3d& point) const;
    void insert_on_arc(const Corner& rim);
    static std::int32_t face_towards(const Placed& placed, const Vector3d& direction);
    /// other: what it touches, to_other (m) from its own position; null: what stands still.
    void incident_polygon(const Placed& placed, const Vector3d& direction, const Placed* other = nullptr,
                          const Vector3d& to_other = Vector3d::Zero());
    void put_leaning_rims(const Placed& cylinder, const Vector3d& direction, const Placed* other,
                          const Vector3d& to_other);
    void clip(const Placed& reference, std::int32_t face, const Vector3d& to_reference, double tolerance);
    bool from_face(const Placed& reference, std::int32_t face, const Placed& incident, const Vector3d& to_incident,
                   bool reference_is_a, double limit, std::vector<CorePoint>& points);
    static bool from_edges(const Placed& a, const Placed& b, const Vector3d& offset, const Separation& nearest,
                           double limit, std::vector<CorePoint>& points);
    void beside_edges(const Placed& a, const Placed& b, const Vector3d& offset, const Separation& nearest, double limit,
                      std::vector<CorePoint>& points);
    [[nodiscard]] static std::uint32_t feature(const Corner& corner, bool incident_is_a);
    static void reduce(std::vector<CorePoint>& points, std::size_t most);

    std::vector<Corner> polygon_, clipped_;
    std::vector<CorePoint> beside_;
};

}  // namespace delassus::collision
