// SPDX-License-Identifier: BSD-3-Clause
// Collision through the module delassus_collision, which the first scene with shapes loads. So FCL is mapped only into
// processes that look for contacts.
#pragma once

#include <memory>

#include "delassus/collision.hpp"

// The module is built together with libdelassus_mechanics, so C++ types may cross here.
extern "C" {
using DelassusCollisionMake = void (*)(delassus::CollisionSetup&& setup,
                                       std::unique_ptr<delassus::CollisionDetector>& detector);
}
