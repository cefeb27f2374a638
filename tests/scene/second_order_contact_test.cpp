// SPDX-License-Identifier: BSD-3-Clause
// Scenes with contacts by the timesteppers of order 2: what rests stays, what slides slows down, impacts are found.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "simulation/checkpoint.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::second_order_contact_test {
namespace {

constexpr double g = 9.81;

class SecondOrderContact : public testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
#ifndef DELASSUS_HAS_FCL
        GTEST_SKIP() << "this build has no collision";
#endif
    }
    [[nodiscard]] Scene example(const std::string& name, double tolerance = 0.0, double end = 0.0) const {
        SceneOverrides overrides;
        overrides.integrator = GetParam();
        if (tolerance > 0.0) overrides.tolerance = tolerance;
        if (end > 0.0) overrides.end = end;
        return read_scene(example_scene(name), overrides);
    }
};
INSTANTIATE_TEST_SUITE_P(Methods, SecondOrderContact,
                         testing::Values("moreau_jean", "nonsmooth_generalized_alpha", "linearly_implicit_trapezoidal"),
                         [](const auto& chosen) { return chosen.param; });

TEST_P(SecondOrderContact, ABoxSticksOrSlidesOnAnIncline) {
    for (const std::size_t slides : {0, 1}) {
        Running run(example("box_on_incline"), slides);
        const double start = run.pose("box").position[0];
        run.finish();
        const double angle = std::acos(-1.0) / 9.0, a = g * (std::sin(angle) - 0.3 * std::cos(angle));
        EXPECT_NEAR(run.pose("box").position[0] - start, slides ? 0.5 * a : 0.0, 1e-5);
        EXPECT_NEAR(run.pose("box").position[2], 0.1, 1e-7);
        EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
    }
}

TEST_P(SecondOrderContact, AnArchStands) {
    Running run(example("arch"));
    const State start = run.simulation.state();
    run.finish();
    double moved = 0.0;
    for (std::size_t i = 0; i < start.q.size(); ++i)
        moved = std::max(moved, std::abs(run.simulation.state().q[i] - start.q[i]));
    EXPECT_LT(moved, 1e-6);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
}

/// The height above rest of a ball that falls by 1 m and comes back with half of its speed each time.
double height_of_bounces(double t) {
    double since = t - std::sqrt(2.0 / g), speed = 0.5 * std::sqrt(2.0 * g);
    if (since < 0.0) return 1.0 - 0.5 * g * t * t;
    for (; since > 2.0 * speed / g; speed *= 0.5) since -= 2.0 * speed / g;
    return speed * since - 0.5 * g * since * since;
}

TEST_P(SecondOrderContact, ImpactsAreFoundByTolerance) {
    const double sixth = std::sqrt(2.0 / g) * (3.0 - 2.0 * std::pow(0.5, 5.0));
    Running run(example("bounces_by_tolerance", 1e-4));
    while (run.simulation.state().t < sixth) {
        run.simulation.step();
        const double t = run.simulation.state().t;
        EXPECT_NEAR(run.pose("ball").position[2] - 0.1, height_of_bounces(t), 5e-5) << t;
    }
    run.finish();
    EXPECT_NEAR(run.pose("ball").position[2], 0.1, 1e-6);
    EXPECT_LT(run.simulation.totals().worst_penetration, 1e-6);
}

TEST_P(SecondOrderContact, ARunGoesOnWithTheSameBits) {
    const auto read = [&] { return example("mesh_die"); };
    Running whole(read()), stopped(read()), resumed(read());
    constexpr int first = 250, all = 400;
    for (int i = 0; i < all; ++i) whole.simulation.step();
    for (int i = 0; i < first; ++i) stopped.simulation.step();
    const ScratchFolder scratch;
    write_checkpoint({"scene", {{"main", stopped.simulation.save(), {}}}}, scratch / "checkpoint.json");
    resumed.simulation.load(read_checkpoint(scratch / "checkpoint.json").systems[0].simulation);
    for (int i = first; i < all; ++i) resumed.simulation.step();
    EXPECT_EQ(resumed.simulation.save().state.q, whole.simulation.save().state.q);
    EXPECT_EQ(resumed.simulation.save().stepping.method, whole.simulation.save().stepping.method);
}

