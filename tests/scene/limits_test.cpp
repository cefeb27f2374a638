// SPDX-License-Identifier: BSD-3-Clause
// Where a run must not go on: energy that nothing supplies, drift, a linear model that is far off, turns that cannot be
// told (docs/running.md, docs/integrators.md).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "delassus/error.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::limits_test {
namespace {

constexpr double g = 9.81;

Running running(const std::string& yaml, const std::string& integrator, double step,
                std::vector<std::pair<std::string, std::string>> values = {}) {
    SceneOverrides overrides;
    overrides.integrator = integrator;
    overrides.step = step;
    overrides.values = std::move(values);
    return Running(parse_scene(yaml, "limits", overrides));
}

/// The sentence of the step that fails; empty if none does.
std::string failure_of(Running& run) {
    try {
        run.finish();
    } catch (const StepFailure& failure) {
        return failure.what();
    }
    return {};
}

bool says(const std::string& sentence, const std::string& part) {
    return sentence.find(part) != std::string::npos;
}

// A bob of 1 kg on a spring of 1 m, let go from the horizontal.
std::string spring_pendulum(double stiffness) {
    return "step: 0.001\nend: 0.5\n"
           "bodies: [{name: bob, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [1, 0, 0]}]\n"
           "springs: [{name: rod, second: bob, first_point: [0, 0, 0], stiffness: " +
           std::to_string(stiffness) + "}]\n";
}

constexpr const char* pendulum =
    "step: 0.001\nend: 10\n"
    "bodies: [{name: bob, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [1, 0, 0]}]\n"
    "joints: [{name: hinge, kind: revolute, second: bob, point: [0, 0, 0], axis: [0, 1, 0]}]\n";

constexpr const char* brick =
    "step: 0.001\nend: 0.1\ngravity: [0, 0, 0]\n"
    "bodies: [{name: brick, mass: 1, inertia: {xx: 1, yy: 2, zz: 3}, angular_velocity: [100, 0, 1.0e4]}]\n";

// ---- Energy ----

TEST(EnergyGuard, EndsARunBeyondTheStabilityLimitWithItsLastGoodState) {
    // h ω = 1: explicit Euler multiplies the oscillation by √2 a step.
    Running run = running(spring_pendulum(1e6), "euler_explicit", 0.001);
    const std::string sentence = failure_of(run);
    EXPECT_TRUE(says(sentence, "nothing supplies any")) << sentence;
    EXPECT_TRUE(says(sentence, "too long for euler_explicit")) << sentence;
    const Simulation& simulation = run.simulation;
    EXPECT_GT(simulation.record().step, 5);
    EXPECT_LT(simulation.state().t, 0.2);
    // All is as before the step that failed: the energy has not yet grown by what can have moved.
    EXPECT_EQ(simulation.record().energy, simulation.totals().energy);
    EXPECT_EQ(simulation.record().energy, run.system().energy(simulation.state()));
    EXPECT_LT(simulation.totals().growth_share, 1.0);
    EXPECT_NEAR(simulation.state().t, 0.001 * static_cast<double>(simulation.record().step), 1e-12);
}

TEST(EnergyGuard, TrapezoidalRuleWithAJointEndsWithAReason) {
    Running run = running(pendulum, "trapezoidal", 0.01);
    const std::string sentence = failure_of(run);
    EXPECT_TRUE(says(sentence, "nothing supplies any")) << sentence;
    // 9.81 J can have moved, so no more than twice that was ever taken for good.
    EXPECT_LT(run.simulation.totals().energy, 2.1 * g);
}

TEST(EnergyGuard, IsSwitchedOffByNull) {
    Running run = running(spring_pendulum(1e6), "euler_explicit", 0.001, {{"limits", "{energy_growth: null}"}});
    EXPECT_EQ(failure_of(run), "");
    EXPECT_GT(run.simulation.totals().energy, 1e100);
}

TEST(EnergyGuard, LeavesMotorsAndLoadsAlone) {
    Running motor =
        running(std::string(pendulum) +
                    "motors: [{name: m, joint: hinge, motion: {linear: {start: 0, rate: 5}}, speed: true}]\n",
                "euler_implicit_linearized", 0.001, {{"end", "2"}});
    EXPECT_EQ(failure_of(motor), "");
    Running load = running(std::string(pendulum) + "loads: [{name: f, body: bob, torque: [0, -50, 0]}]\n", "hht", 0.001,
                           {{"end", "1"}});
    EXPECT_EQ(failure_of(load), "");
    EXPECT_GT(load.simulation.totals().energy, 20.0);
}

TEST(EnergyGuard, WarnsOfAGrowthThatIsSeen) {
    // An oscillation of ω = 10 rad/s grows by (1 + h²ω²)^(1/2) a step, its energy by e^(0.5) − 1 = 65 % in 1/2 s at 10
    // ms.
    const std::string block =
        "step: 0.01\nend: 0.5\ngravity: [0, 0, 0]\n"
        "bodies: [{name: b, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, velocity: [1, 0, 0]}]\n"
        "bushings: [{name: m, second: b, point: [0, 0, 0], stiffness: [100, 100, 100]}]\n";
    Running run = running(block, "euler_explicit", 0.01);
    EXPECT_EQ(failure_of(run), "");
    EXPECT_NEAR(run.simulation.totals().growth_share, std::exp(0.5) - 1.0, 0.05);
    ASSERT_EQ(run.simulation.warnings().size(), 1U);
    EXPECT_TRUE(says(run.simulation.warnings()[0], "the energy rose")) << run.simulation.warnings()[0];
    Running fine = running(block, "rk4", 0.01);
    EXPECT_EQ(failure_of(fine), "");
    EXPECT_TRUE(fine.simulation.warnings().empty());
}

TEST(EnergyGuard, WarnsOfALossThatIsSeen) {
    // Implicit Euler divides the energy of ω = 10 rad/s by 1 + h²ω² a step: e^(−0.5) is left after 1/2 s at 10 ms.
    const std::string block =
        "step: 0.01\nend: 0.5\ngravity: [0, 0, 0]\n"
        "bodies: [{name: b, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, velocity: [1, 0, 0]}]\n";
    const std::string spring = "bushings: [{name: m, second: b, point: [0, 0, 0], stiffness: [100, 100, 100]";
    Running run = running(block + spring + "}]\n", "euler_implicit_linearized", 0.01);
    EXPECT_EQ(failure_of(run), "");
    ASSERT_EQ(run.simulation.warnings().size(), 1U);
    EXPECT_TRUE(says(run.simulation.warnings()[0], "the energy fell by 0.19")) << run.simulation.warnings()[0];
    const auto& totals = run.simulation.totals();
    EXPECT_NEAR(totals.damped, totals.start_energy - totals.energy, 1e-12);
    Running quiet = running(block + spring + "}]\n", "rk4", 0.01);
    EXPECT_EQ(failure_of(quiet), "");
    EXPECT_TRUE(quiet.simulation.warnings().empty()) << quiet.simulation.warnings()[0];
    Running damped = running(block + spring + ", damping: [1, 1, 1]}]\n", "euler_implicit_linearized", 0.01);
    EXPECT_EQ(failure_of(damped), "");
    ASSERT_EQ(damped.simulation.warnings().size(), 1U);
    EXPECT_TRUE(says(damped.simulation.warnings()[0], "from vibrations")) << damped.simulation.warnings()[0];
}

// A damper takes c v² and the floor what a body has when it lands: the method's share of the loss is what is left.
TEST(EnergyGuard, TellsItsLossFromThatOfDampersAndContacts) {
    const double h = 0.01, m = 2.0, k = 800.0, c = 3.0, start = 0.03;
    Running run = running(
        fmt::format(
            "step: {}\nend: 0.6\nbodies:\n- {{name: floor, fixed: true, shapes: [{{plane: {{}}}}]}}\n"
            "- {{name: ball, mass: {}, position: [0, 0, {}], shapes: [{{sphere: {{radius: 0.1}}}}]}}\n"
            "bushings: [{{name: s, second: ball, point: [0, 0, {}], stiffness: [0, 0, {}], damping: [0, 0, {}]}}]\n",
            h, m, 0.1 + start, 0.1 + start, k, c),
        "euler_implicit_linearized", h);
    EXPECT_EQ(failure_of(run), "");
    // z: above the floor; the spring is relaxed at the start. Where the ball lands, the floor takes a speed J/m, and
    // of the energy J (v + v⁺)/2.
    double z = start, v = 0.0, taken = 0.0;
    for (int i = 0; i < 60; ++i) {
        const double mass = m + h * c + h * h * k;
        double next = (m * v - h * m * g - h * k * (z - start)) / mass;
        double impulse = 0.0;
        if (z + h * next < 0.0) {
            impulse = mass * (-z / h - next);
            next = -z / h;
        }
        taken += h * c * next * next - impulse * 0.5 * (v + next);
        z += h * next;
        v = next;
    }
    const auto& totals = run.simulation.totals();
    EXPECT_NEAR(run.pose("ball").position[2], 0.1 + z, 1e-9);
    EXPECT_NEAR(totals.start_energy - totals.energy, taken + totals.damped, 1e-9);
    EXPECT_GT(totals.damped, 0.0);
}

TEST(EnergyGuard, GoesOnFromACheckpointAsIfItHadNotStopped) {
    Running whole = running(spring_pendulum(1e6), "euler_explicit", 0.001);
    const std::string sentence = failure_of(whole);
    Running first = running(spring_pendulum(1e6), "euler_explicit", 0.001);
    for (int step = 0; step < 5; ++step) first.simulation.step();
    Running second = running(spring_pendulum(1e6), "euler_explicit", 0.001);
    second.simulation.load(first.simulation.save());
    EXPECT_EQ(failure_of(second), sentence);
    EXPECT_EQ(second.simulation.totals().potential_drop, whole.simulation.totals().potential_drop);
}

#ifdef DELASSUS_HAS_FCL
// A ball that starts 1 cm deep in the ground, where the speed of recovery is not bounded, is thrown out with
// depth/h = 10 m/s: 50 J that the contact gave. With the default bound it leaves at 1 mm/s.
TEST(EnergyGuard, CountsWhatContactsGiveThatPushApart) {
    const std::string ball =
        "step: 0.001\nend: 0.1\ngravity: [0, 0, 0]\n"
        "bodies: [{name: ground, fixed: true, shapes: [{plane: {}}]},\n"
        "         {name: ball, mass: 1, position: [0, 0, 0.09], shapes: [{sphere: {radius: 0.1}}]}]\n";
    Running slow = running(ball, "euler_implicit_linearized", 0.001);
    EXPECT_EQ(failure_of(slow), "");
    EXPECT_NEAR(slow.velocities("ball")[0][2], 0.01 * 0.1, 1e-12);
    Running run = running(ball, "euler_implicit_linearized(recovery_speed=1e3)", 0.001);
    EXPECT_EQ(failure_of(run), "");
    // Booked is the most that the contact can have given, λ u⁺; half of it where nothing else acts.
    EXPECT_NEAR(run.simulation.totals().recovered, 100.0, 1e-4);
    EXPECT_NEAR(run.simulation.totals().energy, 50.0, 1e-4);
    EXPECT_LT(run.simulation.totals().growth_share, 1e-6);
    ASSERT_EQ(run.simulation.warnings().size(), 1);
    EXPECT_TRUE(says(run.simulation.warnings()[0], "overlap by 0.01 m at the start")) << run.simulation.warnings()[0];
}
#endif

// ---- Drift ----

TEST(DriftLimit, EndsARun) {
    Running run = running(pendulum, "euler_implicit_linearized", 0.1, {{"limits", "{drift: 0.01}"}});
    const std::string sentence = failure_of(run);
    EXPECT_TRUE(says(sentence, "limits.drift is 0.01")) << sentence;
    EXPECT_LE(run.simulation.totals().worst_drift, 0.01);
}

// ---- Linear models ----

TEST(LinearizationLimit, MeasuresTheShareThatIsLostInARadian) {
    // h ω = 10: η = (h ω)² φ/2 with φ the angle of a step.
    Running run = running(spring_pendulum(1e8), "euler_implicit_linearized(linearization_limit=1)", 0.001);
    double speed = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        const auto v = run.velocities("bob")[0];
        speed = std::hypot(v[0], v[1], v[2]);
        // Not at the first steps, where the way of a step is bent by gravity as much as by the spring.
        if (run.simulation.state().t < 0.1) continue;
        const double expected = 0.5 * 100.0 * 0.001 * speed;
        EXPECT_NEAR(run.simulation.record().linearization, expected, 0.1 * expected) << run.simulation.state().t;
    }
    EXPECT_GT(run.simulation.totals().worst_linearization, 0.1);
}

