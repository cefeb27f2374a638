// SPDX-License-Identifier: BSD-3-Clause
// Shapes of one solid that lie flush have no edges between them.
//
// Shapes are convex, and what one of them makes of a contact knows of no other: a box that slides from one tile onto
// the next meets the side of the next one, which nothing can touch. Of a solid put together from convex shapes T, U, …
// only what lies on its surface can be touched, as with the triangles of a terrain (terrain_contacts.cpp):
//
//     A point p of T is covered along its outward normal n by U if p ∈ U and n is not in the normal cone of U at p:
//     U goes on along n there. (Inside of U the cone is {0}, on a face it is the face's normal, on an edge the cone of
//     two.) A contact along n acts where the feature of T that n is normal to, a face, an edge or a corner, has a point
//     near p that no neighbour covers.
//
// So nothing is left of the sides where tiles meet, nor of directions that lean over the seam; a ridge keeps the
// directions that are normal to both; the face of a wall acts down to the floor that covers its foot, since above p it
// is open; and so does a step, as far as it is higher than its neighbour by more than the tolerance.
//
// A terrain covers what lies on it, and it is covered along its rims: fields of heights that meet, or a terrain that
// goes on in a box or a plane, have no edge between them. The cone of a rim is that of its triangle's normal and of the
// direction out of the surface.
//
// "Near" is ten tolerances, and twice the depth to which p is buried along the face: a corner that has gone into a wall
// still stands on the floor beside it.
#pragma once

#include <span>

#include "collision/separation.hpp"

namespace delassus::collision {

/// Of the smallest reach among shapes that touch and their neighbours: by how much less than this faces may be out of
/// flush.
constexpr double kFlush = 1e-4;

/// Whether a shape covers what is near it at all: where its faces, caps or plane are flush with those of others. Balls
/// and capsules are flush with nothing.
[[nodiscard]] bool has_flat_faces(const Solid& solid);

/// Whether neighbours cover the contact of a shape at a point of its surface along the outward normal n there (unit).
/// All in the world; neighbours: those that may be near, of which the first 16 near the point count. other: the reach
/// of what touches the shape, m. Cost: a product with each face of each neighbour.
[[nodiscard]] bool is_covered(const Placed& shape, std::span<const Placed* const> neighbours, const Vector3d& point,
                              const Vector3d& n, double other);

}  // namespace delassus::collision
