// SPDX-License-Identifier: BSD-3-Clause
// The part of a picture of a system that does not change while the system moves. It is stored in trajectory.h5 beside
// the motion.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/collision.hpp"

namespace delassus {

/// The names of ShapeKind's values, in their order.
inline constexpr std::array<std::string_view, 8> shape_names = {"sphere", "box",    "capsule", "cylinder",
                                                                "plane",  "convex", "terrain", "height_field"};

/// Whether a shape of the kind is its mesh.
constexpr bool is_mesh(ShapeKind kind) {
    return kind == ShapeKind::Convex || kind == ShapeKind::Terrain || kind == ShapeKind::HeightField;
}

/// A joint, a spring or a bushing: what holds two bodies together, at a point of each.
struct TrajectoryLink {
    std::string name, kind;              ///< the joint's kind as in scene files, "spring" or "bushing"
    std::array<std::int32_t, 2> bodies;  ///< −1: the world
    std::array<Vector3, 2> points;       ///< in the bodies' frames; of the world in its own, m
};

/// An elastic body of few modes: its nodes follow from a pose and amplitudes in q.
struct TrajectoryModes {
    std::int32_t first_node = 0;
    std::int32_t entry = 0;  ///< first entry in q: mass centre, quaternion w x y z, then an amplitude for each mode
    std::int32_t modes = 0;  ///< their number
    std::vector<Vector3> places;  ///< of its nodes, in its frame, m
    std::vector<double> shapes;   ///< displacements of the nodes for an amplitude of 1, mode after mode
};

struct TrajectoryModel {
    Vector3 gravity{};                ///< m/s²
    std::vector<std::string> bodies;  ///< names
    std::vector<std::int32_t> fixed;  ///< of each body: 1 if it never moves
    std::vector<Shape> shapes;
    std::vector<Vector3> nodes;                        ///< positions at the start, m
    std::vector<std::int32_t> node_entry;              ///< of each node: its first entry in q, −1 if it is fixed
    std::vector<TrajectoryModes> reduced;              ///< whose nodes count as fixed above
    std::vector<std::int32_t> loose;                   ///< nodes that no tetrahedron holds
    std::vector<std::array<std::int32_t, 3>> surface;  ///< of the tetrahedra: triangles of nodes
    std::vector<std::array<std::int32_t, 2>> cables;   ///< their nodes
    std::vector<TrajectoryLink> links;
};

}  // namespace delassus
