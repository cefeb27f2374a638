// SPDX-License-Identifier: BSD-3-Clause
// Bodies that move far in a step: nothing passes through anything.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <random>

#include "support/scenes.hpp"

namespace delassus::tests::fast_bodies_test {
namespace {

#ifdef DELASSUS_HAS_FCL

constexpr const char* ball = "inertia: {xx: 1e-4, yy: 1e-4, zz: 1e-4}, mass: 0.12";

/// A ball above a thin plate that falls at 32 m/s.
Scene ball_above_plate(double z, const std::string& stepping) {
    return parse_scene(
        fmt::format(
            "{{{}, end: 0.5123, bodies: [{{name: plate, fixed: true, shapes: [{{box: {{size: [2, 2, 0.01]}}}}]}}, "
            "{{name: ball, {}, position: [0.1, 0.02, {}], velocity: [0.5, 0, -32.3], shapes: [{{sphere: "
            "{{radius: 0.0512345}}}}]}}]}}",
            stepping, ball, z),
        "plate");
}

// The first ball pushes the second into the third, and so on, all in one step, in whose beginning only the first two
// meet. Without restitution they go on together; no step is divided for that.
TEST(FastBodies, BallsThatArePushedIntoOthersWithinAStepMeetThem) {
    for (const char* method : {"auto", "euler_implicit_linearized", "moreau_jean"}) {
        SCOPED_TRACE(method);
        std::string bodies;
        for (int i = 0; i < 5; ++i)
            bodies += fmt::format(
                "- {{name: ball{}, mass: 1, position: [{:.17g}, 0, 0], velocity: [{}, 0, 0], shapes: "
                "[{{sphere: {{radius: 0.1}}, material: m}}]}}\n",
                i, 0.212 * i, i == 0 ? 20 : 0);
        Running run(
            parse_scene(fmt::format("step: 0.01\nend: 0.1\nintegrator: {{name: {}}}\ngravity: [0, 0, 0]\nmaterials: "
                                    "{{m: {{friction: 0.3}}}}\nbodies:\n{}",
                                    method, bodies),
                        "test.yaml"));
        run.finish();
        for (int i = 0; i < 5; ++i) EXPECT_NEAR(run.velocities(fmt::format("ball{}", i))[0][0], 4.0, 1e-6) << i;
        const auto& totals = run.simulation.totals();
        EXPECT_LT(totals.worst_penetration, 1e-6);
        EXPECT_EQ(totals.divided_steps, 0);
        EXPECT_EQ(totals.deep_steps, 0);
    }
}

// A step takes the ball 152 mm far, and ball and plate are 113 mm thick together: by the phase of the impact in the
// step it used to stop, to sink in by centimetres, or to fly on below.
TEST(FastBodies, ABallStopsOnAThinPlateAtAnyPhase) {
    for (double z = 2.340123; z < 2.5; z += 0.009321) {
        Running run(ball_above_plate(z, "step: 0.0047"));
        run.finish();
        EXPECT_NEAR(run.pose("ball").position[2], 0.0562345, 1e-6) << z;
        EXPECT_LT(run.simulation.totals().worst_penetration, 1e-6) << z;
    }
}

// A method of order 2 that takes impacts at the end of a step moves on with half of the old velocity after them. Where
// that would be through the plate, a step of fixed size is taken in parts, and a tolerance finds the impact. Others
// take impacts at their own time.
TEST(FastBodies, MethodsOfOrderTwoNeverGoThroughAPlate) {
    for (const std::string method : {"moreau_jean", "linearly_implicit_trapezoidal", "nonsmooth_generalized_alpha"}) {
        std::int64_t divided = 0;
        for (double z = 2.340123; z < 2.5; z += 0.037321) {
            Running fixed(ball_above_plate(z, "step: 0.0083, integrator: " + method));
            fixed.finish();
            divided += fixed.simulation.totals().divided_steps;
            EXPECT_NEAR(fixed.pose("ball").position[2], 0.0562345, 1e-3) << method << ", " << z;
            Running adaptive(ball_above_plate(z, "tolerance: 1e-4, integrator: " + method));
            adaptive.finish();
            EXPECT_NEAR(adaptive.pose("ball").position[2], 0.0562345, 1e-4) << method << ", " << z;
        }
        EXPECT_EQ(divided > 0, method == "nonsmooth_generalized_alpha") << method;
    }
}

// Without weight: a wall that drives at 20 m/s takes the ball along, and one ball pushes the next.
TEST(FastBodies, ADrivenWallTakesBallsAlong) {
    Running run(parse_scene(
        fmt::format("{{step: 0.005, end: 0.1, gravity: [0, 0, 0], bodies: [{{name: wall, motion: {{translation: "
                    "[{{linear: {{rate: 20}}}}, 0, 0]}}, shapes: [{{box: {{size: [0.02, 1, 1]}}}}]}}, {{name: near, "
                    "{0}, position: [0.234567, 0, 0], shapes: [{{sphere: {{radius: 0.02}}}}]}}, {{name: next, {0}, "
                    "position: [0.876543, 0, 0], shapes: [{{sphere: {{radius: 0.02}}}}]}}]}}",
                    ball),
        "wall"));
    run.finish();
    EXPECT_NEAR(run.pose("wall").position[0], 2.0, 1e-9);
    EXPECT_GT(run.pose("near").position[0], 2.03 - 1e-6);
    EXPECT_GT(run.pose("next").position[0], 2.07 - 1e-6);
    EXPECT_GT(run.velocities("next")[0][0], 20.0 - 1e-6);
}

// Boxes that fall on one another with spin. With a step of 1 ms they move by up to 5 mm and turn by up to 0.03 rad in a
// step, so that points sink in by the square of that over their size and by the solver's tolerance.
TEST(FastBodies, FallingBoxesHardlySinkIn) {
    std::mt19937 engine(11);
    const auto random = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(engine);
    };
    std::string text = "step: 0.001\nend: 1.2\nbodies:\n  - {name: ground, fixed: true, shapes: [{plane: {}}]}\n";
    for (int k = 0; k < 20; ++k)
        text += fmt::format(
            "  - {{name: b{}, mass: 1.2, inertia: {{xx: 0.0041, yy: 0.0062, zz: 0.0081}}, position: [{:.6f}, {:.6f}, "
            "{:.6f}], orientation: {{axis: [1, 0.3, {:.6f}], angle: {:.4f}}}, angular_velocity: [{:.4f}, {:.4f}, "
            "{:.4f}], shapes: [{{box: {{size: [0.24, 0.16, 0.12]}}}}]}}\n",
            k, random(-0.2, 0.2), random(-0.2, 0.2), 0.4 + 0.33 * k, random(0.0, 1.0), random(0.0, 180.0),
            random(-6.0, 6.0), random(-6.0, 6.0), random(-6.0, 6.0));
    Running run(parse_scene(text, "boxes"));
    run.finish();
    EXPECT_LT(run.simulation.totals().worst_penetration, 4e-3);
    EXPECT_GT(run.simulation.totals().most_contacts, 20);
}

#endif

}  // namespace
}  // namespace delassus::tests::fast_bodies_test
