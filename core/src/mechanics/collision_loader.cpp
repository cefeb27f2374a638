// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/collision_loader.hpp"

#include <utility>

#include "mechanics/collision_setup.hpp"
#include "support/module.hpp"

namespace delassus {

CollisionDetector::~CollisionDetector() = default;

std::unique_ptr<CollisionDetector> make_collision_detector(CollisionSetup setup) {
    check_collision_setup(setup);
    const auto make = reinterpret_cast<DelassusCollisionMake>(
        module_symbol("delassus_collision", "delassus_collision_make", "shapes cannot collide", "FCL",
                      "; leave the shapes out of the scene"));
    std::unique_ptr<CollisionDetector> detector;
    make(std::move(setup), detector);
    return detector;
}

}  // namespace delassus
