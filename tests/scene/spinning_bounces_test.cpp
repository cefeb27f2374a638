// SPDX-License-Identifier: BSD-3-Clause
// Bodies that spin and bounce, without options: what an impact does depends neither on where in a step it is nor on how
// far the body turns in one.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "support/rooms.hpp"
#include "support/scenes.hpp"

namespace delassus::spinning_bounces_test {
namespace {

using Eigen::Vector3d;
using tests::list;
using tests::Running;

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

Vector3d vector(const Vector3& v) {
    return {v[0], v[1], v[2]};
}

struct Ball {
    double radius, friction, restitution;
    Vector3d place, velocity, spin;
};

/// Where the centre may not get nearer to `offset` along the normal than the radius.
struct Wall {
    Vector3d normal;
    double offset;
};

/// Parabolas between impacts, at each of which a ball of uniform density sticks or slides (Garwin, Am. J. Phys. 37,
/// 1969, without his elastic spin).
void move(Ball& ball, const std::vector<Wall>& walls, const Vector3d& gravity, double time) {
    for (;;) {
        const Wall* next = nullptr;
        double first = std::numeric_limits<double>::infinity();
        for (const Wall& wall : walls) {
            const double a = 0.5 * gravity.dot(wall.normal), b = ball.velocity.dot(wall.normal),
                         c = ball.place.dot(wall.normal) - wall.offset - ball.radius, root = b * b - 4.0 * a * c;
            if (!(root > 0.0) || (a == 0.0 && b >= 0.0)) continue;
            const double t = a == 0.0 ? -c / b : (-b - std::sqrt(root)) / (2.0 * a);
            if (t > 1e-9 && t < first) {
                first = t;
                next = &wall;
            }
        }
        const double t = std::min(first, time);
        ball.place += t * ball.velocity + 0.5 * t * t * gravity;
        ball.velocity += t * gravity;
        time -= t;
        if (!(time > 0.0)) return;
        const Vector3d n = next->normal, arm = -ball.radius * n;
        const double push = -(1.0 + ball.restitution) * ball.velocity.dot(n);
        Vector3d slip = ball.velocity + ball.spin.cross(arm);
        slip -= slip.dot(n) * n;
        Vector3d rub = -slip / 3.5;
        if (rub.norm() > ball.friction * push) rub *= ball.friction * push / rub.norm();
        ball.velocity += push * n + rub;
        ball.spin += arm.cross(rub) / (0.4 * ball.radius * ball.radius);
    }
}

// In a room that is turned, with gravity along no axis of it.
TEST(SpinningBounces, ABallLeavesFloorsAndWallsAsClosedFormsSay) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Vector3d(0.3, -0.7, 0.5).normalized()));
    const double end = 1.37, half = 0.95;
    const Vector3d gravity = turn * Vector3d(0.0, 0.0, -9.81);
    for (const bool boxes : {false, true})
        for (const auto& [friction, spin] :
             {std::pair(0.4, Vector3d(5.0, 20.0, -10.0)), {0.05, {-30.0, 10.0, 25.0}}, {0.9, {50.0, 20.0, -100.0}}})
            for (const double h : {1.0 / 60.0, 0.0107, 0.005}) {
                SCOPED_TRACE(
                    fmt::format("walls are {}, friction {}, step {}", boxes ? "boxes" : "planes", friction, h));
                Ball ball{0.06, friction, 0.8, turn * Vector3d(0.0, 0.0, 0.6), turn * Vector3d(4.0, 0.5, 2.0), spin};
                std::string text = fmt::format(
                    "step: {:.17g}\nend: {}\ngravity: {}\nmaterials: {{m: {{friction: {}, restitution: "
                    "{}}}}}\nbodies:\n"
                    "- {{name: ball, mass: 0.3, position: {}, velocity: {}, angular_velocity: {}, shapes: [{{sphere: "
                    "{{radius: {}}}, material: m}}]}}\n",
                    h, end, list(gravity), friction, ball.restitution, list(ball.place), list(ball.velocity),
                    list(spin), ball.radius);
                std::vector<Wall> walls;
                for (const Vector3d& n : {Vector3d(0.0, 0.0, 1.0), Vector3d(-1.0, 0.0, 0.0), Vector3d(1.0, 0.0, 0.0)}) {
                    const double offset = n[2] > 0.0 ? 0.0 : -half;
                    walls.push_back({turn * n, offset});
                    const Eigen::Quaterniond q = turn * Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), n);
                    const double depth = boxes ? 0.1 : 0.0;
                    text += fmt::format(
                        "- {{name: wall{}, fixed: true, position: {}, orientation: [{:.17g}, {:.17g}, {:.17g}, "
                        "{:.17g}], shapes: [{{{}, material: m}}]}}\n",
                        walls.size(), list((offset - depth) * (turn * n)), q.w(), q.x(), q.y(), q.z(),
                        boxes ? "box: {size: [9, 9, 0.2]}" : "plane: {}");
                }
                auto run = run_of(text);
                run.finish();
                move(ball, walls, gravity, end);
                const auto& [place, q] = run.pose("ball");
                const auto [v, omega] = run.velocities("ball");
                const Vector3d spins = Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * vector(omega);
                EXPECT_LT((vector(place) - ball.place).norm(), 1e-9);
                EXPECT_LT((vector(v) - ball.velocity).norm(), 1e-9);
                EXPECT_LT((spins - ball.spin).norm(), 1e-9 * spin.norm());
            }
}

