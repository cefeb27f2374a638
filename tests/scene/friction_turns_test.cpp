// SPDX-License-Identifier: BSD-3-Clause
// Dry friction turns round within a step where sliding does, in joints and in contacts: plain scenes without options.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "support/scenes.hpp"

namespace delassus::tests::friction_turns_test {
namespace {

// Dry friction F turns round wherever the mass does: each swing is one about ±F/k (Den Hartog 1956, section 8.7).
double with_dry_friction(double t, double mass, double stiffness, double force, double start) {
    const double swing = std::acos(-1.0) / std::sqrt(stiffness / mass);
    for (; stiffness * std::abs(start) > force; t -= swing) {
        const double middle = std::copysign(force / stiffness, start);
        if (t < swing) return middle + (start - middle) * std::cos(std::acos(-1.0) * t / swing);
        start = 2.0 * middle - start;
    }
    return start;
}

TEST(TurnOfFriction, OfAJointHasItsTimeInAStep) {
    for (const bool bodies : {false, true}) {
        double last = 0.0;
        for (const double step : {0.02, 0.01, 0.005}) {
            Running run(parse_scene(
                fmt::format("step: {}\nend: 2.6\n{}bodies: [{{name: b, mass: 2, inertia: {{xx: 1, yy: 1, zz: 1}}, "
                            "position: [0, 0, 0]}}]\njoints:\n- "
                            "{{name: j, kind: prismatic, second: b, point: [0, 0, 0], axis: [1, 0, 0], friction: 3, "
                            "spring: {{stiffness: 40}}, start: 1}}\n",
                            step,
                            bodies ? "integrator: linearly_implicit_trapezoidal\ncoordinates: maximal\n"
                                   : "integrator: moreau_jean\ncoordinates: joint\n"),
                "test.yaml"));
            double worst = 0.0;
            while (!run.simulation.finished()) {
                run.simulation.step();
                const double t = run.simulation.state().t;
                worst =
                    std::max(worst, std::abs(run.pose("b").position[0] - with_dry_friction(t, 2.0, 40.0, 3.0, 1.0)));
            }
            EXPECT_LT(worst, 12.0 * step * step) << step;
            if (last > 0.0) {
                EXPECT_LT(worst, 0.35 * last) << step << ": of order 2";
            }
            last = worst;
        }
    }
}

// A box slips all the time on a table that shakes, x = A sin ω t: its velocity follows from v̇ = ±μ g in exact pieces
// between the times at which the table has it. Once in a contact, once as a slider with friction; without joints'
// trees.
TEST(TurnOfFriction, OnAShakingTableAddsUpToNoDrift) {
    const double A = 0.02, frequency = 5.0, mu = 0.4, g = 9.81, end = 2.03, omega = 2.0 * std::acos(-1.0) * frequency;
    double x = 0.0, v = 0.0;
    constexpr int parts = 2000000;
    for (int i = 0; i < parts; ++i) {
        const double h = end / parts, table = A * omega * std::cos(omega * (i + 0.5) * h);
        const double last = v;
        v += std::copysign(mu * g * h, table - v);
        x += 0.5 * h * (last + v);
    }
    const std::string shaker = fmt::format(
        "materials: {{m: {{friction: {}}}}}\nbodies:\n- {{name: table, position: [0, 0, -0.05], motion: {{translation: "
        "[{{sine: {{amplitude: {}, frequency: {}}}}}, 0, 0]}}",
        mu, A, frequency);
    const std::string sliding = shaker +
                                ", shapes: [{box: {size: [3, 2, 0.1]}, material: m}]}\n- {name: b, mass: 1, position: "
                                "[0, 0, 0.1], shapes: [{box: {size: [0.3, 0.2, 0.2]}, material: m}]}\n";
    const std::string joint =
        shaker + fmt::format(
                     "}}\n- {{name: b, mass: 1, position: [0, 0, 0.1], inertia: {{xx: 0.01, yy: 0.01, zz: "
                     "0.01}}}}\njoints: [{{name: j, kind: prismatic, first: table, second: b, axis: [1, 0, 0], "
                     "friction: {:.17g}}}]\n",
                     mu * g);
    for (const auto& scene : {sliding, joint})
        for (const double step : {0.005, 0.0037, 0.0023, 0.00119}) {
            Running run(parse_scene(fmt::format("step: {}\nend: {}\n", step, end) + scene, "test.yaml"));
            run.finish();
            EXPECT_NEAR(run.pose("b").position[0], x, 15.0 * step * step) << step;
        }
}

// Friction acts against a velocity whose direction turns: a box slides across a slope as a point would.
TEST(TurnOfFriction, OfASlideThatCurvesIsOfOrderTwo) {
    const double mu = 0.3, along = 9.81 * std::sin(0.5), across = 9.81 * std::cos(0.5);
    const auto last_place = [&](double step) {
        Running run(parse_scene(
            fmt::format(
                "step: {}\nend: 0.9\ngravity: [{:.17g}, 0, {:.17g}]\nmaterials: {{m: {{friction: {}}}}}\nbodies:\n"
                "- {{name: slope, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                "- {{name: b, mass: 2, position: [0, 0, 0.03], velocity: [-0.4, 1.3, 0], shapes: [{{box: {{size: [0.3, "
                "0.2, 0.06]}}, material: m}}]}}\n",
                step, along, -across, mu),
            "test.yaml"));
        run.finish();
        return run.pose("b").position;
    };
    using Values = std::array<double, 4>;
    const auto rate = [&](const Values& y) {
        const double speed = std::hypot(y[2], y[3]), friction = mu * across / speed;
        return Values{y[2], y[3], along - friction * y[2], -friction * y[3]};
    };
    Values y = {0.0, 0.0, -0.4, 1.3};
    constexpr int parts = 20000;
    for (int i = 0; i < parts; ++i) {
        const double h = 0.9 / parts;
        const Values first = rate(y);
        Values middle = y;
        for (std::size_t k = 0; k < 4; ++k) middle[k] += 0.5 * h * first[k];
        const Values second = rate(middle);
        for (std::size_t k = 0; k < 4; ++k) y[k] += h * second[k];
    }
    for (const double step : {0.018, 0.009, 0.0045, 0.00225}) {
        const auto place = last_place(step);
        EXPECT_LT(std::hypot(place[0] - y[0], place[1] - y[1]), 6.0 * step * step) << step;
    }
}

// What rides on a turntable does not slide: its sliding velocity is rounding, whose direction says nothing.
TEST(TurnOfFriction, IsNoneWhereNothingSlides) {
    for (const double step : {1.0 / 60.0, 1.0 / 240.0}) {
        Running run(parse_scene(
            fmt::format(
                "step: {:.17g}\nend: 4\nmaterials: {{m: {{friction: 0.5}}}}\nbodies:\n"
                "- {{name: table, position: [0, 0, -0.05], motion: {{rotation: {{axis: [0, 0, 1], angle: "
                "{{linear: {{rate: 2}}}}}}}}, shapes: [{{cylinder: {{radius: 2, length: 0.1}}, material: m}}]}}\n"
                "- {{name: b, mass: 3, position: [1, 0, 0.15], velocity: [0, 2, 0], angular_velocity: [0, 0, "
                "2], shapes: [{{box: {{size: [0.3, 0.3, 0.3]}}, material: m}}]}}\n",
                step),
            "test.yaml"));
        run.finish();
        const auto& at = run.pose("b").position;
        EXPECT_NEAR(std::hypot(at[0], at[1]), 1.0, 1e-3) << step;
    }
}

}  // namespace
}  // namespace delassus::tests::friction_turns_test
