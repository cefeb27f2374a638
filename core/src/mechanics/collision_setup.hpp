// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/collision.hpp"

namespace delassus {

/// Throws InputError for what no detector can be made of; see make_collision_detector.
void check_collision_setup(const CollisionSetup& setup);

}  // namespace delassus
