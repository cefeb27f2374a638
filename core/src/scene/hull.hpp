// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "delassus/collision.hpp"

namespace delassus::scene {

/// The surface of the convex hull of points (m), in triangles; points inside it are dropped. Throws InputError where
/// the points span no volume.
[[nodiscard]] Mesh hull_of_points(const std::vector<Vector3>& points);

}  // namespace delassus::scene
