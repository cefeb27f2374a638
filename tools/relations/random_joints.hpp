// SPDX-License-Identifier: BSD-3-Clause
// The joints of a random scene, and what drives and pulls its bodies.
#pragma once

#include "relations/draw.hpp"
#include "relations/scene_document.hpp"

namespace delassus::relations {

/// The moving bodies, hung one on the other by hinges, balls and slides; the first one on the world.
void add_chain(Draw& draw, Json& scene);
/// Joints of any kind between any bodies. Many are on the line of an earlier one, between the same bodies: they repeat
/// it, or contradict it.
void add_joints(Draw& draw, Json& scene, int count);
/// A gear, motors and servos of the hinges and slides that are there.
void add_drives(Draw& draw, Json& scene);
/// Springs, bushings and loads.
void add_forces(Draw& draw, Json& scene);

}  // namespace delassus::relations
