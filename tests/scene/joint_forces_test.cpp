// SPDX-License-Identifier: BSD-3-Clause
// Springs, damping and dry friction of joints, and actuators, against closed forms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::joint_forces_test {
namespace {

constexpr double pi = std::numbers::pi;

/// A disc of J = 2 kg m² about z on a hinge with the world, turning with `speed`.
std::string disc(const std::string& joint, double speed, const std::string& more = "", double step = 1e-3,
                 const std::string& integrator = "euler_implicit_linearized") {
    return fmt::format(
        "step: {}\nend: 100\ngravity: [0, 0, 0]\nintegrator: {}\n"
        "bodies: [{{name: disc, mass: 1, inertia: {{xx: 1, yy: 1.5, zz: 2}}, angular_velocity: [0, 0, {}]}}]\n"
        "joints: [{{name: hinge, kind: revolute, second: disc, axis: [0, 0, 1], {}}}]\n{}",
        step, integrator, speed, joint, more);
}

/// Of the disc, over whole turns: summed up from step to step.
struct Turning {
    Running run;
    double angle = 0.0, last = 0.0;

    explicit Turning(const std::string& yaml) : run(parse_scene(yaml, "s")) {}
    void until(double t) {
        while (run.simulation.state().t < t - 1e-9) {
            run.simulation.step();
            const auto q = run.pose("disc").orientation;
            const double now = 2.0 * std::atan2(q[3], q[0]);
            angle += std::remainder(now - last, 2.0 * pi);
            last = now;
        }
    }
    [[nodiscard]] double speed() const { return run.velocities("disc")[1][2]; }
};

// θ = ω₀/ω_d exp(−δ t) sin(ω_d t) with δ = c/2J, ω_d² = k/J − δ²; the amplitude is more than two turns.
TEST(JointSpring, SwingsAndDecaysOverWholeTurns) {
    constexpr double J = 2.0, k = 8.0, c = 0.8, start = 30.0;
    const double delta = c / (2.0 * J), omega = std::sqrt(k / J - delta * delta);
    const auto exact = [&](double t) { return start / omega * std::exp(-delta * t) * std::sin(omega * t); };
    ASSERT_GT(exact(0.25 * pi), 3.5 * pi);
    const auto error = [&](const std::string& integrator, double step) {
        Turning disc_of(disc("damping: 0.8, spring: {stiffness: 8}", start, "", step, integrator));
        disc_of.until(2.0);
        return disc_of.angle - exact(2.0);
    };
    for (const std::string integrator : {"trapezoidal", "generalized_alpha"}) {
        const double coarse = error(integrator, 2e-3), fine = error(integrator, 1e-3);
        EXPECT_LT(std::abs(fine), 1e-4) << integrator;
        EXPECT_NEAR(std::log2(std::abs(coarse / fine)), 2.0, 0.1) << integrator;
    }
    const double coarse = error("euler_implicit_linearized", 1e-3), fine = error("euler_implicit_linearized", 5e-4);
    EXPECT_LT(std::abs(fine), 0.02);
    EXPECT_LT(std::abs(2.0 * fine - coarse), 2e-4);  // extrapolated
}

TEST(JointSpring, RestsWhereItIsToldAndKeepsEnergy) {
    Turning swing(disc("spring: {stiffness: 8, rest: 7}", 0.0, "", 1e-3, "trapezoidal"));
    const double start = swing.run.simulation.record().energy;
    EXPECT_NEAR(start, 0.5 * 8.0 * 49.0, 1e-12);
    swing.until(pi / 2.0);  // half a period of √(J/k): θ = 7 − 7 cos(2 t)
    EXPECT_NEAR(swing.angle, 14.0, 1e-4);
    EXPECT_NEAR(swing.run.simulation.record().energy, start, 1e-9 * start);
}

// Dry friction T stops the disc after J ω₀/T at J ω₀²/2T. The implicit Euler method takes the speed at the end of each
// step, so that the angle is short by h ω₀/2.
TEST(JointFriction, StopsADiscExactly) {
    constexpr double J = 2.0, T = 4.0, start = 3.0, h = 1e-3;
    Turning turning(disc("friction: 4", start, "solver: {tolerance: 1.0e-12}", h));
    turning.until(1.0);
    EXPECT_NEAR(turning.speed(), start - T / J * 1.0, 1e-9);
    turning.until(J * start / T + h);
    EXPECT_NEAR(turning.angle, 0.5 * J * start * start / T - 0.5 * h * start, 1e-7);
    EXPECT_NEAR(turning.speed(), 0.0, 1e-10);
    const double stopped = turning.angle;
    turning.until(3.0);
    EXPECT_NEAR(turning.angle, stopped, 1e-12);
}

TEST(JointFriction, HoldsBelowItsBoundAndSlipsAbove) {
    const auto pulled = [](double torque) {
        Turning turning(
            disc("friction: 4", 0.0, fmt::format("loads: [{{name: m, body: disc, torque: [0, 0, {}]}}]", torque)));
        turning.until(1.0);
        return turning.speed();
    };
    EXPECT_NEAR(pulled(3.99), 0.0, 1e-10);
    EXPECT_NEAR(pulled(4.5), 0.5 / 2.0, 1e-9);
    EXPECT_NEAR(pulled(-5.0), -1.0 / 2.0, 1e-9);
}

// A block of 2 kg on a rail along x and y = 0: with damping alone v = v₀ exp(−c t/m).
TEST(JointDamping, SlowsASlide) {
    SceneOverrides overrides;
    overrides.integrator = "trapezoidal";
    Running run(
        parse_scene("step: 0.001\nend: 1\ngravity: [0, 0, -9.81]\n"
                    "bodies: [{name: block, mass: 2, inertia: {xx: 1, yy: 1, zz: 1}, velocity: [3, 0, 0]}]\n"
                    "joints: [{name: rail, kind: prismatic, second: block, axis: [1, 0, 0], damping: 4}]\n",
                    "s", overrides));
    run.finish();
    EXPECT_NEAR(run.velocities("block")[0][0], 3.0 * std::exp(-2.0), 1e-6);
    EXPECT_NEAR(run.pose("block").position[0], 1.5 * (1.0 - std::exp(-2.0)), 1e-6);
}

// Along the axis a spring of 18 N/m and 2 kg, ω = 3; about it damping 4 Nms and J = 2 kg m².
TEST(JointForces, OfACylindricalJointActInEachCoordinate) {
    SceneOverrides overrides;
    overrides.integrator = "trapezoidal";
    Running run(
        parse_scene("step: 0.001\nend: 1\ngravity: [0, 0, 0]\n"
                    "bodies: [{name: rod, mass: 2, inertia: {xx: 1, yy: 1, zz: 2}, velocity: [0, 0, 1.5],\n"
                    "          angular_velocity: [0, 0, 2]}]\n"
                    "joints: [{name: sleeve, kind: cylindrical, second: rod,\n"
                    "          slide: {spring: {stiffness: 18}}, turn: {damping: 4}}]\n",
                    "s", overrides));
    run.finish();
    EXPECT_NEAR(run.pose("rod").position[2], 0.5 * std::sin(3.0), 1e-5);
    EXPECT_NEAR(run.velocities("rod")[1][2], 2.0 * std::exp(-2.0), 1e-5);
}

// A sphere on a ball joint in its centre: ω = ω₀ exp(−c t/J) about any axis.
TEST(JointDamping, SlowsABallJoint) {
    SceneOverrides overrides;
    overrides.integrator = "trapezoidal";
    Running run(
        parse_scene("step: 0.001\nend: 1\ngravity: [0, 0, 0]\n"
                    "bodies: [{name: ball, mass: 1, inertia: {xx: 2, yy: 2, zz: 2}, angular_velocity: [1, 2, 3]}]\n"
                    "joints: [{name: socket, kind: spherical, second: ball, damping: 3}]\n",
                    "s", overrides));
    run.finish();
    for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(run.velocities("ball")[1][k], static_cast<double>(k + 1) * std::exp(-1.5), 1e-5);
}

// Two bodies on one hinge: the damping acts on the relative angle alone, and keeps the momentum.
TEST(JointDamping, ActsBetweenTwoBodies) {
    SceneOverrides overrides;
    overrides.integrator = "trapezoidal";
    Running run(
        parse_scene("step: 0.001\nend: 1\ngravity: [0, 0, 0]\nbodies:\n"
                    "  - {name: one, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, angular_velocity: [0, 0, 3]}\n"
                    "  - {name: two, mass: 1, inertia: {xx: 2, yy: 2, zz: 2}}\n"
                    "joints: [{name: hinge, kind: revolute, first: one, second: two, damping: 2}]\n",
                    "s", overrides));
    run.finish();
    const double one = run.velocities("one")[1][2], two = run.velocities("two")[1][2];
    EXPECT_NEAR(one + 2.0 * two, 3.0, 1e-9);
    EXPECT_NEAR(one - two, 3.0 * std::exp(-2.0 * (1.0 + 0.5)), 1e-5);
}

// ---- Actuators ----

// kp (φ − θ) − kd θ̇ = J θ̈ from rest: ω² = kp/J, ζ = kd/(2 √(kp J)).
TEST(Actuator, AnswersAStepAsItsGainsSay) {
    constexpr double J = 2.0, kp = 50.0, kd = 4.0, target = 9.0;
    const double delta = kd / (2.0 * J), omega = std::sqrt(kp / J - delta * delta);
    const auto exact = [&](double t) {
        return target * (1.0 - std::exp(-delta * t) * (std::cos(omega * t) + delta / omega * std::sin(omega * t)));
    };
    const std::string servo = "actuators: [{name: servo, joint: hinge, position: 9, kp: 50, kd: 4}]";
    Turning exactly(disc("", 0.0, servo, 1e-3, "trapezoidal"));
    exactly.until(0.7);
    EXPECT_NEAR(exactly.angle, exact(0.7), 1e-4);
    // A limit that is not reached changes nothing but rounding.
    Turning free(disc("", 0.0, servo)), limited(disc("", 0.0,
                                                     "actuators: [{name: servo, joint: hinge, position: 9, "
                                                     "kp: 50, kd: 4, limit: 1.0e6}]\nsolver: {tolerance: 1.0e-12}"));
    for (auto* one : {&free, &limited}) one->until(0.7);
    EXPECT_NEAR(free.angle, exact(0.7), 0.05);
    EXPECT_NEAR(limited.angle, free.angle, 1e-8);
}

// From rest to 9 rad with at most 5 Nm: θ = (limit/2J) t² until kp (9 − θ) − kd θ̇ falls to the limit.
TEST(Actuator, GivesJustItsLimitWhereItWantsMore) {
    Turning turning(disc("", 0.0,
                         "actuators: [{name: servo, joint: hinge, position: 9, kp: 50, kd: 60, limit: 5}]\n"
                         "solver: {tolerance: 1.0e-12}"));
    turning.until(1.5);
    EXPECT_NEAR(turning.speed(), 5.0 / 2.0 * 1.5, 1e-8);
    EXPECT_NEAR(turning.angle, 0.5 * 2.5 * 1.5 * 1.5, 0.5 * 1e-3 * 3.75 + 1e-7);
    turning.until(20.0);
    EXPECT_NEAR(turning.angle, 9.0, 1e-3);
}

TEST(Actuator, HoldsASpeed) {
    // kd (3 − ω) = J ω̇: ω = 3 (1 − exp(−kd t/J)).
    Turning turning(disc("", 0.0, "actuators: [{name: servo, joint: hinge, speed: 3, kd: 4}]", 1e-3, "trapezoidal"));
    turning.until(1.0);
    EXPECT_NEAR(turning.speed(), 3.0 * (1.0 - std::exp(-2.0)), 1e-5);
}

TEST(Actuator, IsStableAtAnyGains) {
    for (const std::string limit : {"", ", limit: 1.0e9"}) {
        Turning turning(disc("", 0.0,
                             "actuators: [{name: servo, joint: hinge, position: {sine: {amplitude: 2, "
                             "frequency: 0.5}}, kp: 1.0e10, kd: 1.0e6" +
                                 limit + "}]",
                             0.01));
        turning.until(1.5);
        EXPECT_NEAR(turning.angle, -2.0, 1e-3) << limit;
    }
}

// A slide against gravity: in balance kp (p − s) = m g.
TEST(Actuator, CarriesAWeightOnASlide) {
    Running run(
        parse_scene("step: 0.01\nend: 20\n"
                    "bodies: [{name: lift, mass: 2, inertia: {xx: 1, yy: 1, zz: 1}}]\n"
                    "joints: [{name: rail, kind: prismatic, second: lift, axis: [0, 0, 1]}]\n"
                    "actuators: [{name: jack, joint: rail, position: 1, kp: 100, kd: 40, limit: 1000}]\n",
                    "s"));
    run.finish();
    EXPECT_NEAR(run.pose("lift").position[2], 1.0 - 2.0 * 9.81 / 100.0, 1e-6);
}

TEST(JointForces, AreInThePlan) {
    Scene scene = parse_scene(
        disc("friction: 4, damping: 1", 1.0, "actuators: [{name: servo, joint: hinge, speed: 3, kd: 4, limit: 2}]"),
        "s");
    const auto plan = make_plan(scene, registry()).front();
    const auto kept = [&](const std::string& what) {
        return std::any_of(plan.kept.begin(), plan.kept.end(), [&](const auto& line) { return line.what == what; });
    };
    EXPECT_TRUE(kept("1 joint with dry friction"));
    EXPECT_TRUE(kept("1 joint with a spring or damping"));
    EXPECT_TRUE(kept("actuator \"servo\" as a box row with a compliance"));
}

// Parts of a problem with a compliance are solved apart as well.
TEST(Actuator, KeepsIslandsApart) {
    std::string yaml = "step: 0.001\nend: 0.3\ngravity: [0, 0, 0]\nbodies:\n";
    for (const char* name : {"disc", "other", "third"})
        yaml += fmt::format("  - {{name: {}, mass: 1, inertia: {{xx: 1, yy: 1, zz: 2}}}}\n", name);
    yaml += "joints:\n";
    for (const char* name : {"disc", "other", "third"})
        yaml += fmt::format("  - {{name: hinge_{0}, kind: revolute, second: {0}}}\n", name);
    yaml +=
        "actuators:\n"
        "  - {name: a, joint: hinge_disc, position: 9, kp: 50, kd: 4, limit: 5}\n"
        "  - {name: b, joint: hinge_third, position: -9, kp: 50, kd: 4, limit: 7}\n";
    // In joint coordinates two angles have a row. In maximal ones each body is three parts, as it is in its mass centre
    // that it is held: where it is, its axis, and its angle if an actuator acts on it.
    Scene scene = parse_scene(yaml, "s"), maximal = parse_scene("coordinates: maximal\n" + yaml, "s");
    EXPECT_EQ(make_plan(scene, registry()).front().parts, 2);
    EXPECT_EQ(make_plan(maximal, registry()).front().parts, 8);
    Running run(parse_scene(yaml, "s"));
    run.finish();
    EXPECT_NEAR(run.velocities("disc")[1][2], 0.3 * 2.5, 1e-9);
    EXPECT_NEAR(run.velocities("other")[1][2], 0.0, 1e-12);
    EXPECT_NEAR(run.velocities("third")[1][2], -0.3 * 3.5, 1e-9);
}

}  // namespace
}  // namespace delassus::tests::joint_forces_test
