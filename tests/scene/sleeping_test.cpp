// SPDX-License-Identifier: BSD-3-Clause
// Bodies that sleep: who does, what it saves, what wakes them.
#ifdef DELASSUS_HAS_FCL
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "delassus/error.hpp"
#include "simulation/checkpoint.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::sleeping_test {
namespace {

const std::string head = R"(
step: 0.002
end: 10
sleeping: {speed: 1.0e-3, time: 0.1}
solver: {tolerance: 1.0e-8}
materials: {stone: {friction: 0.6}}
)";

/// Three boxes on top of each other, dropped from a millimetre, with what else there is.
std::string stack(const std::string& more = "", const std::string& lists = "") {
    return head + R"(
bodies:
  - {name: ground, fixed: true, shapes: [{plane: {}, material: stone}]}
  - name: box_{k}
    density: 1000
    position: [0, 0, 0.051]
    shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: stone}]
    repeat: {count: [1, 1, 3], spacing: [0, 0, 0.101]}
)" + more + lists;
}

void run_until(Running& run, double t) {
    while (run.simulation.state().t < t - 1e-9) run.simulation.step();
}

TEST(Sleeping, StackFallsAsleepAndNeedsNoSolver) {
    Running run(parse_scene(stack(), "test"));
    run_until(run, 1.0);
    EXPECT_EQ(run.simulation.record().sleeping, 3);
    const State asleep = run.simulation.state();
    const auto totals = run.simulation.totals();
    for (int i = 0; i < 50; ++i) {
        const StepRecord& record = run.simulation.step();
        EXPECT_EQ(record.solver_iterations, 0);
        EXPECT_EQ(record.natural, 0.0);
        EXPECT_GE(record.contacts, 12);
        EXPECT_EQ(record.energy, totals.energy);
    }
    EXPECT_EQ(run.simulation.totals().plugin_solves, totals.plugin_solves);
    EXPECT_EQ(run.simulation.totals().resting_parts, totals.resting_parts + 50);
    EXPECT_EQ(run.simulation.state().q, asleep.q);
    for (const double v : run.simulation.state().v) EXPECT_EQ(v, 0.0);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(run.pose("box_" + std::to_string(k)).position[2], 0.05 + 0.1 * k, 1e-6);
}

TEST(Sleeping, StaysWhereTheAwakeOneIs) {
    std::string without = stack();
    without.replace(without.find("sleeping"), without.find('\n', without.find("sleeping")) - without.find("sleeping"),
                    "");
    Running sleeper(parse_scene(stack(), "test")), awake(parse_scene(without, "test"));
    run_until(sleeper, 2.0);
    run_until(awake, 2.0);
    for (int k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_NEAR(sleeper.pose("box_" + std::to_string(k)).position[i],
                        awake.pose("box_" + std::to_string(k)).position[i], 1e-7);
    EXPECT_EQ(awake.simulation.record().sleeping, 0);
    EXPECT_EQ(awake.simulation.totals().resting_parts, 0);
}

TEST(Sleeping, BallWakesTheStackAndAllSleepAgain) {
    // It comes down on the top box after some 1.4 s.
    Running run(parse_scene(stack("  - {name: ball, density: 1000, position: [0.02, 0, 10], shapes: [{sphere: {radius: "
                                  "0.05}, material: stone}]}\n"),
                            "test"));
    run_until(run, 1.2);
    EXPECT_EQ(run.simulation.record().sleeping, 3);
    const double top = run.pose("box_2").position[2];
    while (run.simulation.record().sleeping == 3 && run.simulation.state().t < 3.0) run.simulation.step();
    EXPECT_EQ(run.simulation.record().sleeping, 0);
    EXPECT_NEAR(run.pose("ball").position[2], top + 0.1, 0.05);
    run_until(run, 1.6);
    EXPECT_NEAR(run.pose("ball").position[2], top + 0.1, 1e-6);
    run_until(run, 6.0);
    EXPECT_GE(run.simulation.record().sleeping, 3);  // the ball may roll on for long
}

TEST(Sleeping, SlopeTooSteepNeverSleeps) {
    // tan 20° = 0.364: one slips from rest with 0.06 m/s², the other holds.
    const auto scene = [](double friction) {
        return R"(
step: 0.002
end: 10
gravity: [3.3552, 0, -9.2184]
sleeping: {speed: 1.0e-3, time: 0.1}
solver: {law: coulomb}
materials: {stone: {friction: )" +
               std::to_string(friction) + R"(}}
bodies:
  - {name: ground, fixed: true, shapes: [{plane: {}, material: stone}]}
  - {name: box, density: 1000, position: [0, 0, 0.05], shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: stone}]}
)";
    };
    Running slips(parse_scene(scene(0.3574), "test")), holds(parse_scene(scene(0.37), "test"));
    while (slips.simulation.state().t < 2.0) EXPECT_EQ(slips.simulation.step().sleeping, 0);
    const double g = std::hypot(3.3552, 9.2184), angle = std::atan2(3.3552, 9.2184);
    const double way = 0.5 * g * (std::sin(angle) - 0.3574 * std::cos(angle)) * 4.0;
    EXPECT_GT(way, 0.1);
    EXPECT_NEAR(slips.pose("box").position[0], way, 0.01 * way);
    run_until(holds, 1.0);
    EXPECT_EQ(holds.simulation.record().sleeping, 1);
}

