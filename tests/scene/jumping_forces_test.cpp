// SPDX-License-Identifier: BSD-3-Clause
// Forces that jump within a step without an impact, in plain scenes without options, at all places of a step: a support
// that ends, a ground of another friction, a motor at its limit that is passed by its wanted speed, a short ramp.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "support/scenes.hpp"

namespace delassus::jumping_forces_test {
namespace {

using tests::Running;

constexpr double g = 9.81;

Running run_of(const std::string& text) {
    Running run(parse_scene(text, "test.yaml"));
    run.finish();
    return run;
}

// A rolling ball that is so fast leaves the table at its edge, v² > g r.
TEST(JumpingForces, ABallRollsOffATable) {
    for (const double step : {1.0 / 60.0, 0.004, 0.0137})
        for (int i = 0; i < 8; ++i) {
            const double v = 1.6 + 0.0171 * i, flight = 0.6 - 0.3 / v;
            SCOPED_TRACE(fmt::format("step {}, {} m/s", step, v));
            auto run = run_of(
                fmt::format("step: {}\nend: 0.6\nmaterials: {{m: {{friction: 0.5}}}}\nbodies:\n"
                            "- {{name: table, fixed: true, position: [-1, 0, -0.2], shapes: [{{box: {{size: [2, 1, "
                            "0.4]}}, material: m}}]}}\n"
                            "- {{name: ball, mass: 1, position: [-0.3, 0, 0.1], velocity: [{}, 0, 0], "
                            "angular_velocity: [0, {}, 0], shapes: [{{sphere: {{radius: 0.1}}, material: m}}]}}\n",
                            step, v, v / 0.1));
            const auto [x, y, z] = run.pose("ball").position;
            EXPECT_NEAR(x, 0.6 * v - 0.3, 2e-4);
            EXPECT_NEAR(z, 0.1 - 0.5 * g * flight * flight, 1e-3);
        }
}

// From a rough tile to a smooth one, and back to one on which it comes to roll.
TEST(JumpingForces, ABallSlidesToOtherGround) {
    const auto position = [](double rough, double smooth, double v, double spin) {
        auto run =
            run_of(fmt::format("step: 0.016666666666666666\nend: 0.6\nmaterials: {{a: {{friction: {}}}, b: {{friction: "
                               "{}}}, c: {{friction: 0.6}}}}\nbodies:\n"
                               "- {{name: first, fixed: true, position: [-1, 0, -0.2], shapes: [{{box: {{size: [2, 1, "
                               "0.4]}}, material: a}}]}}\n"
                               "- {{name: second, fixed: true, position: [2, 0, -0.2], shapes: [{{box: {{size: [4, 1, "
                               "0.4]}}, material: b}}]}}\n"
                               "- {{name: ball, mass: 1, position: [-0.3, 0, 0.1], velocity: [{}, 0, 0], "
                               "angular_velocity: [0, {}, 0], shapes: [{{sphere: {{radius: 0.1}}, material: c}}]}}\n",
                               rough, smooth, v, spin));
        return run.pose("ball").position[0];
    };
    for (int i = 0; i < 8; ++i) {
        const double v = 2.3 + 0.05 * i;
        SCOPED_TRACE(v);
        const double a = 0.6 * g, at = (v - std::sqrt(v * v - 0.6 * a)) / a;
        EXPECT_NEAR(position(0.6, 0.0, v, -60.0), (v - a * at) * (0.6 - at), 2e-3);
        const double b = 0.6 * g, rest = 0.6 - 0.3 / v, rolls = std::min(v / (3.5 * b), rest);
        EXPECT_NEAR(position(0.0, 0.6, v, 0.0), v * rolls - 0.5 * b * rolls * rolls + (v - b * rolls) * (rest - rolls),
                    2e-3);
    }
}

// It speeds up at 5 rad/s² until its speed is the wanted one, then slows down at 5, since that falls faster.
TEST(JumpingForces, AMotorAtItsLimitIsPassedByItsWantedSpeed) {
    for (const double fall : {8.0, 7.3, 11.1}) {
        SCOPED_TRACE(fall);
        auto run = run_of(
            fmt::format("step: 0.016666666666666666\nend: 1\nbodies:\n"
                        "- {{name: wheel, mass: 1, inertia: {{xx: 0.4, yy: 0.4, zz: 0.4}}}}\n"
                        "joints:\n- {{name: hinge, kind: revolute, second: wheel, axis: [0, 0, 1]}}\n"
                        "motors:\n- {{name: motor, joint: hinge, speed: true, force_limit: 2, motion: {{polynomial: "
                        "[6, {}]}}}}\n",
                        -fall));
        const double meets = 6.0 / (5.0 + fall), rest = 1.0 - meets, speed = 5.0 * meets;
        const double angle = 0.5 * speed * meets + speed * rest - 0.5 * 5.0 * rest * rest;
        const auto [w, x, y, z] = run.pose("wheel").orientation;
        EXPECT_NEAR(2.0 * std::atan2(z, w), angle, 4e-3);
    }
}

// A load that rises from 0 to F within less than a step.
TEST(JumpingForces, ARampIsShorterThanAStep) {
    for (const double start : {0.1, 0.107, 0.1142}) {
        SCOPED_TRACE(start);
        auto run = run_of(fmt::format(
            "step: 0.016666666666666666\nend: 0.5\ngravity: [0, 0, 0]\nbodies:\n"
            "- {{name: a, mass: 2, shapes: [{{box: {{size: [0.1, 0.1, 0.1]}}}}]}}\n"
            "loads:\n- {{name: l, body: a, force: [{{ramp: {{to: 20, start: {}, duration: 0.015}}}}, 0, 0]}}\n",
            start));
        // ∫∫ of the quintic ramp over its duration d is d²/7 of its height.
        const double d = 0.015, t = 0.5 - start - d;
        EXPECT_NEAR(run.pose("a").position[0], 10.0 * (d * d / 7.0 + 0.5 * d * t + 0.5 * t * t), 1e-4);
    }
}

// A ball lies on a plate that goes down or up by D in a ramp of duration d. It lets go where the acceleration of the
// plate, D (60 s − 180 s² + 120 s³)/d² at the share s of d, passes −g.
TEST(JumpingForces, APlateLeavesWhatLiesOnIt) {
    for (const auto& [way, d] : {std::pair{-1.0, 0.3}, {0.05, 0.05}, {0.05, 0.01}}) {
        SCOPED_TRACE(fmt::format("{} m in {} s", way, d));
        auto run = run_of(fmt::format(
            "step: 0.016666666666666666\nend: 0.4\nbodies:\n"
            "- {{name: plate, position: [0, 0, -0.1], motion: {{translation: [0, 0, {{ramp: {{to: {}, start: "
            "0.1, duration: {}}}}}]}}, shapes: [{{box: {{size: [2, 2, 0.2]}}}}]}}\n"
            "- {{name: ball, mass: 1, position: [0, 0, 0.1], shapes: [{{sphere: {{radius: 0.1}}}}]}}\n",
            way, d));
        const auto acceleration = [&](double s) {
            return way * (60.0 * s - 180.0 * s * s + 120.0 * s * s * s) / (d * d);
        };
        double held = way < 0.0 ? 0.0 : 0.5, free = way < 0.0 ? 0.2 : 0.75;
        for (int i = 0; i < 60; ++i) (acceleration(0.5 * (held + free)) > -g ? held : free) = 0.5 * (held + free);
        const double s = held, s2 = s * s, flight = 0.3 - s * d;
        const double height = way * s2 * s * (10.0 - 15.0 * s + 6.0 * s2),
                     speed = way / d * s2 * (30.0 - 60.0 * s + 30.0 * s2);
        EXPECT_NEAR(run.pose("ball").position[2], 0.1 + height + speed * flight - 0.5 * g * flight * flight, 1e-3);
    }
}

}  // namespace
}  // namespace delassus::jumping_forces_test
