// SPDX-License-Identifier: BSD-3-Clause
// `accuracy`: the error of a run follows it, whatever the units, the step shown and the frame.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "support/scenes.hpp"

namespace delassus::accuracy_of_runs_test {
namespace {

using Eigen::Vector3d;
using tests::Running;

constexpr double g = 9.81;

/// Where a scene stands, and its unit of length.
struct Frame {
    double unit;
    Eigen::Quaterniond turn;

    [[nodiscard]] std::string vector(const Vector3d& v, double factor) const {
        const Vector3d turned = factor * (turn * v);
        return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", turned[0], turned[1], turned[2]);
    }
    [[nodiscard]] std::string length(const Vector3d& v) const { return vector(v, unit); }
    [[nodiscard]] std::string orientation(const Eigen::Quaterniond& q = Eigen::Quaterniond::Identity()) const {
        const Eigen::Quaterniond all = turn * q;
        return fmt::format("[{:.17g}, {:.17g}, {:.17g}, {:.17g}]", all.w(), all.x(), all.y(), all.z());
    }
    [[nodiscard]] Vector3d back(const Vector3& place) const {
        return turn.conjugate() * Vector3d(place[0], place[1], place[2]) / unit;
    }
};

const Frame frames[] = {
    {1.0, Eigen::Quaterniond::Identity()},
    {1000.0, Eigen::Quaterniond(Eigen::AngleAxisd(1.234, Vector3d(0.3, -0.7, 0.5).normalized()))},
};

/// A run of a body named b to the end; where it is then, in the frame of the first scene and m.
struct Case {
    double end, step;
    double friction = 0.0, restitution = 0.0;
    std::string bodies, rest;

