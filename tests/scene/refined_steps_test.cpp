// SPDX-License-Identifier: BSD-3-Clause
// Plain scenes of few bodies, without options: fixed steps that err by more than the accuracy are divided.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "support/scenes.hpp"

namespace delassus::tests::refined_steps_test {
namespace {

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

// A cube of the edge a and the mass m falls on an edge, without friction, with the speed v. Its centre is r sin φ above
// the edge, and x = r cos φ beside it, r = a/√2. The impulse J = m v/(1 + m x²/I) on the edge, which stays on the
// floor, leaves φ̇ = −J x/I, and from then on
//
//     E = ½ (I + m r² cos² φ) φ̇² + m g r sin φ
//
// stays. So φ at the end follows by a quadrature of dt = dφ/φ̇, here by midpoints.
struct Landing {
    double a = 0.53, tilt = 0.41, fall = 0.29, g = 9.81;
    double r = a / std::sqrt(2.0), inertia = a * a / 6.0;  // of 1 kg
    double meets = std::sqrt(2.0 * fall / g);

    [[nodiscard]] double rate(double phi, double energy) const {
        const double x = r * std::cos(phi);
        return -std::sqrt(2.0 * (energy - g * r * std::sin(phi)) / (inertia + x * x));
    }
    /// The tilt at a time after it meets the floor.
    [[nodiscard]] double tilt_after(double time) const {
        const double quarter = std::acos(-1.0) / 4.0, start = tilt + quarter, x = r * std::cos(start);
        const double spin = g * meets / (1.0 + x * x / inertia) * x / inertia;
        const double energy = 0.5 * (inertia + x * x) * spin * spin + g * r * std::sin(start);
        constexpr int steps = 20000;
        double phi = start;
        for (int i = 0; i < steps; ++i)
            phi += rate(phi + 0.5 * time / steps * rate(phi, energy), energy) * time / steps;
        return phi - quarter;
    }
    [[nodiscard]] std::string scene(double step, double end, const std::string& options = "") const {
        return options +
               fmt::format(
                   "step: {:.17g}\nend: {:.17g}\nbodies:\n- {{name: floor, fixed: true, orientation: {{axis: [0, 0, "
                   "1], "
                   "angle: 29}}, shapes: [{{plane: {{}}}}]}}\n- {{name: cube, mass: 1, position: [0, 0, {:.17g}], "
                   "orientation: {{axis: [0, 1, 0], angle: {:.17g}}}, shapes: [{{box: {{size: [{}, {}, {}]}}}}]}}\n",
                   step, end, fall + r * std::sin(tilt + std::acos(-1.0) / 4.0), tilt * 180.0 / std::acos(-1.0), a, a,
                   a);
    }
};

TEST(RefinedSteps, ACubeTurnsOnTheEdgeThatItLandsOn) {
    const Landing landing;
    const double after = 0.043, end = landing.meets + after, tilt = landing.tilt_after(after);
    ASSERT_GT(tilt, 0.02) << "before it is flat";
    // The last one: it meets the floor where a step ends.
    for (const double step : {0.0023, 0.0071, 1.0 / 60.0, landing.meets / 19.0})
        for (const char* options : {"", "accuracy: 1.0e-3\n"}) {
            SCOPED_TRACE(fmt::format("step {} {}", step, options));
            auto run = run_of(landing.scene(step, end, options));
            run.finish();
            EXPECT_NEAR(2.0 * std::asin(run.pose("cube").orientation[2]), tilt, 1e-3);
            EXPECT_TRUE(run.simulation.warnings().empty());
            const auto& totals = run.simulation.totals();
            EXPECT_EQ(totals.refined_steps > 0, *options == '\0');
            EXPECT_EQ(totals.inexact_steps, 0);
        }
}

// A body of 2 kg on a spring stands on a foot of 1 kg, drawn together. With x the length of the spring above its rest
// the body moves as m ẍ = −k x − m g until the spring pulls the foot up, at k x = m₂ g. From then on the mass centre is
// thrown, and the spring swings by itself with k (1/m + 1/m₂).
struct Jump {
    double m = 2.0, foot = 1.0, k = 20.0, g = 9.81, drawn = -3.2;

