// SPDX-License-Identifier: BSD-3-Clause
// Impacts in plain scenes, without options, whose motion is known: times, directions and speeds do not depend on where
// in a step bodies meet.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "support/scenes.hpp"

namespace delassus::impact_motion_test {
namespace {

using tests::Running;

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

// Shapes that land on several points at once, on a floor that is turned: the second peak is e⁴ of the height.
TEST(ImpactMotion, WhatLandsFlatReachesTheHeightOfItsRestitution) {
    const double e = 0.65, height = 0.9, g = 9.81, up = std::sqrt(2.0 * height / g);
    struct Case {
        const char* shape;
        double half;
    };
    for (const auto& [shape, half] :
         {Case{"box: {size: [0.3, 0.2, 0.1]}", 0.05}, Case{"cylinder: {radius: 0.2, length: 0.3}", 0.15},
          Case{"capsule: {radius: 0.1, length: 0.3}, orientation: {axis: [0, 1, 0], angle: 90}", 0.1}})
        for (const double step : {0.01, 1.0 / 240.0}) {
            SCOPED_TRACE(fmt::format("{} {}", shape, step));
            auto run = run_of(fmt::format(
                "step: {:.17g}\nend: {:.17g}\ngravity: [{:.17g}, 0, {:.17g}]\nmaterials: {{m: {{friction: 0.3, "
                "restitution: {}}}}}\nbodies:\n"
                "- {{name: floor, fixed: true, orientation: {{axis: [0, 1, 0], angle: 30}}, shapes: [{{plane: {{}}, "
                "material: m}}]}}\n"
                "- {{name: body, mass: 1.5, position: [{:.17g}, 0, {:.17g}], orientation: {{axis: [0, 1, 0], angle: "
                "30}}, shapes: [{{{}, material: m}}]}}\n",
                step, up * (1.0 + 2.0 * e + e * e), -0.5 * g, -g * std::sqrt(0.75), e, 0.5 * (height + half),
                std::sqrt(0.75) * (height + half), shape));
            run.finish();
            const auto& at = run.pose("body").position;
            EXPECT_NEAR(0.5 * at[0] + std::sqrt(0.75) * at[2] - half, std::pow(e, 4) * height, 1e-8);
            EXPECT_NEAR(std::sqrt(0.75) * at[0] - 0.5 * at[2], 0.0, 1e-8);
        }
}

// A ball meets another one off its middle, without friction: the impulse is along the line of centres then.
TEST(ImpactMotion, BallsPartAlongTheLineOfTheirCentresAtTheMeeting) {
    const double e = 0.9, radius = 0.1, aside = 0.12, way = 0.5, speed = 2.3, first = 3.0, second = 1.2;
    const double ahead = std::sqrt(4.0 * radius * radius - aside * aside), end = 2.5 * way / speed;
    const std::array<double, 2> n{ahead / (2.0 * radius), -aside / (2.0 * radius)};
    const double impulse = (1.0 + e) * speed * n[0] / (1.0 / first + 1.0 / second), left = end - way / speed;
    std::array<double, 2> off{};
    for (std::size_t k = 0; k < 2; ++k) {
        const double step = k == 0 ? 0.004 : 0.002;
        auto run = run_of(fmt::format(
            "step: {}\nend: {:.17g}\ngravity: [0, 0, 0]\nmaterials: {{m: {{restitution: {}}}}}\nbodies:\n"
            "- {{name: first, mass: {}, position: [0, {}, 0], velocity: [{}, 0, 0], shapes: [{{sphere: {{radius: {}}}, "
            "material: m}}]}}\n"
            "- {{name: second, mass: {}, position: [{:.17g}, 0, 0], shapes: [{{sphere: {{radius: {}}}, material: "
            "m}}]}}\n",
            step, end, e, first, aside, speed, radius, second, way + ahead, radius));
        run.finish();
        const auto& at = run.pose("second").position;
        off[k] =
            std::hypot(at[0] - way - ahead - impulse / second * n[0] * left, at[1] - impulse / second * n[1] * left);
    }
    EXPECT_LT(off[0], 5e-4 * way);
    EXPECT_LT(off[1], 1.5e-4 * way);
}

// A plate that swings meets a falling ball with the speed of that moment.
TEST(ImpactMotion, AShakenPlateGivesItsSpeedOfTheMeeting) {
    const double e = 0.6, g = 9.81, amplitude = 0.08, rate = 2.0 * std::acos(-1.0) * 1.5, drop = 0.4, radius = 0.1;
    const auto plate = [&](double t) { return amplitude * std::sin(rate * t); };
    double low = 0.15, high = 0.4;  // the gap is open and closed there, and has one root between
    for (int i = 0; i < 60; ++i) {
        const double t = 0.5 * (low + high);
        (drop - 0.5 * g * t * t - plate(t) > 0.0 ? low : high) = t;
    }
    const double plate_speed = amplitude * rate * std::cos(rate * low), after = 0.12;
    const double speed = plate_speed - e * (-g * low - plate_speed);
    for (const double step : {0.01, 0.0033}) {
        SCOPED_TRACE(step);
        auto run = run_of(fmt::format(
            "step: {}\nend: {:.17g}\nmaterials: {{m: {{friction: 0.3, restitution: {}}}}}\nbodies:\n"
            "- {{name: plate, position: [0, 0, -0.1], motion: {{translation: [0, 0, {{sine: {{amplitude: {}, "
            "frequency: 1.5}}}}]}}, shapes: [{{box: {{size: [2, 2, 0.2]}}, material: m}}]}}\n"
            "- {{name: ball, mass: 1, position: [0, 0, {}], shapes: [{{sphere: {{radius: {}}}, material: m}}]}}\n",
            step, low + after, e, amplitude, radius + drop, radius));
        run.finish();
        const double right = radius + drop - 0.5 * g * low * low + (speed - 0.5 * g * after) * after;
        EXPECT_NEAR(run.pose("ball").position[2], right, 5e-4 * drop);
    }
}

}  // namespace
}  // namespace delassus::impact_motion_test
