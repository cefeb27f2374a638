// SPDX-License-Identifier: BSD-3-Clause
// Kinematic bodies and follower loads against closed forms.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "delassus/plan.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::kinematic_test {
namespace {

constexpr double g = 9.81, pi = std::numbers::pi;

/// A box with μ = 0.4 on a table that moves along x, with the box's velocity at the start.
std::string box_on_table(const std::string& motion, double velocity, double step = 1e-3) {
    return fmt::format(
        "step: {}\nend: 100\nmaterials: {{wood: {{friction: 0.4}}}}\nbodies:\n"
        "  - {{name: table, position: [0, 0, -0.1], motion: {{translation: [{}, 0, 0]}},\n"
        "     shapes: [{{box: {{size: [40, 4, 0.2]}}, material: wood}}]}}\n"
        "  - {{name: box, mass: 2, position: [0, 0, 0.1], velocity: [{}, 0, 0],\n"
        "     shapes: [{{box: {{size: [0.4, 0.4, 0.2]}}, material: wood}}]}}\n",
        step, motion, velocity);
}

void run_to(Running& run, double t) {
    while (run.simulation.state().t < t - 1e-9) run.simulation.step();
}

double box_x(const Running& run) {
    return run.pose("box").position[0];
}

// x = a sin(ω t): a ω² = 0.9 μ g holds the box, which begins with the speed of the table.
TEST(KinematicBody, CarriesABoxBelowTheBoundOfFriction) {
    const double f = 1.0, omega = 2.0 * pi * f, a = 0.9 * 0.4 * g / (omega * omega);
    Running run(
        parse_scene(box_on_table(fmt::format("{{sine: {{amplitude: {}, frequency: {}}}}}", a, f), a * omega), "s"));
    double worst = 0.0;
    while (run.simulation.state().t < 1.3) {
        run.simulation.step();
        worst = std::max(worst, std::abs(box_x(run) - a * std::sin(omega * run.simulation.state().t)));
    }
    EXPECT_LT(worst, 1e-3 * a);
    EXPECT_NEAR(run.pose("table").position[0], a * std::sin(omega * run.simulation.state().t), 1e-12);
    EXPECT_NEAR(run.velocities("table")[0][0], a * omega * std::cos(omega * run.simulation.state().t), 1e-12);
}

// With a ω² = 4 μ g the box slips: from t = 0, where the table turns back slowly, it begins to slide when ω² a sin(ω t)
// = μ g, and slides on with the deceleration μ g until the speeds are equal again.
TEST(KinematicBody, LeavesABoxBehindAboveTheBound) {
    const double f = 1.0, omega = 2.0 * pi * f, mug = 0.4 * g, a = 4.0 * mug / (omega * omega);
    Running run(parse_scene(
        box_on_table(fmt::format("{{sine: {{amplitude: {}, frequency: {}}}}}", a, f), a * omega, 2e-4), "s"));
    const double slip = std::asin(0.25) / omega;
    run_to(run, slip - 2e-3);
    EXPECT_NEAR(box_x(run), a * std::sin(omega * run.simulation.state().t), 1e-3 * a);
    const double x0 = a * std::sin(omega * slip), v0 = a * omega * std::cos(omega * slip);
    run_to(run, 0.4);
    const double t = run.simulation.state().t - slip;
    ASSERT_GT(v0 - mug * t, a * omega * std::cos(omega * (slip + t)));  // the table is slower all the time
    EXPECT_NEAR(run.velocities("box")[0][0], v0 - mug * t, 2e-3);
    EXPECT_NEAR(box_x(run), x0 + v0 * t - 0.5 * mug * t * t, 1e-3);
}

// A conveyor of 2 m/s: a box that is put down slides for 2/(μ g) and then goes with it, exactly.
TEST(KinematicBody, ConveysABox) {
    Running run(parse_scene(box_on_table("{linear: {rate: 2}}", 0.0), "s"));
    const double sliding = 2.0 / (0.4 * g);
    run_to(run, 0.3);
    EXPECT_NEAR(run.velocities("box")[0][0], 0.4 * g * 0.3, 2e-3);
    run_to(run, 2.0);
    EXPECT_NEAR(run.velocities("box")[0][0], 2.0, 1e-9);
    EXPECT_NEAR(box_x(run), 2.0 * 2.0 - 0.5 * 2.0 * sliding, 3e-3);
    EXPECT_NEAR(run.pose("box").position[2], 0.1, 3e-3);
}

// Up and down with a ω² < g: the box stays on the table, whose motion it follows to the last digits of the solver.
TEST(KinematicBody, LiftsABox) {
    std::string yaml = box_on_table("0", 0.0);
    const std::string along_x = "translation: [0, 0, 0]";
    yaml.replace(yaml.find(along_x), along_x.size(), "translation: [0, 0, {sine: {amplitude: 0.1, frequency: 1}}]");
    const std::string still = "velocity: [0, 0, 0]";
    yaml.replace(yaml.find(still), still.size(), fmt::format("velocity: [0, 0, {}]", 0.1 * 2.0 * pi));
    Running run(parse_scene(yaml, "s"));
    double worst = 0.0;
    while (run.simulation.state().t < 1.5) {
        run.simulation.step();
        const double t = run.simulation.state().t;
        worst = std::max(worst, std::abs(run.pose("box").position[2] - 0.1 - 0.1 * std::sin(2.0 * pi * t)));
    }
    EXPECT_LT(worst, 1e-5);
}

/// A box at r = 0.4 m on a turntable with the speed ω, that goes with it at the start; μ g = 3.924 m/s².
std::string turntable(double omega) {
    return fmt::format(
        "step: 0.0005\nend: 10\nmaterials: {{wood: {{friction: 0.4}}}}\nbodies:\n"
        "  - {{name: table, position: [0, 0, -0.1], motion: {{rotation: {{axis: [0, 0, 2], angle: {{linear: {{rate: "
        "{0}}}}}}}}},\n"
        "     shapes: [{{cylinder: {{radius: 1, length: 0.2}}, material: wood}}]}}\n"
        "  - {{name: box, mass: 2, position: [0.4, 0, 0.05], velocity: [0, {1}, 0], angular_velocity: [0, 0, {0}],\n"
        "     shapes: [{{box: {{size: [0.1, 0.1, 0.1]}}, material: wood}}]}}\n",
        omega, 0.4 * omega);
}

TEST(KinematicBody, TurnsABoxBelowTheBoundOfFriction) {
    Running run(parse_scene(turntable(3.0), "s"));  // ω² r = 3.6 m/s²
    run_to(run, 2.0);
    const auto x = run.pose("box").position;
    EXPECT_NEAR(std::hypot(x[0], x[1]), 0.4, 2e-3);
    EXPECT_NEAR(std::remainder(std::atan2(x[1], x[0]) - 6.0, 2.0 * pi), 0.0, 2e-3);
    EXPECT_NEAR(run.velocities("box")[1][2], 3.0, 1e-5);
}

// Along the tangent of its place it would go outwards by r ω² h/2 a second.
TEST(KinematicBody, CarriesABoxRoundForGood) {
    const auto grows = [](const std::string& integrator, double step) {
        SceneOverrides overrides;
        overrides.integrator = integrator;
        Running run(parse_scene(
            fmt::format(
                "step: {}\nend: 10\nmaterials: {{m: {{friction: 0.5}}}}\nbodies:\n"
                "  - {{name: disc, position: [0, 0, -0.05], motion: {{rotation: {{axis: [0, 0, 1],\n"
                "     angle: {{linear: {{rate: 2}}}}}}}}, shapes: [{{cylinder: {{radius: 2, length: 0.1}},\n"
                "     material: m}}]}}\n"
                "  - {{name: box, mass: 13.5, position: [1, 0, 0.15], velocity: [0, 2, 0],\n"
                "     angular_velocity: [0, 0, 2], shapes: [{{box: {{size: [0.3, 0.3, 0.3]}}, material: m}}]}}\n",
                step),
            "s", overrides));
        run.finish();
        const auto x = run.pose("box").position;
        return std::max(std::abs(std::hypot(x[0], x[1]) - 1.0),
                        std::abs(std::remainder(std::atan2(x[1], x[0]) - 20.0, 2.0 * pi)));
    };
    for (const double step : {1.0 / 24.0, 1.0 / 60.0, 0.005}) {
        EXPECT_LT(grows("euler_implicit_linearized", step), 1e-8) << step;
        for (const char* integrator : {"moreau_jean", "linearly_implicit_trapezoidal", "switching"})
            EXPECT_LT(grows(integrator, step), 1.5 * step * step) << integrator << ' ' << step;
    }
}

// A drum that turns about a level axis: what rides on its inside, as far from the axis, keeps its gap as well.
TEST(KinematicBody, HoldsWhatRidesInADrum) {
    const auto ends = [](const std::string& integrator) {
        SceneOverrides overrides;
        overrides.integrator = integrator;
        Running run(parse_scene(
            "step: 0.01\nend: 6\ngravity: [0, 0, 0]\nmaterials: {m: {friction: 0.5}}\nbodies:\n"
            "  - {name: drum, position: [0, 0, 0], motion: {rotation: {axis: [0, 1, 0],\n"
            "     angle: {linear: {rate: 3}}}}, shapes: [{box: {size: [1, 1, 0.2]}, position: [0, 0, -1.1],\n"
            "     material: m}]}\n"
            "  - {name: box, mass: 2, position: [0, 0, -0.8], velocity: [-2.4, 0, 0],\n"
            "     angular_velocity: [0, 3, 0], shapes: [{box: {size: [0.4, 0.4, 0.4]}, material: m}]}\n",
            "s", overrides));
        run.finish();
        const auto x = run.pose("box").position;
        return std::pair(std::hypot(x[0], x[2]) - 0.8, std::remainder(std::atan2(-x[0], -x[2]) - 18.0, 2.0 * pi));
    };
    const auto [radius, angle] = ends("euler_implicit_linearized");
    EXPECT_NEAR(radius, 0.0, 1e-6);
    EXPECT_NEAR(angle, 0.0, 1e-6);
    const auto [radius_2, angle_2] = ends("linearly_implicit_trapezoidal");
    EXPECT_NEAR(radius_2, 0.0, 1e-4);
    EXPECT_NEAR(angle_2, 0.0, 1e-3) << "it slips as it is set down";
}

// Round bodies that turn about their own axes do not change: a board rests on them for ever.
TEST(KinematicBody, RollersCarryABoard) {
    for (const std::string shape : {"cylinder: {radius: 0.1, length: 0.4}", "capsule: {radius: 0.1, length: 0.4}"})
        for (const std::string step : {"0.002", "0.0167", "0.0131, integrator: euler_implicit_linearized"}) {
            SCOPED_TRACE(shape + ", step " + step);
            Running run(parse_scene(
                fmt::format(
                    "{{step: {}, end: 2, materials: {{m: {{friction: 0.3}}}}, bodies: ["
                    "{{name: left, position: [-0.5, 0, -0.1], orientation: {{axis: [1, 0, 0], angle: 90}}, "
                    "motion: {{rotation: {{axis: [0, 1, 0], angle: {{linear: {{rate: 60}}}}}}}}, "
                    "shapes: [{{{}, material: m}}]}}, "
                    "{{name: right, position: [0.5, 0, -0.1], orientation: {{axis: [1, 0, 0], angle: 90}}, "
                    "motion: {{rotation: {{axis: [0, 1, 0], angle: {{linear: {{rate: -60}}}}}}}}, "
                    "shapes: [{{{}, material: m}}]}}, "
                    "{{name: board, mass: 2, position: [0, 0, 0.05], shapes: [{{box: {{size: [1.4, 0.3, 0.1]}}, "
                    "material: m}}]}}]}}",
                    step, shape, shape),
                "s"));
            run.finish();
            EXPECT_NEAR(run.pose("board").position[0], 0.0, 1e-6);
            EXPECT_NEAR(run.pose("board").position[2], 0.05, 1e-6);
        }
}

TEST(KinematicBody, ThrowsABoxOffAboveTheBound) {
    Running run(parse_scene(turntable(3.5), "s"));  // ω² r = 4.9 m/s²
    run_to(run, 1.0);
    const auto x = run.pose("box").position;
    EXPECT_GT(std::hypot(x[0], x[1]), 0.6);
}

// A joint to a kinematic crank: the end of an arm of 0.5 m goes round, and a slider is pushed by a rod of 2 m.
TEST(KinematicBody, DrivesAMechanismByItsJoints) {
    const std::string scene =
        "step: 0.0005\nend: 0.4\ngravity: [0, 0, 0]\nbodies:\n"
        "  - {name: crank, motion: {rotation: {axis: [0, 1, 0], angle: {polynomial: [0, 0, -6]}}}}\n"
        "  - {name: rod, mass: 1, inertia: {xx: 0.1, yy: 0.4, zz: 0.4}, position: [1.5, 0, 0]}\n"
        "  - {name: slider, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, position: [2.5, 0, 0]}\n"
        "joints:\n"
        "  - {name: pin, kind: spherical, first: crank, second: rod, point: [0.5, 0, 0]}\n"
        "  - {name: wrist, kind: universal, first: slider, second: rod, point: [2.5, 0, 0], axis: [0, 0, 1],\n"
        "     second_axis: [0, 1, 0]}\n"
        "  - {name: rail, kind: prismatic, second: slider, point: [2.5, 0, 0], axis: [1, 0, 0]}\n";
    for (const auto& [integrator, tolerance] :
         {std::pair<std::string, double>{"trapezoidal", 1e-9}, {"euler_implicit_linearized", 2e-4}, {"hht", 1e-9}}) {
        SceneOverrides overrides;
        overrides.integrator = integrator;
        Running run(parse_scene(scene, "s", overrides));
        run.finish();
        // An angle of −6 t² about y turns x upwards (towards z).
        const double phi = 6.0 * 0.16;
        const double x = 0.5 * std::cos(phi) + std::sqrt(4.0 - std::pow(0.5 * std::sin(phi), 2));
        EXPECT_NEAR(run.pose("slider").position[0], x, tolerance) << integrator;
    }
}

// A spring and a damper between a shaker and a mass: the stationary answer of m ẍ + c ẋ + k x = k z + c ż is
// Z |k + i c ω|/|k − m ω² + i c ω|. Base excitation.
TEST(KinematicBody, ShakesAMassOverASpring) {
    const double k = 200.0, c = 20.0, m = 2.0, f = 2.0, omega = 2.0 * pi * f, Z = 0.01;
    SceneOverrides overrides;
    overrides.integrator = "trapezoidal";
    Running run(parse_scene(
        fmt::format(
            "step: 0.0005\nend: 6\ngravity: [0, 0, 0]\nbodies:\n"
            "  - {{name: shaker, motion: {{translation: [{{sine: {{amplitude: {}, frequency: {}}}}}, 0, 0]}}}}\n"
            "  - {{name: mass, mass: {}, inertia: {{xx: 1, yy: 1, zz: 1}}, position: [1, 0, 0]}}\n"
            "joints: [{{name: rail, kind: prismatic, second: mass, point: [1, 0, 0], axis: [1, 0, 0]}}]\n"
            "springs: [{{name: s, first: shaker, second: mass, stiffness: {}, damping: {}}}]\n",
            Z, f, m, k, c),
        "s", overrides));
    run_to(run, 5.0);
    double largest = 0.0;
    while (run.simulation.state().t < 6.0 - 1e-9) {
        run.simulation.step();
        largest = std::max(largest, std::abs(run.pose("mass").position[0] - 1.0));
    }
    const double expected = Z * std::hypot(k, c * omega) / std::hypot(k - m * omega * omega, c * omega);
    EXPECT_NEAR(largest, expected, 2e-4 * expected);
}

/// The first t > 0 with f(t) = 0, where f falls; f(0) > 0.
template <class Function>
double first_zero(const Function& f) {
    double last = 0.0, next = 1e-4;
    while (f(next) > 0.0) last = next, next += 1e-4;
    for (int k = 0; k < 60; ++k) (f(0.5 * (last + next)) > 0.0 ? last : next) = 0.5 * (last + next);
    return last;
}

// A bat of the thickness 2 b turns at ω about the origin; a ball at rest at c is hit where its distance from the bat's
// middle is b + r, and leaves along the normal of then.
TEST(KinematicBody, HitsABallAsItMovesAtThatInstant) {
    const double omega = 3.0, b = 0.03, r = 0.05, x = 0.8, y = 0.35, e = 0.6, end = 0.7;
    const double hit = first_zero([&](double t) { return y * std::cos(omega * t) - x * std::sin(omega * t) - b - r; });
    const double along = x * std::cos(omega * hit) + y * std::sin(omega * hit);
    const double way = (1.0 + e) * omega * along * (end - hit);
    for (const double h : {1.0 / 60.0, 0.0073, 0.005, 0.001}) {
        SCOPED_TRACE(h);
        Running run(parse_scene(
            fmt::format("step: {:.17g}\nend: {}\ngravity: [0, 0, 0]\nmaterials: {{m: {{restitution: {}}}}}\nbodies:\n"
                        "- {{name: bat, position: [0.5, 0, 0], motion: {{rotation: {{angle: {{linear: {{rate: {}}}}}, "
                        "point: [0, 0, 0]}}}}, shapes: [{{box: {{size: [1, {}, 0.3]}}, material: m}}]}}\n"
                        "- {{name: ball, mass: 0.3, position: [{}, {}, 0], shapes: [{{sphere: {{radius: {}}}, "
                        "material: m}}]}}\n",
                        h, end, e, omega, 2.0 * b, x, y, r),
            "s"));
        run.finish();
        EXPECT_NEAR(run.pose("ball").position[0], x - way * std::sin(omega * hit), 4.0 * h * h);
        EXPECT_NEAR(run.pose("ball").position[1], y + way * std::cos(omega * hit), 4.0 * h * h);
    }
}

// Parabolas between bounces off a plate that goes up and down: its speed of that instant counts.
TEST(KinematicBody, ThrowsUpWhatBouncesOnIt) {
    const double a = 0.03, omega = 2.0 * pi * 4.0, e = 0.7, r = 0.05, end = 1.4;
    double z = 0.3, u = 0.0, t = 0.0;
    for (;;) {
        const auto gap = [&](double d) { return z + u * d - 0.5 * g * d * d - a * std::sin(omega * (t + d)) + 1e-12; };
        const double flight = std::min(first_zero(gap), end - t);
        z += u * flight - 0.5 * g * flight * flight;
        u -= g * flight;
        t += flight;
        if (!(t < end)) break;
        const double plate = a * omega * std::cos(omega * t);
        u = plate + e * (plate - u);
    }
    for (const double h : {1.0 / 60.0, 0.0073, 0.005, 0.001}) {
        SCOPED_TRACE(h);
        Running run(parse_scene(
            fmt::format("step: {:.17g}\nend: {}\nmaterials: {{m: {{restitution: {}}}}}\nbodies:\n"
                        "- {{name: plate, position: [0, 0, -0.1], motion: {{translation: [0, 0, {{sine: {{amplitude: "
                        "{}, frequency: 4}}}}]}}, shapes: [{{box: {{size: [4, 4, 0.2]}}, material: m}}]}}\n"
                        "- {{name: ball, mass: 1, position: [0, 0, {}], shapes: [{{sphere: {{radius: {}}}, material: "
                        "m}}]}}\n",
                        h, end, e, a, 0.3 + r, r),
            "s"));
        run.finish();
        EXPECT_NEAR(run.pose("ball").position[2], z + r, 15.0 * h * h);
    }
}

TEST(KinematicBody, IsInThePlanAndStartsWhereItsMotionDoes) {
    Scene scene = parse_scene(box_on_table("{linear: {start: 3, rate: 2}}", 0.0), "s");
    EXPECT_EQ(scene.systems[0].bodies[0].pose.position[0], 3.0);
    const auto plan = make_plan(scene, registry()).front();
    EXPECT_EQ(plan.velocities, 6);
    EXPECT_TRUE(std::any_of(plan.kept.begin(), plan.kept.end(),
                            [](const auto& line) { return line.what == "1 kinematic body"; }));
}

// ---- Follower loads ----

// A thrust F along the x axis of a body that turns with ω about z from the start: v = F/(m ω) (sin ω t, 1 − cos ω t).
TEST(FollowerLoad, TurnsWithItsBody) {
    const std::string scene =
        "step: 0.0005\nend: 2\ngravity: [0, 0, 0]\n"
        "bodies: [{name: rocket, mass: 2, inertia: {xx: 1, yy: 2, zz: 2.5}, angular_velocity: [0, 0, 3]}]\n"
        "loads: [{name: thrust, body: rocket, force: [10, 0, 0], follower: true}]\n";
    const auto check = [&](const std::string& integrator, double tolerance) {
        SceneOverrides overrides;
        overrides.integrator = integrator;
        Running run(parse_scene(scene, "s", overrides));
        run.finish();
        const auto v = run.velocities("rocket")[0];
        EXPECT_NEAR(v[0], 10.0 / 6.0 * std::sin(6.0), tolerance) << integrator;
        EXPECT_NEAR(v[1], 10.0 / 6.0 * (1.0 - std::cos(6.0)), tolerance) << integrator;
        EXPECT_NEAR(run.velocities("rocket")[1][2], 3.0, 1e-8) << integrator;
    };
    check("trapezoidal", 2e-6);
    check("generalized_alpha", 2e-6);
    check("rk4", 1e-9);
    check("euler_implicit_linearized", 5e-3);
}

// Off the centre it turns the body evenly: ω̇ = s F/J, φ = s F t²/2J.
TEST(FollowerLoad, HasAConstantMoment) {
    SceneOverrides overrides;
    overrides.integrator = "trapezoidal";
    Running run(
        parse_scene("step: 0.001\nend: 1.5\ngravity: [0, 0, 0]\n"
                    "bodies: [{name: wheel, mass: 2, inertia: {xx: 1, yy: 2, zz: 2.5}}]\n"
                    "joints: [{name: axle, kind: revolute, second: wheel}]\n"
                    "loads: [{name: jet, body: wheel, force: [0, 5, 0], torque: [0, 0, 1], point: [0.8, 0, 0],\n"
                    "         follower: true}]\n",
                    "s", overrides));
    run.finish();
    EXPECT_NEAR(run.velocities("wheel")[1][2], (0.8 * 5.0 + 1.0) / 2.5 * 1.5, 1e-9);
}

}  // namespace
}  // namespace delassus::tests::kinematic_test
