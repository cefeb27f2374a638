// SPDX-License-Identifier: BSD-3-Clause
// The bodies of a random scene.
#pragma once

#include "relations/draw.hpp"
#include "relations/scene_document.hpp"

namespace delassus::relations {

/// One to three materials; most scenes have friction, a third has restitution.
void add_materials(Draw& draw, Json& scene);
/// None, a plane, a box, a height field, or a plate that moves; the top is at z = 0, about the origin.
void add_ground(Draw& draw, Json& scene);
/// Columns of bodies that rest, or fall from a small height, on the ground or on one another; columns may stand flush.
void add_stacks(Draw& draw, Json& scene, int count);
/// Bodies in cells of a grid, some of them fixed or kinematic; now and then two overlap. Without `shapes` they have
/// mass alone.
void add_loose_bodies(Draw& draw, Json& scene, int count, bool shapes);

}  // namespace delassus::relations
