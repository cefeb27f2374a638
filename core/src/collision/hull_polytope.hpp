// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "collision/polytope.hpp"

namespace delassus::collision {

/// The convex hull of points (m), as delassus::convex_hull has it. Empty without volume.
[[nodiscard]] Polytope hull_polytope(const std::vector<Vector3d>& points);

/// The points of a polytope that are further than distance (m) from all its faces. center: further than distance too.
[[nodiscard]] Polytope shrink(const Polytope& polytope, double distance, const Vector3d& center);

/// The centroid of the volume of a polytope with faces.
[[nodiscard]] Vector3d centroid(const Polytope& polytope);

}  // namespace delassus::collision
