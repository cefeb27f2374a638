// SPDX-License-Identifier: BSD-3-Clause
// The example scenes against what their heads say is known.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "delassus/error.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::physics_test {
namespace {

constexpr double g = 9.81;

double length(const Vector3& v) {
    return std::hypot(v[0], v[1], v[2]);
}

TEST(ExampleScene, PendulumComesBackAfterItsPeriod) {
    Running run(read_scene(example_scene("pendulum")));
    run.finish();
    const auto bob = run.pose("bob").position;
    EXPECT_NEAR(bob[0], -1.0, 1e-5);
    EXPECT_NEAR(bob[2], 0.0, 1e-3);
    EXPECT_LT(std::abs(run.simulation.totals().energy), 1e-3);
    EXPECT_LT(run.simulation.totals().worst_drift, 2e-5);
}

TEST(ExampleScene, PendulumConvergesWithTheSecondOrderOfTheTrapezoidalRule) {
    const auto error = [](double step) {
        SceneOverrides overrides;
        overrides.integrator = "trapezoidal";
        overrides.step = step;
        overrides.end = 0.4;
        Running run(read_scene(example_scene("pendulum"), overrides));
        run.finish();
        return run.simulation.totals().energy;
    };
    EXPECT_NEAR(std::log2(std::abs(error(0.02) / error(0.01))), 2.0, 0.15);
}

TEST(ExampleScene, SliderFollowsTheCrank) {
    SceneOverrides overrides;
    overrides.end = 1.0;
    Running run(read_scene(example_scene("slider_crank"), overrides));
    double worst = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        const double phi = std::numbers::pi * run.simulation.state().t;
        const double x = 0.1 * std::cos(phi) + std::sqrt(0.09 - std::pow(0.1 * std::sin(phi), 2));
        worst = std::max(worst, std::abs(run.pose("slider").position[0] - x));
    }
    EXPECT_LT(worst, 1e-5);
    EXPECT_NEAR(run.pose("slider").position[0], 0.2, 1e-5);
}

TEST(ExampleScene, HeavyTopKeepsEnergyAndVerticalMomentum) {
    SceneOverrides overrides;
    overrides.end = 0.25;
    Running run(read_scene(example_scene("heavy_top"), overrides));
    const double energy = run.simulation.totals().start_energy;
    EXPECT_NEAR(energy, 5435.69, 0.01);
    const double momentum = run.simulation.record().angular_momentum[2];
    run.finish();
    EXPECT_NEAR(run.simulation.totals().energy / energy, 1.0, 1e-5);
    EXPECT_NEAR(run.simulation.record().angular_momentum[2], momentum, 1e-3 * std::abs(momentum));
}

TEST(ExampleScene, FourBarKeepsItsEnergy) {
    SceneOverrides overrides;
    overrides.end = 0.5;
    Running run(read_scene(example_scene("four_bar"), overrides));
    const double energy = run.simulation.totals().start_energy;
    run.finish();
    // Three bars that turn with 1 rad/s about their feet and two couplers at 1 m/s and at a height of 1 m.
    EXPECT_NEAR(energy, 3 * 0.5 / 3 + 2 * 0.5 + 3 * g * 0.5 + 2 * g, 1e-9);
    EXPECT_NEAR(run.simulation.totals().energy / energy, 1.0, 1e-4);
    // A parallelogram: its bars stay parallel.
    EXPECT_NEAR(run.pose("bar_0").position[1], run.pose("bar_2").position[1], 1e-9);
}

TEST(ExampleScene, HeavyEndOfTheChainFallsOnACircle) {
    SceneOverrides overrides;
    overrides.end = 0.2;
    Running run(read_scene(example_scene("chain_heavy_end"), overrides));
    run.finish();
    const auto weight = run.pose("weight").position;
    EXPECT_NEAR(length(weight), 4.1, 1e-3);
    const double speed = length(run.velocities("weight")[0]);
    EXPECT_NEAR(speed * speed / (-2 * g * weight[2]), 1.0, 0.02);  // first order, in 100 steps
    EXPECT_LT(run.simulation.totals().worst_drift, 1e-8);
}

TEST(ExampleScene, LongChainHangsByTheWeightBelowEachPin) {
    SceneOverrides overrides;
    overrides.end = 0.015;
    Running run(read_scene(example_scene("chain_1000"), overrides));
    Problem last;
    run.simulation.solver().watch([&](const Problem& problem) { last = problem; });
    run.finish();
    for (const double v : run.simulation.state().v) EXPECT_NEAR(v, 0.0, 1e-9);
    SolverConfig config;
    config.name = "cholmod";
    Solver solver = make_solver(registry(), config);
    Solution solution;
    solver.solve(PreparedProblem(last), solution, {});
    const double h = run.scene.systems[0].step;
    for (std::int32_t pin = 0; pin <= 1000; ++pin) {  // the support, then pins, then the hook
        const auto row = static_cast<std::size_t>(run.system().joint_rows(pin)[0]);
        const double below = 1000 + 0.001 * (1000 - pin);
        const double force = std::hypot(solution.lambda[row], solution.lambda[row + 1], solution.lambda[row + 2]) / h;
        EXPECT_NEAR(force, below * g, 1e-8 * below * g) << pin;
    }
}

TEST(ExampleScene, BallBouncesByItsRestitutionAndRests) {
    Running run(read_scene(example_scene("bouncing_ball")));
    double first_impact = 0.0, highest_bounce = 0.0, last_motion = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        const double t = run.simulation.state().t, z = run.pose("ball").position[2] - 0.1;
        const double v = run.velocities("ball")[0][2];
        if (first_impact == 0.0 && v > 0.0) first_impact = t;
        if (first_impact > 0.0) highest_bounce = std::max(highest_bounce, z);
        if (std::abs(v) > 0.05) last_motion = t;
        EXPECT_GT(z, -1e-3);
    }
    const double fall = std::sqrt(2.0 / g);
    EXPECT_NEAR(first_impact, fall, 2e-3);
    EXPECT_NEAR(highest_bounce, 0.25, 5e-3);
    EXPECT_NEAR(last_motion, 3 * fall, 0.03);
    EXPECT_NEAR(run.pose("ball").position[2], 0.1, 1e-6);
}

