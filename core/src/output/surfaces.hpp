// SPDX-License-Identifier: BSD-3-Clause
// Surfaces of shapes as triangles, for pictures.
#pragma once

#include <span>

#include "delassus/collision.hpp"

namespace delassus {

/// How many corners the circles of round shapes get: 24, and fewer, down to 8, where there are so many round shapes
/// that they would have more than some 50 000 triangles.
[[nodiscard]] int corners_of_circles(std::span<const Shape> shapes);

/// In the frame of the shape's body. A plane becomes a square of edge 2 · plane_size around its frame's origin.
/// corners: of circles, a multiple of 4.
[[nodiscard]] Mesh surface_of(const Shape& shape, double plane_size, int corners);

/// point turned and moved into the world.
Vector3 transformed(const Pose& pose, const Vector3& point);

}  // namespace delassus
