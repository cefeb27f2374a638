// SPDX-License-Identifier: BSD-3-Clause
// The timestepper and the coordinates of a system that names none (internal).
#pragma once

#include "delassus/scene.hpp"

namespace delassus::scene {

/// The name that leaves the choice of a timestepper to this.
inline constexpr const char* chosen = "auto";

/// Puts a name in place of `chosen`, with coordinates where the scene names none, and says why in system.method_reason.
/// The system is finished and has all its settings.
void choose_method(SceneSystem& system);

}  // namespace delassus::scene
