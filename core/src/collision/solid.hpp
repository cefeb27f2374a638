// SPDX-License-Identifier: BSD-3-Clause
// A shape as collision sees it: a core swept by a sphere. With cores at the signed distance s along n, the swept shapes
// are at s − r_a − r_b along the same n (Minkowski sums with balls, seed section 5), in penetration too.
#pragma once

#include <memory>

#include "collision/polytope.hpp"
#include "collision/terrain.hpp"
#include "delassus/collision.hpp"

namespace delassus::collision {

inline Vector3d vector(const Vector3& v) {
    return {v[0], v[1], v[2]};
}
inline Vector3 array(const Vector3d& v) {
    return {v[0], v[1], v[2]};
}

/// Sides of the prism that starts searches for a cylinder and samples its caps; its last two faces are the caps, top
/// and bottom.
constexpr std::int32_t kPrismSides = 18;

struct Solid {
    ShapeKind kind = ShapeKind::Sphere;
    double radius = 0.0;               ///< of the sweeping sphere, m
    double cylinder_radius = 0.0;      ///< of the core of a cylinder, else 0, m
    double half_length = 0.0;          ///< of the core of a cylinder or capsule, m
    Vector3d half = Vector3d::Zero();  ///< of the box about the origin that holds the core of a box or a hull, m
    Polytope core;  ///< exact but for a cylinder, whose prism here only starts a search; empty for a plane
    std::shared_ptr<const Terrain> terrain;  ///< of a terrain and a height field, which have no core
    double reach = 0.0;                      ///< radius of a ball about the shape's origin that holds core and sweep, m
};

/// Throws InputError for a margin that leaves no core, or a mesh without volume; name is for its message.
[[nodiscard]] Solid make_solid(const Shape& shape, std::int32_t index);

/// Of the body of a shape, as far as it is known.
struct BodyInStep {
    bool known = false;
    Vector3d way = Vector3d::Zero(), turn = Vector3d::Zero();  ///< in the step, m and rad
    Vector3d centre = Vector3d::Zero();                        ///< of mass, from the shape's origin
};

/// A solid in the world. The polytope's vectors are rotated, not moved: pairs are handled relative to a's position, so
/// that being far from the world's origin costs no accuracy.
struct Placed {
    const Solid* solid = nullptr;
    Matrix3d rotation = Matrix3d::Identity();
    Vector3d position = Vector3d::Zero();
    std::vector<Vector3d> vertices, normals, directions;
    bool rotated = false;
    BodyInStep body;

    /// Fills vertices, normals and directions once a detection.
    void rotate_core();
    /// The point of the core furthest along a direction, relative to position, as Polytope::furthest has it. Of a small
    /// polytope after rotate_core().
    [[nodiscard]] Vector3d support(const Vector3d& direction) const;
    [[nodiscard]] Vector3d axis() const { return rotation.col(2); }
    [[nodiscard]] bool is_cylinder() const { return solid->kind == ShapeKind::Cylinder; }
};

/// Half of the extent of a solid along the axes of the frame that it is placed in; not of planes and terrains.
[[nodiscard]] Vector3d half_extent(const Placed& placed);

}  // namespace delassus::collision
