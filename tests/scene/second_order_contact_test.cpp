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

TEST_P(SecondOrderContact, ImpactsAreFoundByTolerance) {
    Running run(example("bounces_by_tolerance", 1e-4));
    std::vector<double> times;
    double before = 0.0;
    while (times.size() < 6 && !run.simulation.finished()) {
        run.simulation.step();
        const double speed = run.velocities("ball")[0][2];
        if (before < 0.0 && speed > 0.0) times.push_back(run.simulation.state().t);
        before = speed;
    }
    ASSERT_EQ(times.size(), 6U);
    for (std::size_t k = 0; k < times.size(); ++k)
        EXPECT_NEAR(times[k], std::sqrt(2.0 / g) * (3.0 - 2.0 * std::pow(0.5, static_cast<double>(k))), 1e-5) << k;
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
    EXPECT_EQ(resumed.simulation.save().memory, whole.simulation.save().memory);
}

// Bodies that overlap at the start are pushed apart at the recovery speed, without speeding off.
TEST_P(SecondOrderContact, PenetrationIsUndoneSlowly) {
    Running run(
        parse_scene(fmt::format("step: 0.001\nend: 1\nintegrator: {{name: {}, options: {{recovery_speed: 0.1}}}}"
                                "\nbodies:\n  - {{name: ground, fixed: true, shapes: [{{plane: {{}}}}]}}\n"
                                "  - {{name: ball, mass: 1, position: [0, 0, 0.05], shapes: [{{sphere: "
                                "{{radius: 0.1}}}}]}}\n",
                                GetParam()),
                    "s.yaml"));
    double fastest = 0.0, last = run.pose("ball").position[2];
    while (!run.simulation.finished()) {
        run.simulation.step();
        const double z = run.pose("ball").position[2];
        fastest = std::max(fastest, (z - last) / 0.001);
        last = z;
        EXPECT_LT(std::abs(run.velocities("ball")[0][2]), 1e-6);
    }
    EXPECT_LT(fastest, 0.1001);
    EXPECT_NEAR(last, 0.1, 1e-6);
    EXPECT_NEAR(run.simulation.totals().recovered, g * 0.05, 1e-3);
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

TEST_P(SecondOrderContact, RefusesActuatorsWithALimit) {
    const auto with = [&](const char* limit) {
        return parse_scene(
            disc(GetParam(), "0",
                 fmt::format("actuators: [{{name: a, joint: hinge, speed: 0, kd: 4{}}}]\n", limit).c_str()),
            "s");
    };
    Running free(with(""));
    free.finish();
    EXPECT_NEAR(free.velocities("disc")[1][2], 3.0 * std::exp(-4.0), 2e-3);
    Running limited(with(", limit: 2"));
    EXPECT_THROW(limited.finish(), Unsupported);
}

TEST_P(SecondOrderContact, ArePlannedForAndRefuseToSleep) {
    Scene scene = example("box_on_incline");
    EXPECT_EQ(make_plan(scene, registry()).size(), 2U);
    Scene sleeping = example("sleeping_stacks");
    EXPECT_THROW(Simulation(sleeping.systems[0], registry()), Unsupported);
}

}  // namespace
}  // namespace delassus::tests::second_order_contact_test
