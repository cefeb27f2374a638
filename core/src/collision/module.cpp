// SPDX-License-Identifier: BSD-3-Clause
// What libdelassus_mechanics looks up in the module; see mechanics/collision_loader.hpp.
#include <type_traits>
#include <utility>

#include "collision/detector.hpp"
#include "mechanics/collision_loader.hpp"

extern "C" DELASSUS_API void delassus_collision_make(delassus::CollisionSetup&& setup,
                                                     std::unique_ptr<delassus::CollisionDetector>& detector) {
    detector = std::make_unique<delassus::collision::Detector>(std::move(setup));
}

static_assert(std::is_same_v<decltype(&delassus_collision_make), DelassusCollisionMake>);
