// SPDX-License-Identifier: BSD-3-Clause
// Velocities that a scene gives to bodies which joints hold.
#include <gtest/gtest.h>

#include <cmath>

#include "support/scenes.hpp"

namespace delassus::start_velocities_test {
namespace {

using tests::Running;

TEST(StartVelocities, WhatIsLockedStandsWhateverItsVelocity) {
    Running run(
        parse_scene("step: 0.005\nend: 0.05\nbodies:\n"
                    "- {name: b, mass: 1, inertia: {xx: 0.1, yy: 0.2, zz: 0.15}, position: [0.3, 0.1, 0.7], "
                    "orientation: {axis: [1, 2, "
                    "3], angle: 33}, velocity: [1.3, 0.7, 0.2], angular_velocity: [0.3, 1.7, -0.9]}\n"
                    "joints:\n"
                    "- {name: j0, kind: revolute, second: b, point: [0.1, 0.23, 0.31], axis: [0, 1, 0]}\n"
                    "- {name: j1, kind: revolute, second: b, point: [0.4, 0.11, 0.37], axis: [1, 0.3, 0]}\n",
                    "s"));
    EXPECT_FALSE(run.simulation.warnings().empty()) << "its velocity is lost";
    run.finish();
    EXPECT_NEAR(run.pose("b").position[0], 0.3, 1e-9);
}

// Velocities that are not given follow those that are.
TEST(StartVelocities, ADoorTurnsAsFastAsItsAngularVelocitySays) {
    Running run(parse_scene(
        "step: 0.001\nend: 1\ngravity: [0, 0, 0]\nbodies:\n"
        "- {name: door, mass: 20, inertia: {xx: 6.7, yy: 8.4, zz: 1.7}, position: [0.5, 0.2, 1], angular_velocity: "
        "[0, 0, 0.7]}\n"
        "- {name: handle, mass: 0.3, inertia: {xx: 0.001, yy: 0.001, zz: 0.001}, position: [0.9, 0.3, 1]}\n"
        "joints:\n"
        "- {name: lower, kind: revolute, second: door, point: [0, 0, 0.2], axis: [0, 0, 1]}\n"
        "- {name: upper, kind: revolute, second: door, point: [0, 0, 1.8], axis: [0, 0, 1]}\n"
        "- {name: fixing, kind: fixed, first: door, second: handle, point: [0.9, 0.3, 1]}\n",
        "s"));
    EXPECT_TRUE(run.simulation.warnings().empty());
    run.finish();
    const auto q = run.pose("door").orientation;
    EXPECT_NEAR(2.0 * std::atan2(q[3], q[0]), 0.7, 1e-9);
    const auto turned = run.pose("handle").orientation;
    EXPECT_NEAR(2.0 * std::atan2(turned[3], turned[0]), 0.7, 1e-9);
}

}  // namespace
}  // namespace delassus::start_velocities_test
