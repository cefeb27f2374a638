// SPDX-License-Identifier: BSD-3-Clause
// Shapes and where they touch. The first scene with shapes loads a module that finds near pairs by a maintained library
// (FCL's dynamic tree, double precision) and computes their gaps in closed form, exact to rounding.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "delassus/contact_point.hpp"
#include "delassus/export.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus {

/// Unit quaternion (w, x, y, z): the rotation from the body frame to the world frame.
using Quaternion = std::array<double, 4>;

/// A position (m) and a unit quaternion w x y z.
struct Pose {
    Vector3 position{0.0, 0.0, 0.0};
    Quaternion orientation{1.0, 0.0, 0.0, 0.0};
};

/// A surface of triangles, in the shape's own frame, m. That of a convex shape is closed, and collision takes its hull;
/// that of a terrain may be open, and collides as it is.
struct Mesh {
    std::vector<Vector3> vertices;
    std::vector<std::array<std::int32_t, 3>> triangles;  ///< counter-clockwise from outside, or from above
};

enum class ShapeKind {
    Sphere,      ///< size = (radius, -, -)
    Box,         ///< size = half of the edges
    Capsule,     ///< along z; size = (radius, half length of the straight part, -)
    Cylinder,    ///< along z; size = (radius, half length, -)
    Plane,       ///< the half space z ≤ 0; size unused; of fixed bodies only
    Convex,      ///< mesh
    Terrain,     ///< mesh; of fixed bodies only. Pushes out what is behind it by less than that shape's own reach
    HeightField  ///< mesh, the graph of z over x and y; of fixed bodies only. Solid all the way down
};

/// A shape on a body.
struct Shape {
    ShapeKind kind = ShapeKind::Sphere;
    Vector3 size{0.0, 0.0, 0.0};       ///< m
    std::shared_ptr<const Mesh> mesh;  ///< Convex, Terrain and HeightField only
    Pose pose;                         ///< of the shape in the frame of its body
    std::int32_t body = -1;            ///< index of its body, −1 for the world
    double margin = 0.0;  ///< m, the sphere-swept margin ε_m of seed section 5: the solid is the shape shrunk by
                          ///< it and swept by a sphere of this radius, so that gaps are smooth near edges
};

/// How a body would move in the coming step if nothing touched it, in the axes of the world.
struct BodyDisplacement {
    Vector3 translation{};  ///< of the origin of its pose, m
    Vector3 rotation{};     ///< rotation vector about that origin, rad
    Vector3 fall{};         ///< what its weight adds to the translation over the step, m
};

/// Finds contacts among a fixed set of shapes that move with their bodies.
class DELASSUS_API CollisionDetector {
public:
    virtual ~CollisionDetector();

    /// All points nearer than envelope (m, ε_e of seed section 5), for shapes of different bodies that are not
    /// excluded, at least one of them not fixed. Ordered by (shape_a, shape_b, feature): equal inputs give equal
    /// outputs, bit for bit. poses: of the bodies by index. Pairs of flat faces give up to four points or more, edges
    /// two, the rest one. What neighbours of one solid cover of a shape has none (docs/mechanics.md).
    /// team: threads that share the work where there is enough of it.
    /// displacements: of the bodies by index, or none. Shapes that could meet on their way are found too, farther away
    /// than the envelope: their points are where they would meet, the normal is that of the meeting, and the gap is
    /// what the points have to go along it (docs/mechanics.md).
    virtual void detect(std::span<const Pose> poses, double envelope, std::vector<ContactPoint>& contacts,
                        const sdk::Team& team = {}, std::span<const BodyDisplacement> displacements = {}) = 0;

    /// Appends the points of two shapes alone, nearer than envelope, whose bodies have these poses (the world: Pose{}),
    /// while all others are where the last detection had them.
    virtual void detect_pair(std::int32_t shape_a, std::int32_t shape_b, const Pose& pose_a, const Pose& pose_b,
                             double envelope, std::vector<ContactPoint>& contacts) = 0;
};

/// What a detector is made of.
struct CollisionSetup {
    std::vector<Shape> shapes;
    std::vector<bool> fixed;                                   ///< of bodies: whether it never moves
    std::vector<std::pair<std::int32_t, std::int32_t>> apart;  ///< pairs of bodies that never touch (joined ones)
    /// Of bodies: those of one group, a number from 0 on, never touch one another (the nodes of a mesh); −1: no group.
    /// Empty: no groups at all.
    std::vector<std::int32_t> group{};
    /// Of bodies: those of one number ≥ 0 are one solid, which has no edges where their shapes lie flush. They do not
    /// move against one another, but for those of number 0, the world's: all whose place is given, fixed or not. −1: a
    /// solid by itself. Empty: the fixed ones are of the world's, the others by themselves.
    std::vector<std::int32_t> solid{};
    /// Of shapes: within which distance others are near, m. A pair takes the lesser of the two, or the envelope if that
    /// is less. Empty: the envelope.
    std::vector<double> near{};
    /// Of shapes: a number, pairs of which never touch as `passing` says, the lesser first. Empty: all touch.
    std::vector<std::int32_t> material{};
    std::vector<std::pair<std::int32_t, std::int32_t>> passing{};
    /// Of bodies, for messages. Beyond its end they have their numbers.
    std::vector<std::string> names{};

    /// "name" or the number of a body.
    [[nodiscard]] DELASSUS_API std::string name_of(std::int32_t body) const;
};

/// Loads the collision module and makes a detector. Throws InputError where this build has no FCL, for sizes that are
/// not positive and finite, a margin that leaves no core (a mesh's should be less than the distance of the centroid of
/// its hull from the nearest face), a plane on a moving body, a mesh that is open, inside out or without volume.
[[nodiscard]] DELASSUS_API std::unique_ptr<CollisionDetector> make_collision_detector(CollisionSetup setup);

}  // namespace delassus
