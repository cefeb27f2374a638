// SPDX-License-Identifier: BSD-3-Clause
// Plain scenes of bodies that touch, without options, whose motion is known.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/scenes.hpp"

namespace delassus::plain_motion_test {
namespace {

using tests::Running;

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

// Steady rolling with the mass centre at rest (Euler's disc). Lengths are three times those of a disc of 5 cm that
// turns at 48.4858 rad/s about the vertical, so that speeds are those over √3.
TEST(PlainMotion, ADiscThatRollsKeepsItsTilt) {
    const double tilt = 20.0 * std::acos(-1.0) / 180.0, scale = 3.0;
    auto run = run_of(fmt::format(
        "step: 0.0021\nend: 3\nmaterials: {{m: {{friction: 0.8}}}}\nbodies:\n"
        "- {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
        "- {{name: disc, mass: 0.7, position: [1, -2, {}], orientation: {{axis: [0, 1, 0], angle: 20}}, "
        "angular_velocity: [{}, 0, {}], shapes: [{{cylinder: {{radius: 0.15, length: 0.03}}, material: m}}]}}\n",
        scale * 0.02179947027021298, -16.58310824355091 / std::sqrt(scale), 1.658310824355091 / std::sqrt(scale)));
    run.finish();
    const auto [w, x, y, z] = run.pose("disc").orientation;
    EXPECT_NEAR(std::acos(1.0 - 2.0 * (x * x + y * y)), tilt, 0.01);
}

TEST(PlainMotion, UnbalancedBallsKeepTheirEnergy) {
    auto run = run_of(
        "step: 0.0017\nend: 6\nmaterials: {m: {friction: 1}}\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "- {name: ball, mass: 1.3, inertia: {xx: 0.0052, yy: 0.0052, zz: 0.0052}, position: [0.03, 0.04, 0.1], "
        "shapes: [{sphere: {radius: 0.1}, position: [-0.03, -0.04, 0], material: m}]}\n");
    run.simulation.step();
    const double start = run.simulation.record().energy, moves = 1.3 * 9.81 * 0.05;
    run.finish();
    EXPECT_NEAR(run.simulation.record().energy, start, 1e-3 * moves);
}

TEST(PlainMotion, ABallBouncesByItsRestitution) {
    auto run = run_of(
        "step: 0.02\nend: 2.2\nmaterials: {m: {restitution: 0.7}}\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "- {name: ball, mass: 3, position: [0, 0, 0.85], shapes: [{sphere: {radius: 0.05}, material: m}]}\n");
    std::vector<double> heights = {run.pose("ball").position[2] - 0.05}, peaks;
    while (!run.simulation.finished()) {
        run.simulation.step();
        heights.push_back(run.pose("ball").position[2] - 0.05);
    }
    for (std::size_t k = 1; k + 1 < heights.size(); ++k)
        if (heights[k] > heights[k - 1] && heights[k] >= heights[k + 1]) peaks.push_back(heights[k]);
    ASSERT_GE(peaks.size(), 2U);
    EXPECT_NEAR(peaks[0], 0.8 * 0.49, 0.03 * 0.8 * 0.49);
    EXPECT_NEAR(peaks[1], 0.8 * 0.49 * 0.49, 0.04 * 0.8 * 0.49 * 0.49);
}

// What passes an edge is not held off by the half-space of the nearest points.
TEST(PlainMotion, WhatFliesPastAnEdgeGoesOnStraight) {
    for (const char* shape : {"sphere: {radius: 0.1}", "box: {size: [0.2, 0.2, 0.3]}",
                              "capsule: {radius: 0.1, length: 0.2}", "cylinder: {radius: 0.1, length: 0.3}"})
        for (const double gap : {1e-3, 1e-4})
            for (const auto& [speed, step] : {std::pair(2.0, 0.01), std::pair(7.3, 0.0013), std::pair(0.9, 0.0071)}) {
                SCOPED_TRACE(fmt::format("{}, {} m, {} m/s, {} s", shape, gap, speed, step));
                auto run = run_of(fmt::format(
                    "gravity: [0, 0, 0]\nstep: {}\nend: {}\nmaterials: {{m: {{friction: 0.3}}}}\nbodies:\n"
                    "- {{name: block, fixed: true, position: [1, 0, -0.5], shapes: [{{box: {{size: [2, 2, 1]}}, "
                    "material: m}}]}}\n"
                    "- {{name: flyer, mass: 1, position: [-0.53071, 0.0123, {}], velocity: [{}, 0, 0], shapes: "
                    "[{{{}, orientation: {{axis: [0, 1, 0], angle: 90}}, material: m}}]}}\n",
                    step, 1.2 / speed, 0.1 + gap, speed, shape));
                run.finish();
                const auto [v, omega] = run.velocities("flyer");
                EXPECT_NEAR(v[0], speed, 1e-9);
                EXPECT_NEAR(std::hypot(v[1], v[2]), 0.0, 1e-9);
                EXPECT_NEAR(std::hypot(omega[0], omega[1], omega[2]), 0.0, 1e-9);
            }
}

// What meets the edge is held off all the same.
TEST(PlainMotion, WhatFliesIntoAnEdgeDoesNotGoThrough) {
    for (const char* shape : {"sphere: {radius: 0.1}", "box: {size: [0.3, 0.2, 0.2]}"})
        for (const double overlap : {1e-3, 0.05}) {
            SCOPED_TRACE(fmt::format("{}, {} m", shape, overlap));
            auto run = run_of(fmt::format(
                "gravity: [0, 0, 0]\nstep: 0.0043\nend: 0.6\nbodies:\n"
                "- {{name: block, fixed: true, position: [1, 0, -0.5], shapes: [{{box: {{size: [2, 2, 1]}}}}]}}\n"
                "- {{name: flyer, mass: 1, position: [-0.53071, 0.0123, {}], velocity: [2, 0, 0], shapes: [{{{}}}]}}\n",
                0.1 - overlap, shape));
            double deepest = 0.0;
            while (!run.simulation.finished()) deepest = std::max(deepest, run.simulation.step().penetration);
            EXPECT_LT(deepest, 1e-3 * 0.2);
            EXPECT_LT(run.velocities("flyer")[0][0], 2.0 - 1e-6);
        }
}

}  // namespace
}  // namespace delassus::plain_motion_test
