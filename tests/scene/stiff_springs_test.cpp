// SPDX-License-Identifier: BSD-3-Clause
// Springs that a step does not resolve, in plain scenes without options: steps are divided, so that they throw back
// what they take; the stiffest hold as joints do, and damp nothing but what they vibrate with.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "support/scenes.hpp"

namespace delassus::tests::stiff_springs_test {
namespace {

const std::string floor_plane =
    "materials: {m: {friction: 0.5}}\nbodies:\n- {name: floor, fixed: true, shapes: [{plane: {}, material: m}]}\n";

std::string ball(const std::string& name, const std::string& position, const std::string& more = "") {
    return fmt::format(
        "- {{name: {}, mass: 1.3, inertia: {{xx: 0.004, yy: 0.004, zz: 0.004}}, position: {}, shapes: [{{sphere: "
        "{{radius: 0.1}}, material: m}}]{}}}\n",
        name, position, more);
}

Running finished(const std::string& text) {
    Running run(parse_scene(text, "test.yaml"));
    run.finish();
    return run;
}

// Two balls that a stiff spring lets vibrate damp a third one on a soft spring by nothing.
TEST(StiffSprings, DampNothingElse) {
    const double soft = 37.0, end = 4.7;
    auto run =
        finished(fmt::format("gravity: [0, 0, 0]\nstep: 0.006\nend: {}\n", end) + floor_plane +
                 ball("a", "[0, 0, 1]", ", velocity: [0, 1, 0]") + ball("b", "[0, 1, 1]") + ball("c", "[5.4, 0, 1]") +
                 fmt::format("springs:\n- {{name: stiff, first: a, second: b, stiffness: 3.0e+8}}\n"
                             "- {{name: soft, second: c, first_point: [3, 0, 1], stiffness: {}, rest_length: "
                             "2}}\n",
                             soft));
    EXPECT_EQ(run.scene.systems[0].integrator, "linearly_implicit_trapezoidal");
    EXPECT_NEAR(run.pose("c").position[0], 5.0 + 0.4 * std::cos(std::sqrt(soft / 1.3) * end), 2e-3);
    const auto a = run.velocities("a")[0], b = run.velocities("b")[0];
    EXPECT_NEAR(a[1], 0.5, 1e-9) << "they have stopped vibrating";
    EXPECT_NEAR(b[1], 0.5, 1e-9);
    EXPECT_NEAR(run.pose("b").position[1] - run.pose("a").position[1], 1.0, 1e-9);
    EXPECT_NEAR(run.simulation.totals().damped, 0.25 * 1.3, 0.02) << "half of the energy was in the vibration";
    EXPECT_EQ(run.simulation.warnings().size(), 1u);
}

// A load on a spring above a foot lands without a bounce of the foot, and the spring throws both up again: the load by
// y'' = −g − ω² y, y the length of the spring over its rest, until it pulls the foot up.
TEST(StiffSprings, ThrowUpWhatLands) {
    const double foot = 0.8, load = 2.9, g = 9.81, fall = 0.37, step = 0.0043, end = 0.43;
    for (const double rate : {0.3, 1.0, 4.0}) {
        SCOPED_TRACE(rate);
        const double k = std::pow(rate / step, 2) * foot * load / (foot + load);
        auto run = finished(
            fmt::format("step: {}\nend: {}\n", step, end) +
            "bodies:\n- {name: floor, fixed: true, shapes: [{plane: {}}]}\n" +
            fmt::format("- {{name: foot, mass: {}, position: [0, 0, {}], shapes: [{{sphere: {{radius: 0.1}}}}]}}\n",
                        foot, 0.1 + fall) +
            fmt::format("- {{name: load, mass: {}, inertia: {{xx: 0.1, yy: 0.1, zz: 0.1}}, position: [0, 0, {}]}}\n",
                        load, 0.9 + fall) +
            fmt::format("springs: [{{name: leg, first: foot, second: load, stiffness: {}}}]\n", k));
        const double lands = std::sqrt(2.0 * fall / g), v = g * lands, w = std::sqrt(k / load), rest = -g / (w * w);
        const auto y = [&](double t) { return rest - rest * std::cos(w * t) - v / w * std::sin(w * t); };
        double before = std::acos(-1.0) / w, after = 1.5 * before;
        for (int i = 0; i < 60; ++i) {
            const double middle = 0.5 * (before + after);
            (k * y(middle) < foot * g ? before : after) = middle;
        }
        const double share = load / (foot + load), t = end - lands - before;
        const double speed = share * (rest * w * std::sin(w * before) - v * std::cos(w * before));
        const double centre = 0.1 + share * (0.8 + y(before)) + speed * t - 0.5 * g * t * t;
        const double found = (1.0 - share) * run.pose("foot").position[2] + share * run.pose("load").position[2];
        EXPECT_GT(t, 0.0);
        EXPECT_NEAR(found, centre, 1e-3 * fall);
        EXPECT_TRUE(run.simulation.warnings().empty());
    }
}

// Where no substep resolves what a spring throws back, fixed steps go on, with a warning, and resume to the same bits.
TEST(StiffSprings, AreHeldWhereStepsCannotFollow) {
    const std::string text =
        "step: 0.005\nend: 0.5\nbodies:\n- {name: floor, fixed: true, shapes: [{plane: {}}]}\n"
        "- {name: foot, mass: 1, position: [0, 0, 0.6], shapes: [{sphere: {radius: 0.1}}]}\n"
        "- {name: load, mass: 3, position: [0, 0, 1.1], shapes: [{sphere: {radius: 0.1}}]}\n"
        "springs: [{name: leg, first: foot, second: load, stiffness: 2.7e+9}]\n";
    auto run = finished(text);
    EXPECT_EQ(run.simulation.totals().method_changes, 1);
    EXPECT_FALSE(run.simulation.method().by_accuracy);
    ASSERT_EQ(run.simulation.warnings().size(), 1u);
    EXPECT_NE(run.simulation.warnings()[0].find("steps are not divided by their error"), std::string::npos);
    EXPECT_NEAR(run.pose("foot").position[2], 0.1, 1e-6);
    for (const double until : {0.2, 0.4}) {
        SCOPED_TRACE(until);
        Running first(parse_scene(text, "test.yaml")), second(parse_scene(text, "test.yaml"));
        while (first.simulation.record().t < until) first.simulation.step();
        second.simulation.load(first.simulation.save());
        second.finish();
        EXPECT_EQ(second.simulation.coordinates().q, run.simulation.coordinates().q);
    }
}

// A scene in milliseconds and millimetres is divided as one in seconds and metres.
TEST(StiffSprings, AreDividedAlikeInAllUnits) {
    const auto landing = [](double mm, double ms) {
        const double stiffness = 7000.0 / (ms * ms);
        auto run = finished(
            fmt::format("gravity: [0, 0, {}]\nstep: {}\nend: {}\n", -9.81 * mm / (ms * ms), 0.0043 * ms, 0.43 * ms) +
            "bodies:\n- {name: floor, fixed: true, shapes: [{plane: {}}]}\n" +
            fmt::format("- {{name: foot, mass: 0.8, position: [0, 0, {}], shapes: [{{sphere: {{radius: {}}}}}]}}\n",
                        0.47 * mm, 0.1 * mm) +
            fmt::format("- {{name: load, mass: 2.9, position: [0, 0, {}], shapes: [{{sphere: {{radius: {}}}}}]}}\n",
                        1.27 * mm, 0.1 * mm) +
            fmt::format("springs: [{{name: leg, first: foot, second: load, stiffness: {}}}]\n", stiffness));
        EXPECT_EQ(run.scene.systems[0].division, StepDivision::ToChosenAccuracy);
        return run.pose("load").position[2] / mm;
    };
    EXPECT_NEAR(landing(1000.0, 1000.0), landing(1.0, 1.0), 1e-6);
}

// A weight on a cable swings above a floor that it does not touch: nothing takes energy, nor does the method, whose
// order is 1.
TEST(StiffSprings, LetACableSwing) {
    auto run = finished(
        "step: 0.0047\nend: 4.1\nbodies: [{name: floor, fixed: true, position: [0, 0, -3], shapes: [{plane: {}}]}]\n"
        "nodes:\n- {name: top, fixed: true, position: [0, 0, 0]}\n- {name: bob, mass: 1, position: [0.5, 0, -0.866]}\n"
        "cables: [{name: rope, nodes: [top, bob], density: 1}]\n");
    const double start = run.system().energy(run.system().initial_state()), moved = 9.81 * (1.0 - 0.866);
    EXPECT_NEAR(run.system().energy(run.simulation.state()), start, 0.01 * moved);
}

// Dry friction in a joint with a spring: each half of a vibration is one about where the spring holds the friction.
TEST(StiffSprings, VibrateAgainstDryFriction) {
    const double inertia = 0.2, start = 0.5, step = 1.0 / 60.0;
    for (const double rate : {0.3, 1.7, 8.0}) {
        SCOPED_TRACE(rate);
        const double k = inertia * std::pow(rate / step, 2), off = 0.02, w = rate / step;
        const double end = std::ceil(9.3 / rate) * step;
        auto run = finished(
            fmt::format("gravity: [0, 0, 0]\nstep: {}\nend: {}\n", step, end) +
            "bodies: [{name: arm, mass: 1, inertia: {xx: 0.2, yy: 0.2, zz: 0.2}}]\n" +
            fmt::format("joints: [{{name: hub, kind: revolute, second: arm, axis: [0, 0, 1], friction: {}, start: {}, "
                        "spring: {{stiffness: {}}}}}]\n",
                        k * off, start, k));
        const double half = std::acos(-1.0) / w;
        double angle = start, rest = end;
        for (; rest > half; rest -= half) angle = -angle + std::copysign(2.0 * off, angle);
        const double centre = std::copysign(off, angle);
        angle = centre + (angle - centre) * std::cos(w * rest);
        const auto& turn = run.pose("arm").orientation;
        EXPECT_NEAR(2.0 * std::atan2(turn[3], turn[0]), angle, 1e-3);
        EXPECT_TRUE(run.simulation.warnings().empty());
    }
}

// A bob swings on a spring: whatever the stiffness, energy is kept; a very stiff one is a rod.
TEST(StiffSprings, HoldAPendulum) {
    for (const char* stiffness : {"1.0e+3", "2.0e+4", "3.0e+5", "1.0e+6", "1.0e+9"}) {
        SCOPED_TRACE(stiffness);
        const auto swing = [&](double step, const std::string& more) {
            return finished(fmt::format("step: {}\nend: 2.9\n", step) + floor_plane + ball("bob", "[0.9, 0, 3]") +
                            more);
        };
        const std::string spring =
            fmt::format("springs: [{{name: rod, second: bob, first_point: [0, 0, 3.5], stiffness: {}}}]\n", stiffness);
        auto run = swing(0.005, spring);
        EXPECT_EQ(run.scene.systems[0].integrator, "linearly_implicit_trapezoidal");
        const double start = run.system().energy(run.system().initial_state());
        EXPECT_NEAR(run.system().energy(run.simulation.state()), start, 2e-3);
        if (std::stod(stiffness) < 1e9) continue;
        const auto exact =
            swing(0.0005,
                  "joints: [{name: rod, kind: distance, second: bob, point: [0, 0, 3.5], second_point: [0.9, 0, 3]}]\n")
                .pose("bob");
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(run.pose("bob").position[i], exact.position[i], 1e-3) << i;
    }
}

// What is thrown lands on both balls, turns and comes to rest.
TEST(StiffSprings, ComeToRestOnAFloor) {
    auto run = finished("step: 0.007\nend: 6\n" + floor_plane + ball("a", "[0, 0, 1]", ", velocity: [0.3, 1, 2]") +
                        ball("b", "[0.7, 0, 1.3]", ", velocity: [0.3, -1, 2]") +
                        "springs: [{name: rod, first: a, second: b, stiffness: 1.0e+6}]\n");
    const auto a = run.pose("a").position, b = run.pose("b").position;
    EXPECT_NEAR(a[2], 0.1, 1e-6);
    EXPECT_NEAR(b[2], 0.1, 1e-6);
    EXPECT_NEAR(std::hypot(b[0] - a[0], b[1] - a[1]), std::hypot(0.7, 0.3), 1e-4);
}

// A hinge with dry friction and a stiff spring, which a motor's target of a servo is: the arm that it carries is held.
TEST(StiffSprings, HoldAJointWithFriction) {
    const auto arm = [](double step) {
        return finished(
            fmt::format("step: {}\nend: 1.3\nbodies:\n"
                        "- {{name: upper, mass: 2, inertia: {{xx: 0.01, yy: 0.03, zz: 0.03}}, position: [0.2, 0, 0]}}\n"
                        "- {{name: lower, mass: 1, inertia: {{xx: 0.01, yy: 0.02, zz: 0.02}}, position: [0.6, 0, 0]}}\n"
                        "joints:\n"
                        "- {{name: shoulder, kind: revolute, second: upper, point: [0, 0, 0], axis: [0, 1, 0], "
                        "friction: 0.4}}\n"
                        "- {{name: elbow, kind: revolute, first: upper, second: lower, point: [0.4, 0, 0], axis: [0, "
                        "1, 0], spring: {{stiffness: 3.0e+5}}}}\n",
                        step));
    };
    auto run = arm(0.008);
    EXPECT_EQ(run.scene.systems[0].integrator, "moreau_jean");
    EXPECT_EQ(run.scene.systems[0].coordinates, Coordinates::Joint);
    auto fine = arm(0.0005);
    for (const char* body : {"upper", "lower"})
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_NEAR(run.pose(body).position[i], fine.pose(body).position[i], 2e-3) << body << i;
}

// A platform on a spring of h ω = 370 to 90 from a shaker that begins at full speed carries a box, which hops by 1.3
// cm: as high as the speed of the shaker, which the platform overshoots by, lifts it.
TEST(StiffSprings, ThrowNothingThatTheyCarry) {
    for (const double step : {1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0})
        for (const std::string method :
             {"", "integrator: moreau_jean\n", "integrator: linearly_implicit_trapezoidal\n"}) {
            SCOPED_TRACE(fmt::format("{} {}", step, method));
            Running run(parse_scene(
                fmt::format("step: {:.17g}\nend: 0.7\n{}materials: {{m: {{friction: 0.5}}}}\nbodies:\n"
                            "- {{name: shaker, position: [0, 0, -1], motion: {{translation: [0, 0, {{sine: "
                            "{{amplitude: 0.1, frequency: 0.8}}}}]}}}}\n"
                            "- {{name: platform, mass: 2, position: [0, 0, 0], shapes: [{{box: {{size: [1, 1, 0.1]}}, "
                            "material: m}}]}}\n"
                            "- {{name: load, mass: 1.5, position: [0.1, 0, 0.15], shapes: [{{box: {{size: [0.2, 0.2, "
                            "0.2]}}, material: m}}]}}\n"
                            "joints: [{{name: j, kind: prismatic, second: platform, axis: [0, 0, 1]}}]\n"
                            "springs: [{{name: s, first: shaker, second: platform, stiffness: 1.0e+9, damping: "
                            "1.0e+4}}]\n",
                            step, method),
                "test.yaml"));
            double highest = 0.0;
            while (!run.simulation.finished()) {
                run.simulation.step();
                highest = std::max(highest, run.pose("load").position[2] - run.pose("platform").position[2]);
            }
            EXPECT_LT(highest, 0.15 + 0.013);
            EXPECT_NEAR(run.pose("load").position[2], 0.15 + 0.1 * std::sin(2.0 * std::acos(-1.0) * 0.8 * 0.7), 1e-3);
        }
}

}  // namespace
}  // namespace delassus::tests::stiff_springs_test
