// SPDX-License-Identifier: BSD-3-Clause
// Surfaces of shapes as triangles, for pictures.
#pragma once

#include "delassus/collision.hpp"

namespace delassus {

/// In the frame of the shape's body. A plane becomes a square of edge 2 · plane_size around its frame's origin.
Mesh surface_of(const Shape& shape, double plane_size);

/// point turned and moved into the world.
Vector3 transformed(const Pose& pose, const Vector3& point);

}  // namespace delassus