TEST(LinearizationLimit, EndsARunThatWouldHangBack) {
    Running run = running(spring_pendulum(1e14), "euler_implicit_linearized", 0.001);
    const std::string sentence = failure_of(run);
    EXPECT_TRUE(says(sentence, "linear model is off")) << sentence;
    EXPECT_TRUE(says(sentence, "linearization_limit")) << sentence;
    EXPECT_TRUE(says(sentence, "64 substeps of it are too long as well")) << sentence;
    EXPECT_LE(run.simulation.totals().worst_linearization, 0.1);
    for (const char* method : {"euler_implicit_linearized", "trapezoidal_linearized"}) {
        Running unwatched = running(spring_pendulum(1e10), std::string(method) + "(linearization_limit=inf)", 0.001);
        EXPECT_EQ(failure_of(unwatched), "");
        EXPECT_EQ(unwatched.simulation.totals().worst_linearization, 0.0);
    }
}

/// The longest step that a method takes whole of a bob that swings freely from the horizontal, of lengths in so many a
/// metre; what is below 1e-3 of it is not tried.
double longest_step(double units) {
    double taken = 0.0;
    for (double h = 1e-3; h < 1.0; h *= 1.3) {
        Running run = running(
            fmt::format(
                "step: 0.001\nend: 10\ngravity: [0, 0, {}]\nbodies: [{{name: bob, mass: 1, inertia: {{xx: {}, "
                "yy: {}, zz: {}}}, position: [{}, 0, 0], velocity: [0, 0, {}]}}]\njoints: [{{name: hinge, kind: "
                "spherical, second: bob, point: [0, 0, 0]}}]\ncoordinates: maximal\n",
                -g * units, 0.1 * units * units, 0.1 * units * units, 0.1 * units * units, units, -2.0 * units),
            "linearly_implicit_trapezoidal", h);
        run.simulation.step();
        if (run.simulation.totals().divided_steps > 0) break;
        taken = h;
    }
    return taken;
}

