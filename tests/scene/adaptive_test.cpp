// SPDX-License-Identifier: BSD-3-Clause
// Scenes whose steps follow from a tolerance: impacts, checkpoints, what is refused.
#include <gtest/gtest.h>

#include <cmath>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "simulation/checkpoint.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::adaptive_test {
namespace {

constexpr double g = 9.81;

SceneOverrides with_tolerance(double value) {
    SceneOverrides overrides;
    overrides.tolerance = value;
    return overrides;
}

#ifdef DELASSUS_HAS_FCL

/// When the ball of examples/scenes/bouncing_ball.yaml turns upwards, and how many steps that took.
struct Bounces {
    std::vector<double> times;
    std::int64_t steps = 0;
};
Bounces bounces(const SceneOverrides& overrides, std::size_t count) {
    Running run(read_scene(example_scene("bounces_by_tolerance"), overrides));
    Bounces result;
    double before = 0.0;
    while (result.times.size() < count && !run.simulation.finished()) {
        run.simulation.step();
        const double speed = run.velocities("ball")[0][2];
        if (before < 0.0 && speed > 0.0) result.times.push_back(run.simulation.state().t);
        before = speed;
    }
    result.steps = run.simulation.record().step;
    return result;
}

// The k-th impact comes after the fall T = √(2 h/g) and flights of 2 e T, 2 e² T, …, here e = ½.
double impact_time(std::size_t k) {
    return std::sqrt(2.0 / g) * (3.0 - 2.0 * std::pow(0.5, static_cast<double>(k)));
}

TEST(Tolerance, FindsTheImpactsOfABall) {
    constexpr std::size_t count = 8;
    const auto found = bounces(with_tolerance(1e-4), count);
    ASSERT_EQ(found.times.size(), count);
    SceneOverrides fixed;
    fixed.step = found.times.back() / static_cast<double>(found.steps);
    const auto late = bounces(fixed, count);
    ASSERT_EQ(late.times.size(), count);
    double worst = 0.0, worst_fixed = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
        worst = std::max(worst, std::abs(found.times[k] - impact_time(k)));
        worst_fixed = std::max(worst_fixed, std::abs(late.times[k] - impact_time(k)));
    }
    EXPECT_LT(worst, 1e-5);
    EXPECT_GT(worst_fixed, 100.0 * worst);
}

TEST(Tolerance, ABallComesToRest) {
    SceneOverrides overrides = with_tolerance(1e-4);
    overrides.integrator = "euler_implicit_linearized";  // no speed below which it does not bounce
    Running run(read_scene(example_scene("bounces_by_tolerance"), overrides));
    run.finish();
    EXPECT_NEAR(run.pose("ball").position[2], 0.1, 1e-6);
    EXPECT_LT(std::abs(run.velocities("ball")[0][2]), 1e-3);
    EXPECT_LT(run.simulation.record().step, 3000);
    EXPECT_GE(run.simulation.totals().impacts, 5);
    EXPECT_LT(run.simulation.totals().worst_penetration, 1e-6);
}

#endif