    /// The height of the foot at a time after the start, before it lands.
    [[nodiscard]] double foot_at(double time) const {
        const double omega = std::sqrt(k / m), middle = -m * g / k, width = drawn - middle, leaves = foot * g / k;
        const double until = std::acos((leaves - middle) / width) / omega, t = time - until;
        if (t < 0.0) return 0.0;
        const double speed = -width * omega * std::sin(omega * until), swings = std::sqrt(k * (1.0 / m + 1.0 / foot));
        const double centre = m / (m + foot) * (leaves + speed * t) - 0.5 * g * t * t;
        const double x = leaves * std::cos(swings * t) + speed / swings * std::sin(swings * t);
        return centre - m / (m + foot) * x;
    }
    [[nodiscard]] std::string scene(double step, double end, bool joint) const {
        const std::string way = joint ? fmt::format(
                                            "joints: [{{name: leg, kind: prismatic, first: foot, second: body, "
                                            "axis: [0, 0, 1], spring: {{stiffness: {}, rest: {:.17g}}}}}]\n",
                                            k, -drawn)
                                      : fmt::format(
                                            "springs: [{{name: leg, first: foot, second: body, stiffness: {}, "
                                            "rest_length: {:.17g}}}]\n",
                                            k, 2.0 - drawn);
        return fmt::format(
            "step: {:.17g}\nend: {:.17g}\nbodies:\n- {{name: floor, fixed: true, shapes: [{{plane: {{}}}}]}}\n- "
            "{{name: "
            "foot, mass: {}, position: [0, 0, 0.1], shapes: [{{sphere: {{radius: 0.1}}}}]}}\n- {{name: body, mass: {}, "
            "inertia: {{xx: 1, yy: 1, zz: 1}}, position: [0, 0, 2.1]}}\n{}",
            step, end, foot, m, way);
    }
};

TEST(RefinedSteps, AFootLetsGoWithinAStep) {
    const Jump jump;
    const double end = 1.0, height = jump.foot_at(end);
    ASSERT_GT(height, 0.2);
    for (const bool joint : {true, false})
        for (const double step : {1.0 / 60.0, 0.0071}) {
            SCOPED_TRACE(fmt::format("{} {}", joint, step));
            auto run = run_of(jump.scene(step, end, joint));
            run.finish();
            EXPECT_NEAR(run.pose("foot").position[2] - 0.1, height, 3e-3);
        }
}

// A ball flies off the edge of a smooth table, which it reaches at any time of a step.
TEST(RefinedSteps, ABallLeavesATableAtAnyTimeOfAStep) {
    const double v = 2.0, end = 0.9, g = 9.81;
    for (int k = 0; k < 8; ++k) {
        const double way = 0.8 + 0.0025 * k, flight = end - way / v;
        auto run = run_of(fmt::format(
            "step: 0.01\nend: {}\nbodies:\n- {{name: table, fixed: true, position: [-1, 0, -0.5], shapes: [{{box: "
            "{{size: [2, 2, 1]}}}}]}}\n- {{name: ball, mass: 0.6, position: [{:.17g}, 0, 0.1], velocity: [{}, 0, 0], "
            "shapes: [{{sphere: {{radius: 0.1}}}}]}}\n",
            end, -way, v));
        run.finish();
        EXPECT_NEAR(run.pose("ball").position[0], v * flight, 2e-7) << way;
        EXPECT_NEAR(run.pose("ball").position[2], 0.1 - 0.5 * g * flight * flight, 1e-3) << way;
    }
}

// Loads that are switched on, act for half a step, or swing within a step: on a ball on a smooth plane, with steps that
// follow from an accuracy and without. x = ∬ F/m dt².
TEST(RefinedSteps, LoadsThatComeAndGoWithinAStep) {
    struct Case {
        std::string force;
        double end, x, error;
    };
    const double pi = std::acos(-1.0);
    for (const Case& one : {
             Case{"table: {times: [0, 0.2045, 0.20450001, 9], values: [0, 0, 10, 10]}", 0.6, 5.0 * 0.3955 * 0.3955,
                  1e-6},
             Case{"table: {times: [0, 0.106, 0.1060001, 0.111, 0.1110001, 9], values: [0, 0, 200, 200, 0, 0]}", 0.5,
                  200.0 * 0.005 * (0.5 - 0.106 - 0.0025), 1e-4},
             Case{"sine: {amplitude: 100, frequency: 50}", 0.5, 100.0 / (100.0 * pi) * 0.5, 2e-3},
         })
        for (const std::string accuracy : {"", "accuracy: 1.0e-3\n"})
            for (const double step : {0.02, 0.0173}) {
                auto run =
                    run_of(fmt::format("step: {}\nend: {}\n{}bodies:\n- {{name: floor, fixed: true, shapes: [{{plane: "
                                       "{{}}}}]}}\n- {{name: "
                                       "ball, mass: 1, position: [0, 0, 0.1], shapes: [{{sphere: {{radius: "
                                       "0.1}}}}]}}\nloads:\n- {{name: f, "
                                       "body: ball, force: [{{{}}}, 0, 0]}}\n",
                                       step, one.end, accuracy, one.force));
                run.finish();
                EXPECT_NEAR(run.pose("ball").position[0], one.x, one.error) << one.force << ' ' << step << accuracy;
            }
}

// A blade that turns once a step hits what lies in its way.
TEST(RefinedSteps, ABladeThatTurnsOnceAStepHits) {
    auto run = run_of(
        "step: 0.02\nend: 0.3\ngravity: [0, 0, 0]\nbodies:\n- {name: blade, motion: {rotation: {axis: [0, 0, 1], "
        "angle: {linear: {rate: 314.15926535897933}}}}, shapes: [{box: {size: [1, 0.1, 0.1]}}]}\n- {name: ball, mass: "
        "1, position: [0, 0.8, 0], velocity: [0, -2, 0], shapes: [{sphere: {radius: 0.1}}]}\n");
    run.finish();
    EXPECT_GT(std::hypot(run.velocities("ball")[0][0], run.velocities("ball")[0][1]), 10.0);
}

// A ball rolls off a table, a wheel over a curb: against steps by accuracy.
TEST(RefinedSteps, EdgesThatBodiesGoOver) {
    const std::string roll =
        "end: 0.9\nmaterials: {m: {friction: 0.5}}\nbodies:\n- {name: table, fixed: true, position: [-0.5, 0, 0.25], "
        "shapes: [{box: {size: [1, 1, 0.5]}, material: m}]}\n- {name: b, mass: 1, position: [-0.4, 0.05, 0.6], "
        "velocity: [0.7, 0.1, 0], angular_velocity: [-1, 7, 0], shapes: [{sphere: {radius: 0.1}, material: m}]}\n";
    const std::string curb =
        "end: 0.8\nmaterials: {m: {friction: 0.8}}\nbodies:\n- {name: ground, fixed: true, shapes: [{plane: {}, "
        "material: m}]}\n- {name: curb, fixed: true, position: [1, 0, 0.03], shapes: [{box: {size: [1, 1, 0.06]}, "
        "material: m}]}\n- {name: b, mass: 5, position: [0, 0, 0.3], velocity: [2.5, 0, 0], angular_velocity: [0, 0, "
        "8.3333333], orientation: {axis: [1, 0, 0], angle: -90}, shapes: [{cylinder: {radius: 0.3, length: 0.1}, "
        "material: m}]}\n";
    for (const std::string& scene : {roll, curb}) {
        auto exact = run_of("step: 0.01\naccuracy: 1.0e-5\n" + scene);
        exact.finish();
        for (const double step : {1.0 / 60.0, 0.0073}) {
            SCOPED_TRACE(step);
            auto run = run_of(fmt::format("step: {:.17g}\n", step) + scene);
            run.finish();
            for (std::size_t i = 0; i < 3; ++i)
                EXPECT_NEAR(run.pose("b").position[i], exact.pose("b").position[i], 2e-3) << i;
        }
    }
}

TEST(RefinedSteps, AMethodThatIsNamedKeepsItsSteps) {
    const Landing landing;
    auto run = run_of(landing.scene(1.0 / 60.0, landing.meets + 0.043, "integrator: linearly_implicit_trapezoidal\n"));
    run.finish();
    EXPECT_EQ(run.simulation.totals().refined_steps, 0);
    EXPECT_GT(run.simulation.totals().inexact_steps, 0);
    EXPECT_GT(run.simulation.totals().error, 1e-3);
}

/// So many cubes that fall on edges, one beside the other.
std::string cubes(int count) {
    return fmt::format(
        "step: 0.006\nend: 0.6\nmaterials: {{m: {{friction: 0.4}}}}\nbodies:\n"
        "- {{name: floor, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
        "- {{name: 'cube_{{i}}', mass: 1, position: [0, 0, 0.4], orientation: {{axis: [1, 2, 0], angle: 31}}, shapes: "
        "[{{box: {{size: [0.2, 0.2, 0.2]}}, material: m}}], repeat: {{count: {}, spacing: [0.5, 0, 0]}}}}\n",
        count);
}

TEST(RefinedSteps, CostNoMoreThanASharePerStep) {
    auto few = run_of(cubes(2));
    few.finish();
    EXPECT_GT(few.simulation.totals().refined_steps, 0);
    auto many = run_of(cubes(40));
    many.finish();
    EXPECT_EQ(many.simulation.totals().refined_steps, 0);
    EXPECT_GT(many.simulation.totals().inexact_steps, 0);
    EXPECT_TRUE(many.simulation.warnings().empty());
}

TEST(RefinedSteps, ResumeToTheSameBits) {
    auto whole = run_of(cubes(3));
    whole.finish();
    ASSERT_GT(whole.simulation.totals().refined_steps + whole.simulation.totals().inexact_steps, 3);
    for (const double until : {0.1, 0.29, 0.35, 0.41}) {
        SCOPED_TRACE(until);
        auto first = run_of(cubes(3)), second = run_of(cubes(3));
        while (first.simulation.record().t < until) first.simulation.step();
        second.simulation.load(first.simulation.save());
        second.finish();
        EXPECT_EQ(second.simulation.coordinates().q, whole.simulation.coordinates().q);
        EXPECT_EQ(second.simulation.totals().refined_steps, whole.simulation.totals().refined_steps);
    }
}

}  // namespace
}  // namespace delassus::tests::refined_steps_test