// In millimetres, and for a mechanism of a millimetre, as in metres.
TEST(LinearizationLimit, LetsConstraintsMissAShareOfTheWayWhateverTheUnits) {
    const double longest = longest_step(1.0);
    EXPECT_GT(longest, 1e-2);
    EXPECT_LT(longest, 0.9);
    EXPECT_EQ(longest_step(1e3), longest);
    EXPECT_EQ(longest_step(1e-6), longest);
}

// In parts the steps are those that a user would have to ask for. The bob swings as on a rod: at 0.5 s it is at
// x = 0.39104879 (φ¨ = g cos φ, by a method of order 4 with steps of 10 µs).
TEST(LinearizationLimit, DividesStepsThatAreTooLong) {
    struct Case {
        const char* method;
        double stiffness, off;
    };
    for (const auto& [method, stiffness, off] :
         {Case{"euler_implicit_linearized", 1e10, 0.015}, Case{"trapezoidal_linearized", 1e14, 1e-6}}) {
        Running run = running(spring_pendulum(stiffness), method, 0.001);
        EXPECT_EQ(failure_of(run), "");
        const auto& totals = run.simulation.totals();
        EXPECT_GT(totals.divided_steps, 400) << method;
        EXPECT_GE(totals.most_substeps, 2) << method;
        EXPECT_LE(totals.worst_linearization, 0.1) << method;
        EXPECT_EQ(run.simulation.state().t, 0.5);
        EXPECT_NEAR(run.pose("bob").position[0], 0.39104879, off) << method;
        // The same as with that step from the beginning, where all are divided alike.
        Running shorter =
            running(spring_pendulum(stiffness), method, 0.001 / static_cast<double>(totals.most_substeps));
        EXPECT_EQ(failure_of(shorter), "");
        EXPECT_EQ(shorter.simulation.totals().divided_steps, 0) << method;
        EXPECT_NEAR(shorter.pose("bob").position[0], run.pose("bob").position[0], off) << method;
    }
}

