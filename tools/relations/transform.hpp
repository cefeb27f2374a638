// SPDX-License-Identifier: BSD-3-Clause
// The same motion, described otherwise.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "relations/scene_document.hpp"

namespace delassus::relations {

/// Of the whole scene, gravity with it: x → turn x + shift.
struct Placement {
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// How many new units an old one is.
struct Units {
    double length = 1.0, mass = 1.0, time = 1.0;
};

/// Whether its lists are those that the functions here know: list_keys.
[[nodiscard]] bool is_known(const Json& scene);
/// Whether the three components of each given motion and load have one form, so that turned ones have it too, and no
/// bushing has the axes of the world.
[[nodiscard]] bool can_be_placed(const Json& scene);
/// Of a scene that can be placed.
[[nodiscard]] Json placed(const Json& scene, const Placement& placement);
/// Whether it can be placed, has no height field, whose cells have their diagonals in one direction, and no joint has
/// coordinates along and about an axis with different springs.
[[nodiscard]] bool can_be_mirrored(const Json& scene);
/// Of a scene that can be mirrored: at the plane x = 0.
[[nodiscard]] Json mirrored(const Json& scene);
[[nodiscard]] Json in_units(const Json& scene, const Units& units);
/// Its lists shuffled, but for material pairs; the order of a seed.
[[nodiscard]] Json reordered(const Json& scene, std::uint64_t seed);
/// The starts of its moving bodies moved, each at random by up to `length` (m), turned by up to `angle`, and made
/// faster by up to `speed` (m/s) and `rate` (rad/s).
[[nodiscard]] Json disturbed(const Json& scene, double length, double speed, double angle, double rate,
                             std::uint64_t seed);

/// Of a moving body: mass (kg) and moments about its mass centre in its frame (kg m²).
struct MassOf {
    double mass = 0.0;
    std::array<double, 6> inertia{};  ///< xx, yy, zz, xy, xz, yz
};

/// The body of that name as two with half its mass and inertia each, at the same place and welded together; the first
/// keeps the shapes and whatever holds it.
[[nodiscard]] Json cut(const Json& scene, const std::string& name, const MassOf& mass);

}  // namespace delassus::relations
