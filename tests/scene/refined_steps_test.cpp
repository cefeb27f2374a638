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