TEST(Tolerance, GoesOnWithTheSameBits) {
#ifdef DELASSUS_HAS_FCL
    const std::vector<std::string> scenes = {"pendulum", "bouncing_ball"};
#else
    const std::vector<std::string> scenes = {"pendulum"};
#endif
    for (const auto& scene : scenes) {
        SceneOverrides overrides = with_tolerance(1e-3);
        overrides.end = 10;
        const auto read = [&] { return read_scene(example_scene(scene), overrides); };
        constexpr int first = 57, all = 140;
        Running whole(read()), stopped(read()), resumed(read());
        for (int i = 0; i < all; ++i) whole.simulation.step();
        for (int i = 0; i < first; ++i) stopped.simulation.step();
        const ScratchFolder scratch;
        const auto file = scratch / "checkpoint.json";
        write_checkpoint({"scene", {{"main", stopped.simulation.save(), {}}}}, file);
        resumed.simulation.load(read_checkpoint(file).systems[0].simulation);
        for (int i = first; i < all; ++i) resumed.simulation.step();
        const auto expected = whole.simulation.save(), got = resumed.simulation.save();
        EXPECT_EQ(got.state.t, expected.state.t) << scene;
        EXPECT_EQ(got.state.q, expected.state.q) << scene;
        EXPECT_EQ(got.state.v, expected.state.v) << scene;
        EXPECT_EQ(got.stepping.method, expected.stepping.method) << scene;
        EXPECT_EQ(got.stepping.control, expected.stepping.control) << scene;
        EXPECT_EQ(got.totals.rejected, expected.totals.rejected) << scene;
        EXPECT_EQ(got.totals.impacts, expected.totals.impacts) << scene;
        EXPECT_EQ(got.totals.smallest_step, expected.totals.smallest_step) << scene;
        EXPECT_EQ(got.totals.largest_step, expected.totals.largest_step) << scene;
    }
}

TEST(Tolerance, IsPlannedForLikeAFixedStep) {
    Scene scene = read_scene(example_scene("pendulum"), with_tolerance(1e-3));
    const auto plans = make_plan(scene, registry());
    ASSERT_EQ(plans.size(), 1U);
    EXPECT_EQ(plans[0].constraints, 5);
}

std::string told(const std::string& steps) {
    try {
        static_cast<void>(
            parse_scene(steps + "\nend: 1\nbodies: [{name: a, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n", "scene"));
    } catch (const InputError& error) {
        return error.what();
    }
    return "taken";
}

TEST(Tolerance, AndItsBoundsAreRead) {
    EXPECT_EQ(told("tolerance: 1.0e-3"), "taken");
    const Scene scene = parse_scene(
        "tolerance: {absolute: 1.0e-3}\nstep: {smallest: 1.0e-5, largest: 0.5}\nend: 1\nbodies: [{name: a, mass: 1, "
        "inertia: {xx: 1, yy: 1, zz: 1}}]\n",
        "scene");
    const StepControl& control = scene.systems[0].control.value();
    EXPECT_EQ(control.absolute, 1e-3);
    EXPECT_EQ(control.relative, 0.0);
    EXPECT_EQ(control.smallest, 1e-5);
    EXPECT_EQ(control.initial, 1e-4);
    EXPECT_EQ(control.largest, 0.5);
    EXPECT_EQ(told("tolerance: 0"), "scene, line 1: \"tolerance\" is 0; it must be positive");
    EXPECT_EQ(told("tolerance: {relative: 1.0e-3}"), "scene, line 1: \"tolerance\" lacks the key \"absolute\"");
    EXPECT_EQ(
        told("tolerance: 1.0e-3\nstep: 0.1"),
        "scene, line 2: a fixed \"step\" and a \"tolerance\" exclude each other; bounds of the step are given as step: "
        "{initial, smallest, largest}");
    EXPECT_EQ(told("step: {largest: 0.1}"),
              "scene, line 1: a \"step\" with bounds needs a \"tolerance\", e.g. tolerance: 1.0e-4");
    EXPECT_EQ(told("tolerance: 1.0e-3\nstep: {initial: 1, largest: 0.1}"),
              "scene, line 2: \"step\" must have smallest ≤ initial ≤ largest, not 1e-07, 1 and 0.1");
}

TEST(Tolerance, AndAStepOfTheCommandLineReplaceEachOther) {
    SceneOverrides overrides = with_tolerance(1e-3);
    EXPECT_TRUE(read_scene(example_scene("pendulum"), overrides).systems[0].control.has_value());
    overrides.step = 0.1;
    EXPECT_THROW(static_cast<void>(read_scene(example_scene("pendulum"), overrides)), InputError);
}

}  // namespace
}  // namespace delassus::tests::adaptive_test
