// SPDX-License-Identifier: BSD-3-Clause
// What slides and rolls over flush shapes moves as over one shape.
#ifdef DELASSUS_HAS_FCL
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/scenes.hpp"

namespace delassus::tests::flush_test {
namespace {

constexpr double g = 9.81;

/// Tiles of 0.25 m over 4 × 1 m, their tops in z = 0: as bodies that are fixed or kinematic, or as one body.
enum class Tiles { Fixed, Kinematic, OneBody };

std::string floor_of(Tiles kind) {
    std::string text = kind == Tiles::OneBody ? "  - {name: floor, fixed: true, shapes: [" : "";
    for (int i = 0; i < 16; ++i)
        for (int j = 0; j < 4; ++j) {
            const std::string where = fmt::format("position: [{}, {}, -0.05]", 0.25 * (i - 7.5), 0.25 * (j - 1.5));
            const std::string box = "{box: {size: [0.25, 0.25, 0.1]}, material: m";
            if (kind == Tiles::OneBody) {
                text += fmt::format("{}{}, {}}}", i + j == 0 ? "" : ", ", box, where);
            } else {
                text +=
                    fmt::format("  - {{name: t_{}_{}, {}, {}, shapes: [{}}}]}}\n", i, j,
                                kind == Tiles::Fixed ? "fixed: true" : "motion: {translation: [0, 0, 0]}", where, box);
            }
        }
    return kind == Tiles::OneBody ? text + "]}\n" : text;
}

const std::string slab =
    "  - {name: floor, fixed: true, position: [0, 0, -0.05],\n"
    "     shapes: [{box: {size: [4, 1, 0.1]}, material: m}]}\n";

std::string scene(const std::string& ground, const std::string& slider, double friction, double step,
                  double end = 1.0) {
    return fmt::format(
        "step: {}\nend: {}\nmaterials: {{m: {{friction: {}}}}}\nbodies:\n{}"
        "  - {{name: slider, mass: 1, velocity: [2, 0, 0], {}}}\n",
        step, end, friction, ground, slider);
}

const std::string box =
    "position: [-0.9, 0.03, 0.1], orientation: {axis: [0, 0, 1], angle: 10},\n"
    "     shapes: [{box: {size: [0.3, 0.2, 0.2]}, material: m}]";

TEST(FlushTiles, ABoxSlidesAsFarAsOnOneShape) {
    for (const Tiles kind : {Tiles::Fixed, Tiles::Kinematic, Tiles::OneBody})
        for (const double step : {0.01, 0.001}) {
            Running run(parse_scene(scene(floor_of(kind), box, 0.3, step), "s"));
            run.finish();
            const auto x = run.pose("slider").position;
            EXPECT_NEAR(x[0], -0.9 + 2.0 / (0.3 * g) * 1.0, 1.1 * step) << static_cast<int>(kind);
            EXPECT_NEAR(x[1], 0.03, 1e-7);
            EXPECT_NEAR(x[2], 0.1, 1e-7);
        }
}

// Every step of a fall, a slide and a roll is as on one shape.
TEST(FlushTiles, ShapesMoveAsOnOneShape) {
    const std::vector<std::string> sliders = {
        box,
        "position: [-0.9, 0.03, 0.1], angular_velocity: [0, 20, 0], shapes: [{sphere: {radius: 0.1}, material: m}]",
        "position: [-0.9, 0.03, 0.15], shapes: [{cylinder: {radius: 0.1, length: 0.3}, material: m}]",
        "position: [-0.9, 0.03, 0.1], angular_velocity: [0, 20, 0],\n"
        "     shapes: [{cylinder: {radius: 0.1, length: 0.3}, orientation: {axis: [1, 0, 0], angle: 90}, material: m}]",
        "position: [-0.9, 0.03, 0.1],\n"
        "     shapes: [{capsule: {radius: 0.1, length: 0.3}, orientation: {axis: [0, 1, 0], angle: 90}, material: m}]",
        "position: [-0.9, 0.03, 0.2], shapes: [{box: {size: [0.15, 0.2, 0.2]}, position: [-0.075, 0, 0], material: "
        "m},\n"
        "     {box: {size: [0.15, 0.2, 0.2]}, position: [0.075, 0, 0], material: m}]"};
    for (const auto& slider : sliders) {
        Running one(parse_scene(scene(slab, slider, 0.2, 0.001), "one")),
            many(parse_scene(scene(floor_of(Tiles::Fixed), slider, 0.2, 0.001), "many"));
        double farthest = 0.0;
        while (!one.simulation.finished()) {
            one.simulation.step();
            many.simulation.step();
            for (std::size_t k = 0; k < 3; ++k)
                farthest =
                    std::max(farthest, std::abs(one.pose("slider").position[k] - many.pose("slider").position[k]));
        }
        EXPECT_LT(farthest, 1e-5) << slider;
    }
}

TEST(FlushTiles, EveryMethodOfContactPassesTheSeam) {
    for (const char* integrator :
         {"moreau_jean", "linearly_implicit_trapezoidal", "nonsmooth_generalized_alpha", "switching"}) {
        SceneOverrides overrides;
        overrides.integrator = integrator;
        Running run(parse_scene(scene(floor_of(Tiles::Fixed), box, 0.3, 0.002), "s", overrides));
        run.finish();
        EXPECT_NEAR(run.pose("slider").position[0], -0.9 + 2.0 / (0.3 * g), 5e-3) << integrator;
        EXPECT_NEAR(run.pose("slider").position[1], 0.03, 1e-6) << integrator;
    }
}

// A wall on the floor stops the slider, whichever it is made of; a kerb of 1 mm trips it.
TEST(FlushTiles, WallsAndStepsStop) {
    const std::string level = "position: [-0.9, 0.03, 0.1], shapes: [{box: {size: [0.3, 0.2, 0.2]}, material: m}]";
    for (const double height : {0.4, 0.001}) {
        std::string wall;
        for (int i = 0; i < 4; ++i)
            wall += fmt::format(
                "  - {{name: w{}, fixed: true, position: [0.2, {}, {}],\n"
                "     shapes: [{{box: {{size: [0.4, 0.25, {}]}}, material: m}}]}}\n",
                i, 0.25 * (i - 1.5), 0.5 * height, height);
        Running run(parse_scene(scene(floor_of(Tiles::Fixed) + wall, level, 0.0, 0.001, 0.6), "s"));
        while (run.simulation.state().t < 0.378) run.simulation.step();  // it meets them at 0.375 s
        EXPECT_NEAR(run.pose("slider").position[0], -0.15, 0.01) << height;
        // A kerb trips the box: 2 m/s · 0.1 m turn it about its lower edge, of which (I/m) is 0.0433 m².
        EXPECT_NEAR(run.velocities("slider")[0][0], height > 0.1 ? 0.0 : 2.0 * 0.01 / (0.13 / 3.0), 0.05) << height;
    }
}

// In the middle of a step the box is in the wall, where another brick may be the one that it has gone into.
TEST(FlushTiles, AWallOfBricksStopsEveryMethod) {
    std::string wall;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            wall += fmt::format(
                "  - {{name: w_{}_{}, fixed: true, position: [0.1, {}, {}],\n"
                "     shapes: [{{box: {{size: [0.2, 0.25, 0.1]}}, material: m}}]}}\n",
                i, j, 0.25 * (j - 1.5), 0.1 * i + 0.05);
    for (const char* integrator : {"moreau_jean", "linearly_implicit_trapezoidal", "switching"}) {
        SceneOverrides overrides;
        overrides.integrator = integrator;
        Running run(parse_scene(scene(slab + wall, box, 0.1, 0.001, 0.8), "s", overrides));
        run.finish();
        EXPECT_LT(run.pose("slider").position[0], -0.09) << integrator;
        EXPECT_GT(run.pose("slider").position[0], -0.4) << integrator;
    }
}

}  // namespace
}  // namespace delassus::tests::flush_test
#endif