TEST(LinearizationLimit, IsSilentWhereForcesAreLinear) {
    // At rest on a bushing of h ω = 1e4, and under a joint without any stiffness.
    const std::string block =
        "step: 0.01\nend: 0.5\n"
        "bodies: [{name: b, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [3, 0, 0]}]\n"
        "bushings: [{name: m, second: b, point: [3, 0, 0], stiffness: [1.0e12, 1.0e12, 1.0e12],\n"
        "            turn_stiffness: [1, 1, 1]}]\n";
    Running stiff = running(block, "euler_implicit_linearized", 0.01);
    EXPECT_EQ(failure_of(stiff), "");
    EXPECT_LT(stiff.simulation.totals().worst_linearization, 1e-3);
    Running joint = running(pendulum, "euler_implicit_linearized", 0.01);
    EXPECT_EQ(failure_of(joint), "");
    EXPECT_EQ(joint.simulation.totals().worst_linearization, 0.0);
}

TEST(LinearizationLimit, ShortensStepsByTolerance) {
    SceneOverrides overrides;
    overrides.integrator = "euler_implicit_linearized";
    overrides.tolerance = 1e-2;
    overrides.end = 0.2;
    std::string scene = spring_pendulum(1e8);
    scene.replace(scene.find("step: 0.001\n"), 12, "");
    Running run(parse_scene(scene, "limits", overrides));
    EXPECT_EQ(failure_of(run), "");
    EXPECT_LE(run.simulation.totals().worst_linearization, 0.1);
}

