// SPDX-License-Identifier: BSD-3-Clause
// Motors, servos, dry friction in joints and dampers beside impacts, without options: their forces are finite, so that
// nothing of them is in a bounce, and they act until it as before it, and from then on as after it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "support/scenes.hpp"

namespace delassus::forces_at_impacts_test {
namespace {

using tests::Running;

Vector3 place_after(const std::string& text, const std::string& body) {
    Running run(parse_scene(text, "test.yaml"));
    run.finish();
    return run.pose(body).position;
}

// A ball hits a bar on a hinge, which leaves it with ω = (1 + e) m v r/(I + m r²).
struct Bar {
    static constexpr double mass = 0.1, speed = 3.0, arm = 0.8, inertia = 0.3, restitution = 0.5, radius = 0.05,
                            half = 0.02, meets = 0.1033, end = 0.9;

    [[nodiscard]] static double spin() {
        return (1.0 + restitution) * mass * speed * arm / (inertia + mass * arm * arm);
    }
    [[nodiscard]] static double start() { return -half - radius - speed * meets; }
    [[nodiscard]] static double ball_at_end() {
        return start() + speed * end - inertia * spin() / (mass * arm) * (end - meets);
    }
    [[nodiscard]] static std::string scene(double h, const std::string& joint, const std::string& rest) {
        return fmt::format(
            "step: {:.17g}\nend: {}\ngravity: [0, 0, 0]\nmaterials: {{m: {{restitution: {}}}}}\nbodies:\n"
            "- {{name: bar, mass: 1, inertia: {{xx: 1, yy: 1, zz: {:.17g}}}, position: [0.4, 0, 0], shapes: [{{box: "
            "{{size: [1, {}, 0.2]}}, material: m}}]}}\n"
            "- {{name: ball, mass: {}, position: [{}, {:.17g}, 0], velocity: [0, {}, 0], shapes: [{{sphere: {{radius: "
            "{}}}, material: m}}]}}\n"
            "joints: [{{name: hinge, kind: revolute, second: bar, axis: [0, 0, 1]{}}}]\n{}\n",
            h, end, restitution, inertia - 0.16, 2.0 * half, mass, arm, start(), speed, radius, joint, rest);
    }
};

TEST(ForcesAtImpacts, ABallBouncesOffABarTheSameHoweverItsHingeIsHeld) {
    for (const std::string held :
         {", friction: 0.8", ", friction: 50", ", friction: 5000", "motor 5", "motor 5000", "kd: 5, limit: 1000",
          "kd: 500, limit: 1000", "kp: 900, kd: 30, position: 0, limit: 40"})
        for (const std::string method : {"", "coordinates: maximal", "integrator: moreau_jean"})
            for (const double h : {1.0 / 60.0, 0.0073, 0.005, 0.001}) {
                SCOPED_TRACE(fmt::format("{}, {}, step {}", held, method, h));
                const bool motor = held.starts_with("motor"), friction = held.starts_with(",");
                std::string rest = method;
                if (motor)
                    rest +=
                        fmt::format("\nmotors: [{{name: m, joint: hinge, motion: 0, speed: true, force_limit: {}}}]",
                                    held.substr(6));
                else if (!friction)
                    rest += fmt::format("\nactuators: [{{name: a, joint: hinge, {}{}}}]", held,
                                        held.starts_with("kp") ? "" : ", speed: 0");
                const Vector3 ball = place_after(Bar::scene(h, friction ? held : "", rest), "ball");
                EXPECT_NEAR(ball[0], Bar::arm, 1e-9);
                EXPECT_NEAR(ball[1], Bar::ball_at_end(), 1e-6);
            }
}

TEST(ForcesAtImpacts, AStruckJointSlidesAgainstItsFriction) {
    const double friction = 0.8;
    for (const double h : {1.0 / 60.0, 0.0073, 0.005, 0.001}) {
        SCOPED_TRACE(h);
        const Vector3 bar = place_after(Bar::scene(h, fmt::format(", friction: {}", friction), ""), "bar");
        const double turn = 0.5 * Bar::inertia * Bar::spin() * Bar::spin() / friction;
        EXPECT_NEAR(std::atan2(bar[1], bar[0]), turn, 2e-5);
    }
}

// A slider is driven towards 0.8 m/s, meets a box that nothing holds, and pushes it until both have that speed. The
// third drive is a servo that is far stiffer than a step resolves.
TEST(ForcesAtImpacts, WhatIsDrivenPushesOnAfterItStrikes) {
    const double limit = 15.0, wanted = 0.8, mass = 2.0, box = 4.0, end = 0.7;
    for (const double gap : {0.05, 0.03}) {
        const double reaches = wanted * mass / limit, way = 0.5 * wanted * reaches;
        const double meets = way < gap ? reaches + (gap - way) / wanted : std::sqrt(2.0 * gap * mass / limit);
        const double after = std::min(wanted, limit / mass * meets) * mass / (mass + box);
        const double pulls = limit / (mass + box), pushed = (wanted - after) / pulls;
        const double at_end = 0.5 * (after + wanted) * pushed + wanted * (end - meets - pushed);
        for (const char* drive : {"motors: [{name: m, joint: slide, motion: 0.8, speed: true, force_limit: 15}]",
                                  "actuators: [{name: a, joint: slide, speed: 0.8, kd: 1.0e+7, limit: 15}]"})
            for (const double h : {1.0 / 60.0, 0.0073, 0.005, 0.001}) {
                SCOPED_TRACE(fmt::format("{}, gap {}, step {}", drive, gap, h));
                const Vector3 place = place_after(
                    fmt::format("step: {:.17g}\nend: {}\ngravity: [0, 0, 0]\nbodies:\n"
                                "- {{name: ram, mass: {}, inertia: {{xx: 1, yy: 1, zz: 1}}, position: [{:.17g}, 0, 0], "
                                "shapes: [{{box: {{size: [0.1, 0.1, 0.1]}}}}]}}\n"
                                "- {{name: box, mass: {}, shapes: [{{box: {{size: [0.2, 0.2, 0.2]}}}}]}}\n"
                                "joints: [{{name: slide, kind: prismatic, second: ram, axis: [1, 0, 0]}}]\n{}\n",
                                h, end, mass, -0.15 - gap, box, drive),
                    "box");
                EXPECT_NEAR(place[0], at_end, 1e-5);
            }
    }
}

// A ball that rolls hits one at rest, which slides at first and then rolls with 5/7 of its speed: however slow it is,
// friction does not hold it while it is struck.
TEST(ForcesAtImpacts, FrictionHasNoPartInABounce) {
    const double r = 0.03, gap = 0.0137, e = 0.9, mu = 0.3, g = 9.81;
    for (const double speed : {0.02, 0.05, 0.1, 1.0})
        for (const double h : {1.0 / 60.0, 0.0073, 0.005, 0.001}) {
            SCOPED_TRACE(fmt::format("{} m/s, step {}", speed, h));
            const double meets = gap / speed, end = meets + 0.5, left = 0.5 * (1.0 + e) * speed;
            const double slides = 2.0 / 7.0 * left / (mu * g);
            const double way = left * slides - 0.5 * mu * g * slides * slides + 5.0 / 7.0 * left * (0.5 - slides);
            const Vector3 place = place_after(
                fmt::format("step: {:.17g}\nend: {:.17g}\nmaterials: {{f: {{friction: {}}}, b: {{friction: 0, "
                            "restitution: {}}}}}\n"
                            "material_pairs: [{{first: f, second: b, friction: {}, restitution: 0}}]\nbodies:\n"
                            "- {{name: floor, fixed: true, shapes: [{{plane: {{}}, material: f}}]}}\n"
                            "- {{name: a, mass: 1, position: [{:.17g}, 0, {}], velocity: [{}, 0, 0], angular_velocity: "
                            "[0, {:.17g}, 0], shapes: [{{sphere: {{radius: {}}}, material: b}}]}}\n"
                            "- {{name: b, mass: 1, position: [0, 0, {}], shapes: [{{sphere: {{radius: {}}}, material: "
                            "b}}]}}\n",
                            h, end, mu, e, mu, -2.0 * r - gap, r, speed, speed / r, r, r, r),
                "b");
            EXPECT_NEAR(place[0], way, 5e-3 * way);
        }
}

// Balls in a row on a floor, the first of which rolls towards the others. Between impacts of two, which exchange their
// speeds u with restitution, floor friction accelerates what slides, u − ω r ≠ 0, until it rolls.
struct Row {
    static constexpr double r = 0.03, e = 0.9, mu = 0.3, g = 9.81;
    static constexpr int balls = 4;
    double speed, gap;

