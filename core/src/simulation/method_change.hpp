// SPDX-License-Identifier: BSD-3-Clause
// Which methods a simulation may step by (internal).
#pragma once

#include <vector>

#include "delassus/simulation.hpp"

namespace delassus {

// Bodies with joints that may touch get joint coordinates, in which trees need no rows. But a long chain that lies on
// something has contacts far from its root, whose way a step in joint coordinates knows badly, as errors of all joints
// between add up: it gains energy, or its steps fail however short they are. In maximal coordinates each body errs by
// itself. So the method of bodies that touch takes over there, from the last state on. It projects positions, and
// refuses what it cannot bring back to the joints, as where a mechanism jams: there nothing else may take over, which
// would pull the joints apart. Whoever names a method keeps it.

/// The method of a scene, and after one in joint coordinates the one in maximal ones that may take its place.
[[nodiscard]] std::vector<SteppingMethod> methods_of(const SceneSystem& system);

}  // namespace delassus