constexpr const char* pendulum = R"(
step: 0.002
end: 20
sleeping: {speed: 1.0e-2, time: 0.1}
bodies:
  - {name: bob, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [0.5, 0, -0.866]}
joints:
  - {name: hinge, kind: revolute, second: bob, point: [0, 0, 0], axis: [0, 1, 0]}
)";

TEST(Sleeping, PendulumAtItsTurningPointGoesOn) {
    Running run(parse_scene(pendulum, "test"));
    double highest = 0.0;
    while (run.simulation.state().t < 5.0) {
        EXPECT_EQ(run.simulation.step().sleeping, 0);
        if (run.simulation.state().t > 4.0) highest = std::max(highest, std::abs(run.velocities("bob")[0][0]));
    }
    EXPECT_GT(highest, 1.0);
}

TEST(Sleeping, SlowSwingThatWouldGoOnIsNoRest) {
    // 3e-3 rad beside the vertical: never faster than the limit, but its weight pulls it back.
    std::string scene = pendulum;
    scene.replace(scene.find("[0.5, 0, -0.866]"), 16, "[0.02, 0, -1]");
    scene.replace(scene.find("1.0e-2"), 6, "1.0e-1");
    scene.replace(scene.find("time: 0.1"), 9, "time: 1.0");
    Running run(parse_scene(scene, "test"));
    while (run.simulation.state().t < 1.1) EXPECT_EQ(run.simulation.step().sleeping, 0);
}

TEST(Sleeping, LoadThatVariesWakes) {
    // A push of t newtons moves nothing for some seconds, and yet nobody may sleep through it; a constant one is slept
    // on.
    Running varies(parse_scene(stack("", R"(
loads:
  - {name: push, body: box_0, force: [{linear: {start: 0, rate: 1}}, 0, 0]}
)"),
                               "test"));
    run_until(varies, 1.0);
    EXPECT_EQ(varies.simulation.record().sleeping, 0);
    Running constant(parse_scene(stack("", R"(
loads:
  - {name: push, body: box_0, force: [1, 0, 0]}
)"),
                                 "test"));
    run_until(constant, 1.0);
    EXPECT_EQ(constant.simulation.record().sleeping, 3);
}

TEST(Sleeping, SlowMotorGoesOn) {
    // A motor at the turning point of its sine, quiet for a while, then moving again.
    Running run(parse_scene(std::string(R"(
step: 0.002
end: 20
sleeping: {speed: 1.0e-3, time: 0.05}
bodies:
  - {name: arm, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [1, 0, 0]}
joints:
  - {name: hinge, kind: revolute, second: arm, point: [0, 0, 0], axis: [0, 1, 0]}
motors:
  - {name: drive, joint: hinge, motion: {sine: {amplitude: 0.02, frequency: 0.1}}}
)"),
                            "test"));
    double farthest = 0.0;
    while (run.simulation.state().t < 5.0) {
        EXPECT_EQ(run.simulation.step().sleeping, 0);
        farthest = std::max(farthest, std::abs(run.pose("arm").position[2]));
    }
    EXPECT_NEAR(farthest, std::sin(0.02), 1e-5);
}

TEST(Sleeping, SeesawTipsWhenAWeightIsLifted) {
    // Two weights on a seesaw; a rope pulls ever harder on one of them.
    Running run(parse_scene(head + R"(
bodies:
  - {name: ground, fixed: true, shapes: [{plane: {}, material: stone}]}
  - {name: pier, fixed: true, position: [0, 0, 0.05], shapes: [{box: {size: [0.02, 0.2, 0.1]}, material: stone}]}
  - {name: plank, density: 500, position: [0, 0, 0.11], shapes: [{box: {size: [1, 0.2, 0.02]}, material: stone}]}
  - {name: left, density: 1000, position: [-0.4, 0, 0.17], shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: stone}]}
  - {name: right, density: 1000, position: [0.4, 0, 0.17], shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: stone}]}