    [[nodiscard]] double end() const { return 0.8 + gap / speed; }
    [[nodiscard]] std::array<double, balls> places_at_end() const {
        const int steps = 400000;
        const double h = end() / steps, force = mu * g;
        std::array<double, balls> x{}, u{}, turn{};
        for (std::size_t i = 0; i < balls; ++i) x[i] = static_cast<double>(i) * (2.0 * r + gap);
        u[0] = turn[0] = speed;
        for (int k = 0; k < steps; ++k) {
            for (std::size_t i = 0; i < balls; ++i) {
                const double slip = u[i] - turn[i], slides = std::min(std::abs(slip) / (3.5 * force), h);
                const double pull = std::copysign(force, -slip);
                x[i] += u[i] * h + pull * slides * (h - 0.5 * slides);
                u[i] += pull * slides;
                turn[i] -= 2.5 * pull * slides;
            }
            for (std::size_t i = 0; i + 1 < balls; ++i) {
                const double closing = u[i] - u[i + 1];
                if (x[i + 1] - x[i] > 2.0 * r || closing <= 0.0) continue;
                u[i] -= 0.5 * (1.0 + e) * closing;
                u[i + 1] += 0.5 * (1.0 + e) * closing;
            }
        }
        return x;
    }
    [[nodiscard]] std::string scene(double h) const {
        std::string text = fmt::format(
            "step: {:.17g}\nend: {:.17g}\nmaterials: {{f: {{friction: {}}}, b: {{friction: 0, restitution: {}}}}}\n"
            "material_pairs: [{{first: f, second: b, friction: {}, restitution: 0}}]\nbodies:\n"
            "- {{name: floor, fixed: true, shapes: [{{plane: {{}}, material: f}}]}}\n",
            h, end(), mu, e, mu);
        for (int i = 0; i < balls; ++i)
            text += fmt::format(
                "- {{name: b{}, mass: 1, position: [{:.17g}, 0, {}], velocity: [{}, 0, 0], angular_velocity: [0, "
                "{:.17g}, 0], shapes: [{{sphere: {{radius: {}}}, material: b}}]}}\n",
                i, i * (2.0 * r + gap), r, i == 0 ? speed : 0.0, i == 0 ? speed / r : 0.0, r);
        return text;
    }
};

// In steps of 1/60 s several of them meet within one, or at its end: what a contact pressed with in a part of a step
// that is cut between impacts tells what it presses with in the next part.
TEST(ForcesAtImpacts, SlowBallsInARowSlideThroughSeveralImpactsOfAStep) {
    for (const Row& row : {Row{0.1, 0.0137}, Row{0.1, 0.001}, Row{0.3, 0.002}, Row{1.0, 0.01}}) {
        const std::array<double, Row::balls> at_end = row.places_at_end();
        for (const double h : {1.0 / 60.0, 0.0073, 0.001, 0.0002}) {
            SCOPED_TRACE(fmt::format("{} m/s, gaps of {} m, step {}", row.speed, row.gap, h));
            Running run(parse_scene(row.scene(h), "test.yaml"));
            run.finish();
            for (int i = 0; i < Row::balls; ++i)
                EXPECT_NEAR(run.pose(fmt::format("b{}", i)).position[0], at_end[static_cast<std::size_t>(i)],
                            h > 0.01 ? 5e-4 : 2e-5);
        }
    }
}

// The friction of the wall lifts the ball off the slope for a millisecond. Over a step its weight would hold it there.
TEST(ForcesAtImpacts, WeightHoldsNothingAtAnImpact) {
    constexpr double g = 9.81, slope = 0.3, radius = 0.1, start = 0.4;
    const double down = g * std::sin(slope), way = 0.5 * start * start / (down * 5.0 / 7.0);
    const auto place = [&](double beyond, double h) {
        return place_after(
            fmt::format("step: {:.17g}\nend: 0.6\ngravity: [{:.17g}, 0, {:.17g}]\nmaterials: {{m: {{friction: "
                        "0.6}}}}\nbodies:\n"
                        "- {{name: slope, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                        "- {{name: wall, fixed: true, position: [{:.17g}, 0, 0], orientation: {{axis: [0, 1, 0], "
                        "angle: -90}}, shapes: [{{plane: {{}}, material: m}}]}}\n"
                        "- {{name: ball, mass: 1, position: [0, 0, {}], velocity: [{}, 0, 0], angular_velocity: [0, "
                        "{}, 0], shapes: [{{sphere: {{radius: {}}}, material: m}}]}}\n",
                        h, -down, -g * std::cos(slope), way - beyond + radius, radius, start, start / radius, radius),
            "ball");
    };
    for (const double beyond : {1e-4, 1e-3}) {
        const double right = place(beyond, 1e-5)[0];
        for (const double h : {1.0 / 60.0, 0.01, 0.0041}) {
            SCOPED_TRACE(fmt::format("it would roll by {} m more, step {}", beyond, h));
            EXPECT_NEAR(place(beyond, h)[0], right, 1e-4);
        }
    }
}

// v = v₀ − (c/m) x until a wall, and so again after it.
TEST(ForcesAtImpacts, ADashpotTurnsRoundWithWhatBounces) {
    const double rate = 4.0, speed = 2.0, gap = 0.3177, restitution = 0.5, end = 1.0;
    const double meets = -std::log(1.0 - gap * rate / speed) / rate, back = restitution * (speed - rate * gap);
    const double at_end = gap - back / rate * (1.0 - std::exp(-rate * (end - meets)));
    for (const char* damper : {"springs: [{name: d, second: a, first_point: [-5, 0, 0], damping: 4}]",
                               "joints: [{name: s, kind: prismatic, second: a, axis: [1, 0, 0]}]\n"
                               "actuators: [{name: d, joint: s, speed: 0, kd: 4, limit: 1000}]"})
        for (const double h : {1.0 / 60.0, 0.0073, 0.005, 0.001}) {
            SCOPED_TRACE(fmt::format("{}, step {}", damper, h));
            const Vector3 place = place_after(
                fmt::format(
                    "step: {:.17g}\nend: {}\ngravity: [0, 0, 0]\nmaterials: {{m: {{restitution: {}}}}}\nbodies:\n"
                    "- {{name: a, mass: 1, inertia: {{xx: 1, yy: 1, zz: 1}}, velocity: [{}, 0, 0], shapes: "
                    "[{{box: {{size: [0.1, 0.1, 0.1]}}, material: m}}]}}\n"
                    "- {{name: wall, fixed: true, position: [{:.17g}, 0, 0], shapes: [{{box: {{size: [0.1, 1, "
                    "1]}}, material: m}}]}}\n{}\n",
                    h, end, restitution, speed, gap + 0.1, damper),
                "a");
            EXPECT_NEAR(place[0], at_end, 1e-4);
        }
}

}  // namespace
}  // namespace delassus::forces_at_impacts_test