// A box that tumbles has a gyroscopic torque, which an impact changes within a step.
TEST(SpinningBounces, ATumblingBoxBouncesAsInShortSteps) {
    const auto place_after = [](double friction, double restitution, double h) {
        auto run = run_of(fmt::format(
            "step: {:.17g}\nend: 0.62\nmaterials: {{m: {{friction: {}, restitution: {}}}}}\nbodies:\n"
            "- {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
            "- {{name: a, density: 700, position: [0, 0, 0.8], velocity: [0.7, -0.3, 0], angular_velocity: [8, 5, -7], "
            "orientation: {{axis: [1, 0.2, 0.3], angle: 20}}, shapes: [{{box: {{size: [0.3, 0.2, 0.1]}}, material: "
            "m}}]}}\n",
            h, friction, restitution));
        run.finish();
        return vector(run.pose("a").position);
    };
    for (const auto& [friction, restitution] : {std::pair(0.0, 1.0), {0.4, 0.8}}) {
        const Vector3d right = place_after(friction, restitution, 2e-5);
        for (const double h : {0.001, 0.002, 0.005, 1.0 / 60.0}) {
            SCOPED_TRACE(fmt::format("restitution {}, step {}", restitution, h));
            EXPECT_LT((place_after(friction, restitution, h) - right).norm(), 2e-4);
        }
    }
}

// One impact of a body that turns by 0.2 rad in a step: with the rows, the gap and the spin of its time, what the step
// errs by falls as h³.
TEST(SpinningBounces, AnImpactErrsByTheCubeOfTheStep) {
    const auto velocities_after = [](const std::string& shape, double h) {
        auto run = run_of(fmt::format(
            "step: {:.17g}\nend: 0.24\nmaterials: {{m: {{friction: 0.3, restitution: 0.8}}}}\nbodies:\n"
            "- {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
            "- {{name: a, density: 700, position: [0, 0, 0.3], velocity: [0.7, -0.3, 0], angular_velocity: [12, 9, "
            "-14], shapes: [{{{}, material: m}}]}}\n",
            h, shape));
        run.finish();
        const auto [v, omega] = run.velocities("a");
        return std::pair(vector(v), vector(omega));
    };
    for (const std::string shape :
         {"box: {size: [0.15, 0.1, 0.05]}", "cylinder: {radius: 0.04, length: 0.15}",
          "convex: {points: [[0.09, 0.01, 0], [-0.09, -0.01, 0], [0, 0.05, 0.02], [0, -0.05, -0.02], "
          "[0.01, 0, 0.04], [-0.01, 0, -0.04]]}"}) {
        SCOPED_TRACE(shape);
        const auto [v, omega] = velocities_after(shape, 1e-4);
        for (const double h : {0.012, 0.008, 0.004}) {
            SCOPED_TRACE(h);
            const auto [v_h, omega_h] = velocities_after(shape, h);
            EXPECT_LT((v_h - v).norm(), 1e3 * h * h * h * v.norm());
            EXPECT_LT((omega_h - omega).norm(), 1e3 * h * h * h * omega.norm());
        }
    }
}