loads:
  - {name: rope, body: right, force: [0, 0, {sine: {amplitude: 10, frequency: 0.05}}]}
)",
                            "test"));
    run_until(run, 5.0);  // 10 N lift a weight of 9.81 N
    EXPECT_GT(run.pose("right").position[2], 0.2);
    EXPECT_LT(run.pose("left").position[2], 0.15);
}

TEST(Sleeping, BallWakesOneStackOfMany) {
    Running run(read_scene(example_scene("sleeping_stacks")));
    run_until(run, 0.6);
    const auto solves = run.simulation.totals().plugin_solves;
    run_until(run, 1.3);
    EXPECT_EQ(run.simulation.totals().plugin_solves, solves);
    std::int64_t fewest = run.simulation.record().sleeping;
    EXPECT_EQ(fewest, 108);
    while (!run.simulation.finished()) fewest = std::min(fewest, run.simulation.step().sleeping);
    EXPECT_LE(fewest, 105);
    EXPECT_GE(fewest, 96);
    EXPECT_GE(run.simulation.record().sleeping, 102);
}

std::vector<std::uint64_t> bits(const std::vector<double>& values) {
    std::vector<std::uint64_t> result;
    for (const double value : values) result.push_back(std::bit_cast<std::uint64_t>(value));
    return result;
}

TEST(Sleeping, ResumesToTheSameBits) {
    const std::string scene = stack(
        "  - {name: ball, density: 1000, position: [0.02, 0, 1], shapes: [{sphere: {radius: 0.05}, material: stone}]}\n"
        "  - {name: apart, density: 1000, position: [3, 0, 0.0501], shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: "
        "stone}]}\n");
    // In the middle of the quiet time, at the trial, asleep, and after the ball woke the stack.
    Running whole(parse_scene(scene, "test"));
    std::vector<SimulationState> states;
    std::vector<std::int64_t> sleeping;
    for (int i = 0; i < 400; ++i) {
        states.push_back(whole.simulation.save());
        sleeping.push_back(whole.simulation.step().sleeping);
    }
    EXPECT_EQ(*std::max_element(sleeping.begin(), sleeping.end()), 5);
    const auto first = std::find(sleeping.begin(), sleeping.end(), 1) - sleeping.begin();
    ASSERT_LT(first, 390);
    const ScratchFolder scratch;
    const SimulationState expected = whole.simulation.save();
    for (const std::ptrdiff_t from : {first - 20, first - 1, first, first + 1, first + 10, std::ptrdiff_t{250}}) {
        Running resumed(parse_scene(scene, "test"));
        write_checkpoint({"scene", {{"main", states[static_cast<std::size_t>(from)], {}}}},
                         scratch / "checkpoint.json");
        resumed.simulation.load(read_checkpoint(scratch / "checkpoint.json").systems[0].simulation);
        for (std::ptrdiff_t i = from; i < 400; ++i)
            EXPECT_EQ(resumed.simulation.step().sleeping, sleeping[static_cast<std::size_t>(i)]) << from << " " << i;
        const SimulationState got = resumed.simulation.save();
        EXPECT_EQ(bits(got.state.q), bits(expected.state.q)) << from;
        EXPECT_EQ(bits(got.state.v), bits(expected.state.v)) << from;
        EXPECT_EQ(bits(got.stepping.method), bits(expected.stepping.method)) << from;
        EXPECT_EQ(bits(got.sleeping), bits(expected.sleeping)) << from;
        EXPECT_EQ(got.totals.solver_iterations, expected.totals.solver_iterations) << from;
    }
}

std::string refusal(const std::string& yaml, const std::string& integrator = "") {
    SceneOverrides overrides;
    overrides.integrator = integrator;
    try {
        Running run(parse_scene(yaml, "test", overrides));
    } catch (const Error& error) {
        return error.what();
    }
    return "taken";
}

TEST(Sleeping, RefusesWhatCannotSleep) {
    EXPECT_EQ(
        refusal(pendulum, "trapezoidal"),
        "system \"main\": trapezoidal cannot leave out bodies that sleep. Can: euler_implicit_linearized; or remove "
        "\"sleeping\"");
    std::string adaptive = pendulum;
    adaptive.replace(adaptive.find("step: 0.002"), 11, "tolerance: 0.01");
    EXPECT_EQ(refusal(adaptive),
              "system \"main\": bodies may sleep with a fixed step only; give a \"step\" instead of a \"tolerance\"");
    std::string negative = pendulum;
    negative.replace(negative.find("1.0e-2"), 6, "-1");
    EXPECT_NE(refusal(negative).find("test, line 4: \"speed\" is -1"), std::string::npos) << refusal(negative);
}

}  // namespace
}  // namespace delassus::tests::sleeping_test
#endif