// ---- Turns ----

TEST(LargestTurn, EndsARunThatCannotTellThem) {
    for (const char* method : {"euler_implicit", "trapezoidal", "newmark", "hht", "generalized_alpha"}) {
        Running run = running(brick, method, 0.001);
        const std::string sentence = failure_of(run);
        EXPECT_FALSE(sentence.empty()) << method;
        EXPECT_LT(run.simulation.record().step, 3) << method;
    }
    Running run = running(brick, "trapezoidal", 0.001);
    const std::string sentence = failure_of(run);
    EXPECT_TRUE(says(sentence, "a body turns by 10 rad in it, where largest_turn is 6.28")) << sentence;
    Running unwatched = running(brick, "trapezoidal(largest_turn=inf)", 0.001);
    EXPECT_EQ(failure_of(unwatched), "");
}

// ---- The scene's key ----

TEST(Limits, AreRefusedWhereTheyMakeNoSense) {
    const auto sentence_of = [](const std::string& limits) -> std::string {
        try {
            static_cast<void>(parse_scene("limits: " + limits + "\n" + pendulum, "s"));
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_TRUE(says(sentence_of("{energy_growth: -1}"), "s, line 1: \"energy_growth\" is"))
        << sentence_of("{energy_growth: -1}");
    EXPECT_TRUE(says(sentence_of("{drift: 0}"), "s, line 1: \"drift\" is")) << sentence_of("{drift: 0}");
    EXPECT_TRUE(says(sentence_of("{energy: 1}"), "\"limits\" has no key \"energy\"; there are energy_growth, drift"))
        << sentence_of("{energy: 1}");
    EXPECT_TRUE(says(sentence_of("1"), "\"limits\" must be a map")) << sentence_of("1");
    EXPECT_EQ(sentence_of("{energy_growth: 0.5, drift: null}"), "");
}

// The step is solved once without the stop, which is no row then; the servo keeps its place in what is left.
// A motor without a bound of its force drives an arm beyond its stop.
TEST(Limits, AStopThatAMotorRunsAgainstIsNamed) {
    Running run(parse_scene(
        "step: 0.01\nend: 3\nbodies: [{name: arm, mass: 1, inertia: {xx: 0.01, yy: 0.02, zz: 0.02}, position: [0.5, 0, "
        "1]}]\njoints: [{name: elbow, kind: revolute, second: arm, point: [0, 0, 1], axis: [0, 1, 0], lower: -1, "
        "upper: "
        "1}]\nmotors: [{name: drive, joint: elbow, speed: true, motion: 2}]\n",
        "motor"));
    const std::string sentence = failure_of(run);
    EXPECT_TRUE(says(sentence, "joints at a stop: \"elbow\" at 0.98 of 1 with the motor \"drive\"")) << sentence;
    EXPECT_NEAR(run.simulation.state().t, 0.49, 1e-9);
}

// A body that nothing can move is driven through by 10 mm/s: no step lets them sink in by more than the accuracy, but
// all of them together do.
TEST(Limits, OverlapsThatAddUpAreSaid) {
    Running run(parse_scene(
        "step: 0.01\nend: 0.5\nbodies:\n- {name: ram, position: [0, 0, 0.3], motion: {translation: [0, 0, {linear: "
        "{rate: -0.01}}]}, shapes: [{box: {size: [0.2, 0.2, 0.2]}}]}\n- {name: block, density: 1000, position: [0, 0, "
        "0.1], shapes: [{box: {size: [0.2, 0.2, 0.2]}}]}\njoints: [{name: weld, kind: fixed, second: block, point: [0, "
        "0, 0]}]\n",
        "ram"));
    EXPECT_EQ(failure_of(run), "");
    const auto& totals = run.simulation.totals();
    // A step reports its contacts as they were at its beginning; 0.2 mm are allowed.
    EXPECT_EQ(totals.deep_steps, 47);
    EXPECT_TRUE(says(totals.first_deep, "bodies \"ram\" and \"block\" overlap by 0.0003 m")) << totals.first_deep;
    const auto warnings = run.simulation.warnings();
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_TRUE(says(warnings[0], "47 of 50 steps leave bodies in one another")) << warnings[0];
}

TEST(Limits, AServoActsBesideAStop) {
    Running run(parse_scene(
        "step: 0.005\nend: 0.6\ngravity: [0, 0, 0]\nbodies:\n"
        "- {name: arm, mass: 2, inertia: {xx: 0.02, yy: 0.2, zz: 0.2}, position: [0.5, 0, 1]}\n"
        "- {name: fore, mass: 1, inertia: {xx: 0.01, yy: 0.05, zz: 0.05}, position: [1.3, 0, 1]}\njoints:\n"
        "- {name: j, kind: revolute, second: arm, point: [0, 0, 1], axis: [0, -1, 0]}\n"
        "- {name: k, kind: revolute, first: arm, second: fore, point: [1, 0, 1], axis: [0, -1, 0], lower: -0.3}\n"
        "actuators: [{name: s, joint: j, position: 1.1, kp: 80, kd: 6, limit: 30}]\n",
        "test.yaml"));
    while (!run.simulation.finished()) {
        run.simulation.step();
        const auto& q = run.simulation.coordinates().q;
        ASSERT_EQ(q.size(), 2u);
        ASSERT_GT(q[1], -0.3 - 1e-6);
    }
    EXPECT_GT(run.simulation.coordinates().q[0], 0.3);
    EXPECT_GT(run.simulation.totals().most_contacts, 1);
}

}  // namespace
}  // namespace delassus::tests::limits_test
