// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "relations/scene_document.hpp"

namespace delassus::relations {

/// A random scene that the reader takes; whether its motion exists is another question: joints may repeat or contradict
/// one another, bodies may overlap where they start. Bodies of all shapes, fixed, kinematic and moving; grounds of
/// planes, boxes, terrain and moving plates; stacks, rows and loose bodies; joints of all kinds with stops, springs,
/// friction and dampers; gears, motors, servos, springs, bushings, loads; materials with friction and restitution.
///
/// Of three kinds, by chance: bodies that touch, mechanisms without shapes, mechanisms that touch. The integrator is
/// the default. Every key that a transformation needs is written, even where it has its default. SI units, lengths of
/// about 0.1 to 1 m, some 30 to 80 steps. The same for a seed and a counter everywhere.
[[nodiscard]] Json random_scene(std::uint64_t seed, std::uint64_t counter);

}  // namespace delassus::relations