// Bodies that overlap at the start are pushed apart at the recovery speed: in the positions, or, where rows correct the
// gaps, as a velocity that remains.
TEST_P(SecondOrderContact, PenetrationIsUndoneSlowly) {
    Running run(
        parse_scene(fmt::format("step: 0.001\nend: 1\nintegrator: {{name: {}, options: {{recovery_speed: 0.1}}}}"
                                "\nbodies:\n  - {{name: ground, fixed: true, shapes: [{{plane: {{}}}}]}}\n"
                                "  - {{name: ball, mass: 1, position: [0, 0, 0.05], shapes: [{{sphere: "
                                "{{radius: 0.1}}}}]}}\n",
                                GetParam()),
                    "s.yaml"));
    const bool by_velocity = std::string(GetParam()) == "linearly_implicit_trapezoidal";
    double fastest = 0.0, last = run.pose("ball").position[2];
    while (!run.simulation.finished()) {
        run.simulation.step();
        const double z = run.pose("ball").position[2];
        fastest = std::max(fastest, (z - last) / 0.001);
        last = z;
        EXPECT_LT(std::abs(run.velocities("ball")[0][2]), by_velocity ? 0.1001 : 1e-6);
    }
    EXPECT_LT(fastest, 0.1001);
    EXPECT_NEAR(last, 0.1, 1e-6);
    EXPECT_NEAR(run.simulation.totals().recovered, g * 0.05 + (by_velocity ? 0.5 * 0.1 * 0.1 : 0.0), 1e-3);
}

/// A disc of 2 kg m² that turns at 3 rad/s on a hinge.
std::string disc(const char* method, const char* friction, const char* actuators) {
    return fmt::format(
        "step: 0.01\nend: 2\nintegrator: {}\ngravity: [0, 0, 0]\n"
        "bodies: [{{name: disc, mass: 1, inertia: {{xx: 1, yy: 1, zz: 2}}, angular_velocity: [0, 0, 3]}}]\n"
        "joints: [{{name: hinge, kind: revolute, second: disc, axis: [0, 0, 1], friction: {}}}]\n{}",
        method, friction, actuators);
}

// 4 Nm stop it after 1.5 s, at 2.25 rad.
TEST_P(SecondOrderContact, DryFrictionOfAJointStopsADisc) {
    Running run(parse_scene(disc(GetParam(), "4", ""), "s"));
    run.finish();
    const auto& turn = run.pose("disc").orientation;
    EXPECT_NEAR(2.0 * std::atan2(turn[3], turn[0]), 2.25, 1e-3);
    EXPECT_NEAR(run.velocities("disc")[1][2], 0.0, 1e-9);
}

double angle_of(const Running& run, const std::string& body) {
    const auto& turn = run.pose(body).orientation;
    return 2.0 * std::atan2(turn[3], turn[0]);
}

/// What the disc's angle and speed are off by after `steps` steps; `rest`: it starts at rest.
struct Miss {
    double angle, speed;
};
Miss miss_of(const char* method, const std::string& actuator, bool rest, double end, int steps, double angle,
             double speed) {
    std::string scene =
        disc(method, "0", fmt::format("actuators: [{{name: a, joint: hinge, {}}}]\n", actuator).c_str());
    const auto replace = [&](const std::string& from, const std::string& to) {
        scene.replace(scene.find(from), from.size(), to);
    };
    replace("step: 0.01\nend: 2", fmt::format("step: {:.17g}\nend: {:.17g}", end / steps, end));
    if (rest) replace("[0, 0, 3]", "[0, 0, 0]");
    Running run(parse_scene(scene, "s"));
    run.finish();
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
    return {std::abs(angle_of(run, "disc") - angle), std::abs(run.velocities("disc")[1][2] - speed)};
}

// A damper of 4 Nm s that gives 2 Nm at most slows the disc by 1 rad/s² until it turns at 0.5 rad/s, after 2.5 s and
// 4.375 rad, and then by a factor of e in half a second.
TEST_P(SecondOrderContact, ADamperWithALimitIsMet) {
    const double speed = 0.5 * std::exp(-1.0), angle = 4.375 + 0.25 * (1.0 - std::exp(-1.0));
    for (const int steps : {31, 62, 124, 248}) {
        const double h = 3.0 / steps;
        const Miss miss = miss_of(GetParam(), "speed: 0, kd: 4, limit: 2", false, 3.0, steps, angle, speed);
        EXPECT_LT(miss.angle, 0.5 * h * h) << steps;
        EXPECT_LT(miss.speed, 0.5 * h * h) << steps;
    }
}