TEST(ExampleScene, BoxSticksOrSlidesByItsFriction) {
    Running sticks(read_scene(example_scene("box_on_incline")), 0);
    sticks.finish();
    EXPECT_NEAR(sticks.pose("box").position[0], 0.0, 1e-6);
    Running slides(read_scene(example_scene("box_on_incline")), 1);
    slides.finish();
    const double angle = 20 * std::numbers::pi / 180, a = g * (std::sin(angle) - 0.3 * std::cos(angle));
    EXPECT_NEAR(slides.velocities("box")[0][0], a, 1e-5);
    EXPECT_NEAR(slides.pose("box").position[0], 0.5 * a, 1e-3);
}

/// It must not move by more than a micrometre.
void expect_stands(const std::string& name, std::int64_t least_contacts) {
    Running run(read_scene(example_scene(name)));
    const State start = run.simulation.state();
    run.finish();
    for (std::size_t i = 0; i < start.q.size(); ++i) EXPECT_NEAR(run.simulation.state().q[i], start.q[i], 1e-6);
    EXPECT_GE(run.simulation.totals().most_contacts, least_contacts);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << run.simulation.totals().first_unsolved;
}

TEST(ExampleScene, WallStands) {
    expect_stands("brick_wall", 50);
}

TEST(ExampleScene, ParcelLineDoesWhatItsHeadSays) {
    Running run(read_scene(example_scene("parcel_line")));
    while (run.simulation.state().t < 4.0 - 1e-9) run.simulation.step();
    EXPECT_NEAR(run.pose("parcel").position[0], 0.5, 1e-6);
    EXPECT_NEAR(run.velocities("wheel")[1][2], 0.5 * 0.0625 / 0.5, 2e-3);
    run.finish();
    EXPECT_NEAR(run.velocities("wheel")[1][2], 0.0, 1e-8);
    const auto gate = run.pose("gate").orientation;
    EXPECT_NEAR(2.0 * std::atan2(gate[3], gate[0]), 1.2, 1.1e-3);
    EXPECT_NEAR(run.pose("parcel").position[0], 0.5, 1e-6);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
}

TEST(ExampleScene, ArchStands) {
    expect_stands("arch", 11 * 4);  // four points to a joint
}

TEST(ExampleScene, HouseOfCardsStands) {
    // Two points to each line between cards or on the ground: three tops, six feet, two lines under the roof at least.
    expect_stands("card_house", 2 * (3 + 6 + 2));
}

TEST(ExampleScene, PileStaysInItsBoxAndComesToRest) {
    Running run(read_scene(example_scene("sphere_pile")));
    run.finish();
    // The last sphere to roll down may still roll, and which one that is depends on the last digits.
    double speeds = 0.0;
    int moving = 0;
    for (const auto& body : run.scene.systems[0].bodies) {
        if (body.fixed) continue;
        const auto at = run.pose(body.name).position;
        EXPECT_LT(std::max(std::abs(at[0]), std::abs(at[1])), 0.4 + 1e-4) << body.name;
        EXPECT_GT(at[2], 0.1 - 1e-4) << body.name;
        speeds += length(run.velocities(body.name)[0]);
        ++moving;
    }
    EXPECT_LT(speeds / moving, 0.05);
    EXPECT_LT(run.simulation.totals().worst_penetration, 2e-4);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
}

// Two bodies that squeeze a third between them leave it no velocity, and reactions grow without bound.
TEST(Physics, WhatIsPressedThroughTheFloorEndsTheRun) {
    for (const double rate : {-5.0, -0.05}) {
        for (const char* shape : {"sphere: {radius: 0.1}", "box: {size: [0.2, 0.2, 0.2]}"}) {
            Running run(parse_scene(
                fmt::format(
                    "step: 0.001\nend: 0.5\nmaterials: {{m: {{friction: 0.5, restitution: 0}}}}\nbodies:\n"
                    "  - {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                    "  - {{name: press, motion: {{translation: [0, 0, {{linear: {{start: 0.201, rate: {}}}}}]}}, "
                    "position: [0, 0, 0.05], shapes: [{{box: {{size: [1, 1, 0.1]}}, material: m}}]}}\n"
                    "  - {{name: b, mass: 1, position: [0, 0, 0.1], shapes: [{{{}, material: m}}]}}\n",
                    rate, shape),
                "press"));
            try {
                run.finish();
                ADD_FAILURE() << shape << " went to " << run.pose("b").position[2];
            } catch (const StepFailure& error) {
                EXPECT_NEAR(run.pose("b").position[2], 0.1, 0.01) << error.what();
            }
        }
    }
}

TEST(Physics, ARunOfATinyPartOfAStepTakesAStep) {
    for (const char* end : {"1.0e-10", "1.0e-13", "1.0e-30"}) {
        Running run(
            parse_scene(std::string("step: 0.001\nend: ") + end +
                            "\nbodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, velocity: [1, 0, 0]}]",
                        "tiny"));
        run.finish();
        EXPECT_EQ(run.simulation.record().step, 1) << end;
        EXPECT_EQ(run.simulation.state().t, std::stod(end));
        EXPECT_NEAR(run.pose("b").position[0] / std::stod(end), 1.0, 1e-6);
    }
}

}  // namespace
}  // namespace delassus::tests::physics_test