    [[nodiscard]] Running run(double accuracy, const Frame& frame) const {
        Running run(parse_scene(
            fmt::format("accuracy: {}\nstep: {}\nend: {:.17g}\ngravity: {}\nmaterials: {{m: {{friction: {:.17g}, "
                        "restitution: {:.17g}}}}}\nbodies:\n{}{}",
                        accuracy, step, end, frame.length({0.0, 0.0, -g}), friction, restitution, bodies, rest),
            "test.yaml"));
        run.finish();
        EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
        return run;
    }
};

std::string box(const Frame& frame, const std::string& name, const Vector3d& at, const Vector3d& size,
                const std::string& more) {
    return fmt::format(
        "- {{name: {}, position: {}, orientation: {}, shapes: [{{box: {{size: [{:.17g}, {:.17g}, {:.17g}]}}, material: "
        "m}}], {}}}\n",
        name, frame.length(at), frame.orientation(), frame.unit * size[0], frame.unit * size[1], frame.unit * size[2],
        more);
}

std::string plane(const Frame& frame, const std::string& name, const Eigen::Quaterniond& q, const Vector3d& at) {
    return fmt::format(
        "- {{name: {}, fixed: true, position: {}, orientation: {}, shapes: [{{plane: {{}}, material: "
        "m}}]}}\n",
        name, frame.length(at), frame.orientation(q));
}

/// For all frames and accuracies: the error of b's place, in m, is at most `times` the accuracy of its size, over the
/// time of the run.
template <class Make>
void expect_right(Make make, const Vector3d& right, double size, double times) {
    for (const Frame& frame : frames)
        for (const double accuracy : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5}) {
            SCOPED_TRACE(fmt::format("unit {}, accuracy {}", frame.unit, accuracy));
            const Case given = make(frame);
            const Running run = given.run(accuracy, frame);
            const double error = (frame.back(run.pose("b").position) - right).norm();
            EXPECT_LE(error, times * accuracy * size * std::max(given.end, 1.0));
        }
}

const Eigen::Quaterniond upright = Eigen::Quaterniond::Identity();

// A ball slides off a table without friction, faster than √(g R): from the edge on it falls. No step ends there.
TEST(Accuracy, ABallFallsFromTheEdgeOn) {
    const double R = 0.1, v = 1.925, d = 0.4, end = d / v + 0.4;
    const double t = end - d / v;
    const auto make = [&](const Frame& frame) {
        return Case{end,
                    0.0137,
                    0.0,
                    0.0,
                    box(frame, "table", {-1.0, 0.0, -0.1}, {2.0, 2.0, 0.2}, "fixed: true") +
                        fmt::format("- {{name: b, mass: 1, position: {}, velocity: {}, shapes: [{{sphere: {{radius: "
                                    "{}}}, material: m}}]}}\n",
                                    frame.length({-d, 0.0, R}), frame.length({v, 0.0, 0.0}), R * frame.unit),
                    {}};
    };
    expect_right(make, {v * end - d, 0.0, R - 0.5 * g * t * t}, R, 10.0);
}

// A box rides on a lift that moves as a sine, with up to 0.8 g: nothing meets anything, and no impact is to be found.
TEST(Accuracy, ABoxStaysOnItsLift) {
    const double f = 1.3, w = 2.0 * std::numbers::pi * f, A = 0.8 * g / (w * w), end = 2.7;
    const auto make = [&](const Frame& frame) {
        std::string motion;
        for (int i = 0; i < 3; ++i) {
            const double c = A * (frame.unit * (frame.turn * Vector3d(0.0, 0.0, 1.0)))[i];
            motion += fmt::format("{}{{sine: {{amplitude: {:.17g}, frequency: {}, phase: {:.17g}, offset: {:.17g}}}}}",
                                  i == 0 ? "" : ", ", c, f, 0.5 * std::numbers::pi, -c);
        }
        return Case{end,
                    0.01,
                    0.5,
                    0.0,
                    box(frame, "lift", {0.0, 0.0, -0.1}, {2.0, 2.0, 0.2}, "motion: {translation: [" + motion + "]}") +
                        box(frame, "b", {0.0, 0.0, 0.1}, {0.3, 0.2, 0.2}, "mass: 1"),
                    {}};
    };
    expect_right(make, {0.0, 0.0, 0.1 + A * std::cos(w * end) - A}, 0.15, 1.0);
    const Running run = make(frames[0]).run(1e-3, frames[0]);
    EXPECT_LT(run.simulation.totals().rejected, 400);
    EXPECT_EQ(run.simulation.totals().inexact_steps, 0);
    EXPECT_EQ(run.simulation.totals().impacts, 0);
}

// A ball that rolls on a turntable goes round with 2/7 of its rate (Weltner, Am. J. Phys. 55, 1987). Held by friction,
// it slides at no time, though rows of one time have it slide with the speeds of another.
TEST(Accuracy, ABallRollsRoundOnATurntable) {
    const double turn = 3.0, radius = 0.1, end = 2.0, rate = 2.0 / 7.0 * turn, x0 = 1.0, v0 = 0.5;
    const double centre = x0 - v0 / rate,
                 right[] = {centre + (x0 - centre) * std::cos(rate * end), (x0 - centre) * std::sin(rate * end)};
    for (const double accuracy : {1e-3, 1e-4, 1e-5}) {
        auto run = Running(parse_scene(
            fmt::format(
                "accuracy: {}\nstep: {:.17g}\nend: {}\nmaterials: {{m: {{friction: 1}}}}\nbodies:\n"
                "- {{name: disc, position: [0, 0, -0.1], motion: {{rotation: {{axis: [0, 0, 1], angle: {{linear: "
                "{{rate: {}}}}}}}}}, shapes: [{{cylinder: {{radius: 5, length: 0.2}}, material: m}}]}}\n"
                "- {{name: ball, position: [{}, 0, {}], density: 1000, velocity: [0, {}, 0], angular_velocity: [{}, 0, "
                "0], shapes: [{{sphere: {{radius: {}}}, material: m}}]}}\n",
                accuracy, 1.0 / 60.0, end, turn, x0, radius, v0, (turn * x0 - v0) / radius, radius),
            "test.yaml"));
        run.finish();
        const auto& at = run.pose("ball").position;
        EXPECT_LT(std::hypot(at[0] - right[0], at[1] - right[1]), accuracy * end) << accuracy;
        EXPECT_LT(run.simulation.totals().newton_iterations, 20000) << accuracy;
    }
}

// A box slides without friction, flat against a wall, and comes back: all corners bounce at once, by rounding or not.
TEST(Accuracy, ABoxComesBackFlatFromAWall) {
    const double e = 0.586, v = 4.62, d = 0.83, end = 0.39, after = end - d / v;
    const auto make = [&](const Frame& frame) {
        return Case{
            end,
            0.001,
            0.0,
            e,
            plane(frame, "ground", upright, {0.0, 0.0, 0.0}) +
                box(frame, "wall", {d + 0.25, 0.0, 0.0}, {0.2, 4.0, 4.0}, "fixed: true") +
                box(frame, "b", {0.0, 0.0, 0.1}, {0.3, 0.2, 0.2}, "mass: 1, velocity: " + frame.length({v, 0.0, 0.0})),
            {}};
    };
    expect_right(make, {d - e * v * after, 0.0, 0.1}, 0.15, 10.0);
}

// A box on a spring, with friction: each half swing is shorter by 2 μ m g/k, until it sticks.
TEST(Accuracy, ABoxOnASpringStopsWhereFrictionHoldsIt) {
    const double m = 1.0, k = 84.0, mu = 0.13, shift = mu * m * g / k, x0 = 8.3 * shift, rest = 1.0;
    double x = x0, end = 0.3;
    while (std::abs(x) > shift) {
        x = (x > 0.0 ? -1.0 : 1.0) * (std::abs(x) - 2.0 * shift);
        end += std::numbers::pi / std::sqrt(k / m);
    }
    const auto make = [&](const Frame& frame) {
        return Case{
            end,
            0.01,
            mu,
            0.0,
            plane(frame, "ground", upright, {0.0, 0.0, 0.0}) +
                box(frame, "b", {rest + x0, 0.0, 0.05}, {0.3, 0.3, 0.1}, "mass: 1"),
            fmt::format("springs:\n- {{name: s, second: b, first_point: {}, second_point: {}, rest_length: {}, "
                        "stiffness: {}}}\n",
                        frame.length({0.0, 0.0, 0.05}), frame.length({rest + x0, 0.0, 0.05}), rest * frame.unit, k)};
    };
    expect_right(make, {rest + x, 0.0, 0.05}, 0.15, 10.0);
}

// Friction in a guide turns round with the speed: half swings about ±F/k, each shorter by 2 F/k. It ends within one.
TEST(Accuracy, FrictionInAGuideTurnsRoundWhereTheSpeedDoes) {
    const double m = 1.0, k = 60.0, F = 3.0, w = std::sqrt(k / m), shift = F / k;
    for (const auto& run : {std::pair{1.0, 0.1}, {1.0, 0.0371}, {1.9, 0.01}}) {
        const double end = run.first, step = run.second;
        SCOPED_TRACE(fmt::format("until {} by {}", end, step));
        double x = 0.5, left = end;
        for (; left > std::numbers::pi / w; left -= std::numbers::pi / w) x = -(x - std::copysign(2.0 * shift, x));
        const double middle = std::copysign(shift, x);
        const double right = middle + (x - middle) * std::cos(w * left);
        const auto make = [&](const Frame& frame) {
            return Case{end,
                        step,
                        0.0,
                        0.0,
                        fmt::format("- {{name: b, mass: {}, inertia: {{xx: 1, yy: 1, zz: 1}}, position: {}}}\n", m,
                                    frame.length({0.5, 0.0, 0.0})),
                        fmt::format("joints:\n- {{name: j, kind: prismatic, second: b, axis: {}, friction: {}, spring: "
                                    "{{stiffness: {}, rest: {:.17g}}}}}\n",
                                    frame.vector({1.0, 0.0, 0.0}, 1.0), F * frame.unit, k, -0.5 * frame.unit)};
        };
        expect_right(make, {right, 0.0, 0.0}, 0.25, 10.0);
    }
}

// Boxes fall into a pit: impacts follow one another closely, and the steps for them get longer until one is too long
// for what comes next.
TEST(Accuracy, APileInAPitComesToTheEnd) {
    std::string scene =
        "step: 0.005\nend: 0.5\naccuracy: 0.01\nmaterials: {m: {friction: 0.4, restitution: 0.2}}\nbodies:\n"
        "- {name: floor, fixed: true, shapes: [{plane: {}, material: m}]}\n";
    for (int k = 0; k < 4; ++k) {
        const double side = k % 2 == 0 ? 0.4 : -0.4;
        const bool along_x = k < 2;
        scene += fmt::format(
            "- {{name: wall{}, fixed: true, position: [{}, {}, 1], shapes: [{{box: {{size: [{}, {}, 4]}}, material: "
            "m}}]}}\n",
            k, along_x ? side : 0.0, along_x ? 0.0 : side, along_x ? 0.2 : 1.0, along_x ? 1.0 : 0.2);
    }
    for (int i = 0; i < 10; ++i)
        scene += fmt::format(
            "- {{name: b{}, density: 1000, position: [{:.3f}, {:.3f}, {:.3f}], orientation: {{axis: [{:.3f}, {:.3f}, "
            "0.5], angle: {}}}, shapes: [{{box: {{size: [0.16, 0.12, 0.14]}}, material: m}}]}}\n",
            i, 0.12 * std::sin(2.1 * i + 3.0), 0.12 * std::cos(1.3 * i + 3.0), 0.2 + 0.11 * i, std::sin(i + 3.0),
            std::cos(2.0 * i + 3.0), 37 * i + 33);
    Running run(parse_scene(scene, "test.yaml"));
    run.finish();
    EXPECT_NEAR(run.simulation.state().t, 0.5, 1e-12);
}

/// The sentence with which a scene of one body is refused.
std::string refusal(const std::string& keys) {
    try {
        Running run(parse_scene(
            "step: 0.01\nend: 1\n" + keys + "\nbodies: [{name: a, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n",
            "test.yaml"));
    } catch (const InputError& error) {
        return error.what();
    }
    return "taken";
}

TEST(Accuracy, ExcludesWhatItCannotHold) {
    EXPECT_EQ(refusal("accuracy: 1e-3"), "taken");
    EXPECT_EQ(refusal("accuracy: 0"), "test.yaml, line 3: \"accuracy\" is 0; it must be positive");
    EXPECT_EQ(refusal("accuracy: 1e-3\nsleeping: true\nintegrator: euler_implicit_linearized"),
              "system \"main\": bodies may sleep with a fixed step only; remove \"accuracy\"");
    EXPECT_NE(refusal("accuracy: 1e-3\ntolerance: 1e-3")
                  .find("an \"accuracy\" and a \"tolerance\" exclude each other: steps follow from one of them"),
              std::string::npos);
}

TEST(Accuracy, OfTheCommandTakesThePlaceOfATolerance) {
    const std::string body = "end: 1\nbodies: [{name: a, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n";
    SceneOverrides overrides;
    overrides.accuracy = 1e-2;
    overrides.step = 0.1;
    const Scene scene = parse_scene("tolerance: 1e-3\n" + body, "test.yaml", overrides);
    EXPECT_FALSE(scene.systems[0].control);
    EXPECT_TRUE(scene.systems[0].steps_by_accuracy());
    EXPECT_EQ(scene.systems[0].accuracy, 1e-2);
    SceneOverrides tolerance;
    tolerance.tolerance = 1e-3;
    EXPECT_TRUE(parse_scene("accuracy: 1e-3\nstep: 0.1\n" + body, "test.yaml", tolerance).systems[0].control);
    tolerance.accuracy = 1e-2;
    EXPECT_THROW(static_cast<void>(parse_scene("step: 0.1\n" + body, "test.yaml", tolerance)), InputError);
}

// A run that stops and goes on takes the same steps.
TEST(Accuracy, GoesOnAsIfItHadNotStopped) {
    const auto read = [] {
        return parse_scene(
            "accuracy: 1e-4\nstep: 0.01\nend: 1\nmaterials: {m: {friction: 0.4, restitution: 0.5}}\nbodies:\n- {name: "
            "ground, fixed: true, shapes: [{plane: {}, material: m}]}\n- {name: b, density: 1000, position: [0, 0, 1], "
            "velocity: [1, 0, 0], angular_velocity: [1, 2, 3], shapes: [{box: {size: [0.2, 0.3, 0.4]}, material: "
            "m}]}\n",
            "test.yaml");
    };
    Running whole(read()), stopped(read()), resumed(read());
    for (int i = 0; i < 60; ++i) stopped.simulation.step();
    resumed.simulation.load(stopped.simulation.save());
    whole.finish();
    resumed.finish();
    EXPECT_GT(whole.simulation.totals().divided_steps, 0);
    EXPECT_EQ(whole.simulation.state().q, resumed.simulation.state().q);
    EXPECT_EQ(whole.simulation.state().v, resumed.simulation.state().v);
}

}  // namespace
}  // namespace delassus::accuracy_of_runs_test
