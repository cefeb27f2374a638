// SPDX-License-Identifier: BSD-3-Clause
// Mass and inertia of homogeneous shapes.
#pragma once

#include <span>

#include "delassus/multibody.hpp"

namespace delassus::scene {

struct MassProperties {
    double volume = 0.0;  ///< m³
    Vector3 centre{};     ///< of mass, in the body's frame, m
    Inertia inertia;      ///< about the centre for density one, in the axes of the body's frame, m⁵
};

/// For the union of the shapes, which are assumed not to overlap. Planes have no volume: InputError for them and for
/// open meshes.
MassProperties mass_properties(std::span<const Shape> shapes);

}  // namespace delassus::scene
