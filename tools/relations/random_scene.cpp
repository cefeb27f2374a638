// SPDX-License-Identifier: BSD-3-Clause
#include "relations/random_scene.hpp"

#include <fmt/format.h>

#include "relations/random_bodies.hpp"
#include "relations/random_joints.hpp"

namespace delassus::relations {

Json random_scene(std::uint64_t seed, std::uint64_t counter) {
    Draw draw(seed, counter);
    Json scene = Json::object();
    scene["title"] = fmt::format("random scene {} of seed {}", counter, seed);
    const double step = draw.one_of({0.016, 0.01, 0.005, 0.005, 0.002, 0.001});
    scene["step"] = step;
    scene["end"] = Draw::rounded(step * draw.whole(30, 80));
    Point gravity = {0.0, 0.0, -9.81};
    if (draw.chance(0.1)) gravity = {0.0, 0.0, 0.0};
    if (draw.chance(0.2)) gravity = draw.vector(9.81);
    scene["gravity"] = gravity;
    // What a solver leaves of a step's problem is as large as the step is worth. Half of the scenes have it small.
    if (draw.chance(0.5)) scene["solver"] = {{"tolerance", 1e-9}};

    const double kind = draw.share();
    const bool shapes = kind < 0.7, joints = kind >= 0.4;
    add_materials(draw, scene);
    scene["bodies"] = Json::array();
    if (shapes) add_ground(draw, scene);
    const int count = shapes && !joints ? draw.whole(1, 6) : draw.whole(1, 5);
    if (shapes && draw.chance(joints ? 0.4 : 0.7)) {
        add_stacks(draw, scene, count);
    } else {
        add_loose_bodies(draw, scene, count, shapes);
    }
    if (joints) {
        if (draw.chance(0.4)) add_chain(draw, scene);
        add_joints(draw, scene, draw.whole(1, count + 1));
        add_drives(draw, scene);
    }
    add_forces(draw, scene);
    if (scene["materials"].empty()) scene.erase("materials");
    return scene;
}

}  // namespace delassus::relations