// The upper ball follows the lower one, which bounces back at it: they were not nearing each other when the step began.
TEST(SpinningBounces, WhatABounceLeadsToWithinAStepIsAtItsTime) {
    const double g = 9.81, e = 0.7, R = 0.1, r = 0.05, low = 0.5, high = 0.68, aside = 0.013, end = 0.45;
    const double lands = std::sqrt(2.0 * (low - R) / g),
                 after = high - low - std::sqrt((R + r) * (R + r) - aside * aside);
    const double meets = after / ((1.0 + e) * g * lands), up = (e * lands - meets) * g, down = -(lands + meets) * g;
    const Vector3d n = Vector3d(aside, 0.0, high - low - after) / (R + r);
    const double impulse = (1.0 + e) * (up - down) * n[2] / (1.0 + 10.0);
    const double left = end - lands - meets;
    const double x = aside + 10.0 * impulse * n[0] * left;
    const double z = high - 0.5 * g * (lands + meets) * (lands + meets) + (down + 10.0 * impulse * n[2]) * left -
                     0.5 * g * left * left;
    for (const double h : {1.0 / 60.0, 0.0143, 0.01}) {
        SCOPED_TRACE(h);
        auto run = run_of(fmt::format(
            "step: {:.17g}\nend: {}\nmaterials: {{m: {{friction: 0, restitution: {}}}}}\nbodies:\n"
            "- {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
            "- {{name: low, mass: 1, position: [0, 0, {}], shapes: [{{sphere: {{radius: {}}}, material: m}}]}}\n"
            "- {{name: high, mass: 0.1, position: [{}, 0, {}], shapes: [{{sphere: {{radius: {}}}, material: m}}]}}\n",
            h, end, e, low, R, aside, high, r));
        run.finish();
        const auto& at = run.pose("high").position;
        EXPECT_NEAR(at[0], x, 2e-3);
        EXPECT_NEAR(at[2], z, 2e-3);
    }
}

/// A body in a room, until when it is looked at, s, and how near it is then to where short steps have it, m.
struct Thrown {
    const char* name;
    double friction, restitution, end, near;
    const char *gravity, *body;
};

