// SPDX-License-Identifier: BSD-3-Clause
// Velocities that a scene gives to bodies which joints hold.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

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

// The velocities of arm and hand do not fit the hinges, and the hand has a rate: what comes of them does not depend on
// the order of the scene, nor on which of two equal joints the tree of joints takes.
TEST(StartVelocities, DoNotDependOnTheOrderOfTheScene) {
    const std::array<std::string, 3> bodies = {
        "- {name: base, mass: 3, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [0, 0, 0.2], velocity: [1, 2, 3]}\n",
        "- {name: arm, mass: 1, inertia: {xx: 0.02, yy: 0.03, zz: 0.01}, position: [0.3, 0, 0.5], velocity: [-0.9, "
        "0.8, "
        "-0.2], angular_velocity: [0.3, 1.1, -0.7]}\n",
        "- {name: hand, mass: 0.4, inertia: {xx: 0.004, yy: 0.003, zz: 0.002}, position: [0.6, 0.1, 0.8], velocity: "
        "[-0.8, -0.4, 0.1]}\n"};
    const std::array<std::string, 4> joints = {
        "- {name: foot, kind: revolute, second: base, point: [0, 0, 0], axis: [0, 0, 1]}\n",
        "- {name: shoulder, kind: spherical, first: base, second: arm, point: [0, 0, 0.4]}\n",
        "- {name: wrist, kind: prismatic, first: arm, second: hand, point: [0.5, 0, 0.7], axis: [1, 2, 0.5], "
        "start_rate: 0.27}\n",
        "- {name: wrist_again, kind: prismatic, first: hand, second: arm, point: [0.5, 0, 0.7], axis: [-1, -2, -0.5], "
        "spring: {stiffness: 40}}\n"};
    const auto start = [&](const std::array<int, 3>& order, const std::array<int, 4>& of_joints) {
        std::string text = "step: 0.005\nend: 0.05\nbodies:\n";
        for (const int k : order) text += bodies[static_cast<std::size_t>(k)];
        text += "joints:\n";
        for (const int k : of_joints) text += joints[static_cast<std::size_t>(k)];
        const Running run(parse_scene(text, "s"));
        EXPECT_FALSE(run.simulation.warnings().empty()) << "what was given has changed";
        std::vector<double> result;
        for (const char* name : {"base", "arm", "hand"})
            for (const Vector3& of : run.velocities(name)) result.insert(result.end(), of.begin(), of.end());
        return result;
    };
    const std::vector<double> expected = start({0, 1, 2}, {0, 1, 2, 3});
    for (const auto& other : {start({2, 1, 0}, {3, 2, 1, 0}), start({1, 2, 0}, {1, 3, 0, 2})})
        for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(other[i], expected[i], 1e-9) << i;
}

TEST(StartVelocities, OfWhatFloatsTheSecondBodyMovesByAStart) {
    const std::string lower =
                          "- {name: lower, mass: 50, inertia: {xx: 1, yy: 1.4, zz: 0.8}, position: [0.1, 0, 0.5]}\n",
                      upper =
                          "- {name: upper, mass: 50, inertia: {xx: 1.3, yy: 1.8, zz: 1.4}, position: [0, 0, 1.6]}\n";
    for (const std::string& bodies : {lower + upper, upper + lower}) {
        const Running run(
            parse_scene("step: 0.005\nend: 0.05\nbodies:\n" + bodies +
                            "joints:\n- {name: hinge, kind: revolute, first: upper, second: lower, point: "
                            "[0.1, -0.5, 0.5], axis: [1, 0, 0], start_rate: 0.7}\n",
                        "s"));
        EXPECT_NEAR(run.velocities("lower")[1][0], 0.7, 1e-12);
        EXPECT_NEAR(run.velocities("lower")[0][2], 0.35, 1e-12);
        EXPECT_NEAR(run.velocities("upper")[1][0], 0.0, 1e-12);
    }
}

}  // namespace
}  // namespace delassus::start_velocities_test
