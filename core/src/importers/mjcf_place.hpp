// SPDX-License-Identifier: BSD-3-Clause
// Where the bodies of an MJCF model are, and how they move.
#pragma once

#include "importers/mjcf_spec.hpp"

namespace delassus::importers::mjcf {

struct Placed {
    Frame frame = Frame::Identity();               ///< of the body, in the world
    Vector3d velocity = Vector3d::Zero();          ///< of its origin, m/s
    Vector3d angular_velocity = Vector3d::Zero();  ///< in the world, rad/s
};

/// Bodies where hinges and slides are at their reference. key: free bodies, balls and mocap bodies are where it has
/// them and move as it says; null: all are at their reference, at rest.
[[nodiscard]] std::vector<Placed> place(const Spec& spec, const Key* key);

/// The diagonal of the mass matrix where all is at its reference, kg or kg m², with armatures.
[[nodiscard]] std::vector<double> inertias_at_reference(const Spec& spec);

}  // namespace delassus::importers::mjcf