// A servo of 8 Nm/rad that gives 4 Nm at most takes the disc towards 1 rad: φ = t² up to ½, then
// φ − 1 = −½ cos 2τ + √½ sin 2τ.
TEST_P(SecondOrderContact, AServoWithALimitIsMet) {
    const double saturated = std::sqrt(0.5), end = saturated + 0.5, c = std::cos(1.0), s = std::sin(1.0);
    for (const int steps : {31, 62, 124, 248}) {
        const double h = end / steps;
        const Miss miss = miss_of(GetParam(), "position: 1, kp: 8, limit: 4", true, end, steps,
                                  1.0 - 0.5 * c + saturated * s, s + 2.0 * saturated * c);
        EXPECT_LT(miss.angle, 2.0 * h * h) << steps;
        EXPECT_LT(miss.speed, 2.0 * h * h) << steps;
    }
}

// Far from its limit the row is the force law itself: φ = 1 − cos 2t, order 2.
TEST_P(SecondOrderContact, AServoBelowItsLimitIsOfOrderTwo) {
    const auto error = [&](int steps) {
        return miss_of(GetParam(), "position: 1, kp: 8, limit: 1000", true, 1.0, steps, 1.0 - std::cos(2.0),
                       2.0 * std::sin(2.0));
    };
    const Miss coarse = error(50), fine = error(200);
    EXPECT_NEAR(std::log(coarse.angle / fine.angle) / std::log(4.0), 2.0, 0.1);
    EXPECT_NEAR(std::log(coarse.speed / fine.speed) / std::log(4.0), 2.0, 0.1);
}

// What rides on a shaken table has the table's velocity at the end of a step, not its mean over the step.
TEST_P(SecondOrderContact, ABlockRidesOnAShakenTable) {
    const double end = 0.3, rate = 2.0 * std::acos(-1.0), speed = 0.05 * rate * std::cos(rate * end);
    const auto error = [&](int steps) {
        Running run(parse_scene(
            fmt::format(
                "step: {:.17g}\nend: {}\nintegrator: {}\nsolver: {{tolerance: 1.0e-10}}\nmaterials: {{wood: "
                "{{friction: 0.5}}}}\nbodies:\n"
                "  - {{name: table, position: [0, 0, -0.1], shapes: [{{box: {{size: [4, 4, 0.2]}}, material: wood}}],"
                " motion: {{translation: [{{sine: {{amplitude: 0.05, frequency: 1}}}}, 0, 0]}}}}\n"
                "  - {{name: block, mass: 1, position: [0, 0, 0.1], velocity: [{:.17g}, 0, 0],"
                " shapes: [{{box: {{size: [1, 1, 0.2]}}, material: wood}}]}}\n",
                end / steps, end, GetParam(), 0.05 * rate),
            "s"));
        run.finish();
        EXPECT_NEAR(run.pose("block").position[0], 0.05 * std::sin(rate * end), std::pow(end / steps, 2));
        return std::abs(run.velocities("block")[0][0] - speed);
    };
    EXPECT_LT(error(30), 2e-4);
    EXPECT_LT(error(120), 1.5e-5);
}

// Links of 1 g that a pull of 10⁴ N holds swing too fast for these steps: the run ends, and says so.
TEST(SecondOrderJoints, AreNotLeftApartInSilence) {
    for (const char* method : {"moreau_jean", "moreau_jean(theta=1)", "linearly_implicit_trapezoidal"}) {
        SceneOverrides overrides;
        overrides.integrator = method;
        Running run(read_scene(example_scene("chain_heavy_end"), overrides));
        EXPECT_THROW(run.finish(), Error) << method;
        EXPECT_LT(run.simulation.totals().worst_drift, 1e-2) << method;
    }
}

TEST_P(SecondOrderContact, ArePlannedForAndRefuseToSleep) {
    Scene scene = example("box_on_incline");
    EXPECT_EQ(make_plan(scene, registry()).size(), 2U);
    Scene sleeping = example("sleeping_stacks");
    EXPECT_THROW(Simulation(sleeping.systems[0], registry()), Unsupported);
}

}  // namespace
}  // namespace delassus::tests::second_order_contact_test
