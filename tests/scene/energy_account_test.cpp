// SPDX-License-Identifier: BSD-3-Clause
// What supplies energy and what takes it, step by step (simulation/energy_guard.hpp), held against closed forms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/scenes.hpp"

namespace delassus::tests::energy_account_test {
namespace {

constexpr double g = 9.81;

Running finished(const std::string& yaml, const std::string& integrator = {}) {
    SceneOverrides overrides;
    overrides.integrator = integrator;
    Running run(parse_scene(yaml, "account", overrides));
    run.finish();
    return run;
}

double change_of_energy(const Running& run) {
    return run.simulation.totals().energy - run.simulation.totals().start_energy;
}

const std::string ball = "inertia: {xx: 0.1, yy: 0.1, zz: 0.1}";

TEST(EnergyAccount, ALoadSuppliesForceTimesWay) {
    Running run = finished(
        "step: 0.007\nend: 1.7\nmaterials: {m: {friction: 0.6}}\nbodies:\n"
        "  - {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "  - {name: wheel, mass: 2.3, position: [0, 0, 0.21], orientation: {axis: [1, 0, 0], angle: 90},\n"
        "     shapes: [{cylinder: {radius: 0.21, length: 0.1}, material: m}]}\n"
        "loads: [{name: pull, body: wheel, force: [4, 0, 0]}]\n");
    const SimulationTotals& totals = run.simulation.totals();
    EXPECT_NEAR(totals.supplied, 4.0 * run.pose("wheel").position[0], 1e-9);
    EXPECT_NEAR(totals.work, 0.0, 1e-9);
    EXPECT_NEAR(totals.rest, 0.0, 1e-9);
}

TEST(EnergyAccount, ABeltSuppliesWhatItsFrictionCarries) {
    // Momentum m V at the speed V of the belt; the slide takes half of m times the square of the first difference.
    Running run = finished(
        "step: 0.009\nend: 1.3\nmaterials: {m: {friction: 0.35}}\nbodies:\n"
        "  - {name: belt, motion: {translation: [{linear: {rate: 1.7}}, 0, 0]}, position: [0, 0, -0.1],\n"
        "     shapes: [{box: {size: [20, 2, 0.2]}, material: m}]}\n"
        "  - {name: b, mass: 2, position: [0, 0, 0.15], velocity: [0, 0.4, 0],\n"
        "     shapes: [{box: {size: [0.3, 0.3, 0.3]}, material: m}]}\n");
    const SimulationTotals& totals = run.simulation.totals();
    EXPECT_NEAR(totals.supplied, 2.0 * 1.7 * 1.7, 1e-4);
    EXPECT_NEAR(totals.work, -0.5 * 2.0 * (1.7 * 1.7 + 0.4 * 0.4), 1e-4);
    EXPECT_NEAR(totals.rest, 0.0, 1e-8);
}

TEST(EnergyAccount, ARiderOnATurntableTakesNoneWhileItStays) {
    Running run = finished(
        "step: 0.016\nend: 3\nmaterials: {m: {friction: 0.5}}\nbodies:\n"
        "  - {name: table, motion: {rotation: {angle: {linear: {rate: 2}}}}, position: [0, 0, -0.05],\n"
        "     shapes: [{cylinder: {radius: 2, length: 0.1}, material: m}]}\n"
        "  - {name: b, mass: 13.5, position: [1, 0, 0.15], velocity: [0, 2, 0], angular_velocity: [0, 0, 2],\n"
        "     shapes: [{box: {size: [0.3, 0.3, 0.3]}, material: m}]}\n");
    EXPECT_NEAR(change_of_energy(run), 0.0, 0.01);
    EXPECT_LT(run.simulation.totals().growth_share, 1e-4);
    EXPECT_TRUE(run.simulation.warnings().empty());
}

TEST(EnergyAccount, ABallThatRollsOnATurntableLosesNothing) {
    // Its centre goes round in a circle at 2/7 of the table's rate. The contact moves along the table: the speed of the
    // table there does not change as that of a point of the table does.
    for (const double h : {0.007, 0.03}) {
        Running run = finished(fmt::format(
            "step: {}\nend: 4.2\nmaterials: {{m: {{friction: 1.4}}}}\nbodies:\n"
            "  - {{name: table, motion: {{rotation: {{angle: {{linear: {{rate: 1.7}}}}}}}}, position: [0, 0, -0.05],\n"
            "     shapes: [{{cylinder: {{radius: 4, length: 0.1}}, material: m}}]}}\n"
            "  - {{name: b, mass: 0.7, position: [0.6, 0.2, 0.11], velocity: [0.3, -0.25, 0],\n"
            "     angular_velocity: [11.5454545454545454, 5.8181818181818182, 0.9],\n"
            "     shapes: [{{sphere: {{radius: 0.11}}, material: m}}]}}\n",
            h));
        const SimulationTotals& totals = run.simulation.totals();
        EXPECT_NEAR(totals.supplied, change_of_energy(run), 1e-3) << h;
        EXPECT_NEAR(totals.work, 0.0, 1e-3) << h;
        EXPECT_LT(totals.growth_share, 1e-3) << h;
        EXPECT_TRUE(run.simulation.warnings().empty()) << h;
    }
}

TEST(EnergyAccount, BouncesTakeTheirShare) {
    // From 1 m with e = ½: what is left after every bounce is a quarter.
    Running run = finished(
        "step: 0.005\nend: 0.7\nmaterials: {m: {restitution: 0.5}}\nbodies:\n"
        "  - {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "  - {name: b, mass: 2, position: [0, 0, 1.1], shapes: [{sphere: {radius: 0.1}, material: m}]}\n");
    EXPECT_NEAR(run.simulation.totals().work, -0.75 * 2.0 * g, 1e-6);
    EXPECT_NEAR(run.simulation.totals().rest, 0.0, 1e-6);
}

class MotorOfAFlywheel : public testing::TestWithParam<const char*> {};

TEST_P(MotorOfAFlywheel, SuppliesItsEnergy) {
    const std::string wheel = "gravity: [0, 0, 0]\nbodies: [{name: w, mass: 1, " + ball +
                              "}]\njoints: [{name: j, kind: revolute, second: w}]\n";
    const std::string coordinates = fmt::format("coordinates: {}\n", GetParam());
    Running ramp = finished("step: 0.01\nend: 1.2\n" + coordinates + wheel +
                                "motors: [{name: m, joint: j, speed: true, motion: {ramp: {to: 8, duration: 1}}}]\n",
                            "moreau_jean");
    EXPECT_NEAR(ramp.simulation.totals().supplied, 0.5 * 0.1 * 64.0, 1e-3);
    EXPECT_NEAR(ramp.simulation.totals().rest, 0.0, 1e-3);
    // At its limit of 0.5 N m it turns by 5 rad/s² up to 8 rad/s, and slips by as much as the wheel turns.
    Running limited = finished("step: 0.01\nend: 2\n" + coordinates + wheel +
                                   "motors: [{name: m, joint: j, speed: true, motion: 8, force_limit: 0.5}]\n",
                               "moreau_jean");
    EXPECT_NEAR(limited.simulation.totals().supplied, 0.5 * 8.0 * 1.6, 1e-2);
    EXPECT_NEAR(limited.simulation.totals().work, -0.5 * 0.5 * 8.0 * 1.6, 1e-2);
    Running servo = finished("step: 0.01\nend: 0.5\n" + coordinates + wheel +
                                 "actuators: [{name: m, joint: j, position: 1, kp: 2, kd: 0.1}]\n",
                             "moreau_jean");
    EXPECT_NEAR(servo.simulation.totals().supplied, change_of_energy(servo), 1e-10);
    EXPECT_GT(change_of_energy(servo), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Coordinates, MotorOfAFlywheel, testing::Values("maximal", "joint"),
                         [](const auto& one) { return std::string(one.param); });

TEST(EnergyAccount, AHandSuppliesThroughSpringsAndDampers) {
    const std::string hand =
        "gravity: [0, 0, 0]\nbodies:\n"
        "  - {name: hand, motion: {translation: [{linear: {rate: 0.5}}, 0, 0]}}\n"
        "  - {name: b, mass: 1, position: [1, 0, 0], " +
        ball + "}\n";
    // On a spring the relative speed is V cos ω t.
    Running spring =
        finished("step: 0.01\nend: 0.37\n" + hand + "springs: [{name: s, first: hand, second: b, stiffness: 9}]\n",
                 "linearly_implicit_trapezoidal");
    EXPECT_NEAR(spring.simulation.totals().supplied, 0.25 * (1.0 - std::cos(3.0 * 0.37)), 1e-4);
    EXPECT_NEAR(spring.simulation.totals().rest, 0.0, 1e-6);
    // By a damper m v' = c (V − v): the hand gives m V v, of which the body has ½ m v².
    Running damper =
        finished("step: 0.01\nend: 0.37\n" + hand + "springs: [{name: s, first: hand, second: b, damping: 2}]\n",
                 "linearly_implicit_trapezoidal");
    const double v = 0.5 * (1.0 - std::exp(-2.0 * 0.37));
    EXPECT_NEAR(damper.simulation.totals().supplied, 0.5 * v, 1e-5);
    EXPECT_NEAR(damper.simulation.totals().rest, 0.5 * v * v - 0.5 * v, 1e-5);
}

// Two distances to points far outside of a small body that spins: it passes where they act alike. The method loses most
// of the energy there, which a servo beside it, that could have taken some, must not hide.
TEST(EnergyAccount, ALossBesideAServoIsSeen) {
    Running run = finished(
        "step: 0.005\nend: 0.15\nbodies:\n"
        "  - {name: w, mass: 0.001, position: [0.005, 0.0975, 0.6], inertia: {xx: 2.6e-5, yy: 0.9e-5, zz: 2.5e-5}}\n"
        "  - {name: b, mass: 0.1, position: [0.986647, 0, 0.6], angular_velocity: [14.129261, 14.955379, 15.809894],\n"
        "     inertia: {xx: 0.000503121761861, yy: 0.0008562708411531, zz: 0.0006038143971503}}\n"
        "joints:\n"
        "  - {name: p, kind: distance, second: b, point: [1.461764, 0.071729, 0.333581],\n"
        "     second_point: [1.121933, 0.445448, 0.660822]}\n"
        "  - {name: q, kind: distance, second: b, point: [1.847704, 0.28174, -0.010789],\n"
        "     second_point: [1.847704, 0.28174, -0.298039]}\n"
        "  - {name: j, kind: revolute, second: w, point: [0.08537, 0.267958, 0.743156], axis: [0, 1, 0]}\n"
        "motors: [{name: m, joint: j, speed: true, motion: 0.1, force_limit: 6}]\n");
    const SimulationTotals& totals = run.simulation.totals();
    ASSERT_LT(totals.rest, -0.05 * totals.start_energy);
    const auto sentences = run.simulation.warnings();
    EXPECT_TRUE(std::ranges::any_of(sentences, [](const std::string& sentence) {
        return sentence.find("the energy fell by") != std::string::npos;
    })) << testing::PrintToString(sentences);
}

// Long links that turn by 1/3 rad a step gain energy with moreau_jean, whatever else a load does.
TEST(EnergyAccount, AGrowthBesideALoadIsSeen) {
    const std::string chain =
        "step: 0.05\nend: 3\nbodies:\n  - {name: a, mass: 1, position: [1, 0, 0], " + ball +
        "}\n  - {name: b, mass: 1, position: [2, 0, 0], " + ball +
        "}\njoints:\n  - {name: p, kind: revolute, second: a, axis: [0, 1, 0]}\n"
        "  - {name: q, kind: revolute, first: a, second: b, point: [1.5, 0, 0], axis: [0, 1, 0]}\n"
        "loads: [{name: f, body: a, force: [0, 0, 0.5]}]\n";
    Running long_steps = finished(chain, "moreau_jean");
    EXPECT_GT(long_steps.simulation.totals().growth_share, 0.03);
    ASSERT_EQ(long_steps.simulation.warnings().size(), 1U);
    EXPECT_NE(long_steps.simulation.warnings()[0].find("beyond what loads"), std::string::npos)
        << long_steps.simulation.warnings()[0];
    // Methods that do not account for it say nothing.
    Running damped = finished(chain, "euler_implicit");
    EXPECT_TRUE(std::isnan(damped.simulation.totals().supplied));
    EXPECT_EQ(damped.simulation.totals().growth, 0.0);
}

}  // namespace
}  // namespace delassus::tests::energy_account_test