constexpr Thrown thrown[] = {
    // It comes down on one edge and slaps on the next, 0.6 ms later.
    {"slap", 0.0, 0.0, 0.144, 5e-3, "[0, 0, 0]",
     "density: 7800, position: [0.6, 0.6, 0.385983], orientation: {axis: [0, 0, 1], angle: 315}, velocity: [-3.673935, "
     "-3.520286, -2.288198], angular_velocity: [0.060458, -0.331588, -0.018575], shapes: [{box: {size: [0.15, 0.3, "
     "0.6]}, material: m}]"},
    // A corner that was 1 mm off the wall strikes it after another one did.
    {"box", 0.3, 0.8, 0.6, 5e-3, "[1.85, -1.95, 9.43]",
     "density: 1636, position: [0.2132, 0.8506, 0.9302], orientation: [-0.53284, -0.1263, -0.0855, -0.83236], "
     "velocity: [0.3303, -1.5144, -0.3138], angular_velocity: [-0.7961, 2.7042, 1.0733], shapes: [{box: {size: "
     "[0.1364, 0.1438, 0.1326]}, material: m}]"},
    // It turns by up to 0.6 rad a step, and its spin changes by a tenth of that.
    {"hull", 0.3, 0.8, 0.3, 5e-3, "[2.68, -7.4, -5.85]",
     "density: 58.6, position: [0.2735, 0.6801, 0.7828], orientation: [0.957, 0.0983, 0.2624, 0.0749], velocity: "
     "[-2.2572, 1.2622, 0.1931], angular_velocity: [5.3917, 3.6122, 1.0529], shapes: [{convex: {points: [[-0.0332, "
     "0.0587, -0.0186], [0.0332, -0.0587, 0.0186], [-0.0197, -0.0475, 0.0273], [0.0197, 0.0475, -0.0273], [-0.006, "
     "0.0327, -0.0364], [0.006, -0.0327, 0.0364], [0.0076, -0.0535, 0.0505], [-0.0076, 0.0535, -0.0505], [0.0113, "
     "0.0198, 0.0246], [-0.0113, -0.0198, -0.0246], [-0.0606, 0.047, 0.1234], [0.0606, -0.047, -0.1234]]}, material: "
     "m}]"},
    // One corner has left its wall by 1 µm when another one strikes, and is thrown back at it within 1 µs.
    {"hull that lands twice", 0.4, 0.0, 0.2, 1e-4, "[3.566, 8.479, 3.41]",
     "density: 79.73, position: [0.95892, 0.449465, 0.538661], orientation: [0.742921, 0.597946, 0.23736, 0.184904], "
     "velocity: [0.325983, 3.176758, -1.668031], angular_velocity: [-1.888025, 10.213858, 3.233515], shapes: [{convex: "
     "{points: [[0.017648, 0.001705, 0.032803], [-0.017648, -0.001705, -0.032803], [-0.044187, -0.009775, -0.028927], "
     "[0.044187, 0.009775, 0.028927], [0.035931, 0.002383, -0.017547], [-0.035931, -0.002383, 0.017547], [-0.046915, "
     "-0.015432, 0.000489], [0.046915, 0.015432, -0.000489], [-0.016536, 0.077644, 0.060403], [0.016536, -0.077644, "
     "-0.060403], [-0.16267, -0.113341, -0.010486], [0.16267, 0.113341, 0.010486]]}, material: m}]"},
    // What presses has a gap that longer steps left, and is struck in a short one.
    {"box that presses", 0.0, 0.0, 0.5, 5e-4, "[-6.072, -5.231, -5.658]",
     "density: 3115.9, position: [0.72255, 0.56747, 0.99014], orientation: [-0.44878, 0.35244, -0.55111, -0.60882], "
     "velocity: [-1.43097, 2.75674, -0.86753], angular_velocity: [5.94352, 7.11637, -11.62201], shapes: [{box: {size: "
     "[0.151094, 0.150218, 0.103086]}, material: m}]"},
    // A corner grazes the wall again while its weight takes the box away from it.
    {"box that leaves", 0.0, 0.0, 0.5, 5e-4, "[0.03, 7.228, -6.633]",
     "density: 1183.2, position: [0.38017, 0.44013, 0.89884], orientation: [-0.88455, -0.26426, 0.04149, -0.38212], "
     "velocity: [0.16996, -2.2952, -0.71663], angular_velocity: [-4.8926, -4.04419, 5.30449], shapes: [{box: {size: "
     "[0.100316, 0.149274, 0.147824]}, material: m}]"},
};

Vector3d thrown_to(const Thrown& it, double h) {
    std::string text = fmt::format(
        "step: {:.17g}\nend: {}\ngravity: {}\nmaterials: {{m: {{friction: {}, restitution: {}}}}}\nbodies:\n"
        "- {{name: a, {}}}\n",
        h, it.end, it.gravity, it.friction, it.restitution, it.body);
    text += tests::walls_of_cube(1.2);
    auto run = run_of(text);
    run.finish();
    return vector(run.pose("a").position);
}

// What corners do one after the other is not what they would do at once.
TEST(SpinningBounces, CornersStrikeOneAfterTheOther) {
    for (const Thrown& it : thrown) {
        const Vector3d right = thrown_to(it, 5e-5);
        for (const double h : {1.0 / 60.0, 0.01, 0.004}) {
            SCOPED_TRACE(fmt::format("{}, step {}", it.name, h));
            EXPECT_LT((thrown_to(it, h) - right).norm(), it.near);
        }
    }
}

}  // namespace
}  // namespace delassus::spinning_bounces_test
