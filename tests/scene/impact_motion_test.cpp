// SPDX-License-Identifier: BSD-3-Clause
// Impacts in plain scenes, without options, whose motion is known: times, directions and speeds do not depend on where
// in a step bodies meet.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "support/scenes.hpp"

namespace delassus::impact_motion_test {
namespace {

using tests::Running;

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

// Shapes that land on several points at once, on a floor that is turned: the second peak is e⁴ of the height.
TEST(ImpactMotion, WhatLandsFlatReachesTheHeightOfItsRestitution) {
    const double e = 0.65, height = 0.9, g = 9.81, up = std::sqrt(2.0 * height / g);
    struct Case {
        const char* shape;
        double half;
    };
    for (const auto& [shape, half] :
         {Case{"box: {size: [0.3, 0.2, 0.1]}", 0.05}, Case{"cylinder: {radius: 0.2, length: 0.3}", 0.15},
          Case{"capsule: {radius: 0.1, length: 0.3}, orientation: {axis: [0, 1, 0], angle: 90}", 0.1}})
        for (const double step : {0.01, 1.0 / 240.0}) {
            SCOPED_TRACE(fmt::format("{} {}", shape, step));
            auto run = run_of(fmt::format(
                "step: {:.17g}\nend: {:.17g}\ngravity: [{:.17g}, 0, {:.17g}]\nmaterials: {{m: {{friction: 0.3, "
                "restitution: {}}}}}\nbodies:\n"
                "- {{name: floor, fixed: true, orientation: {{axis: [0, 1, 0], angle: 30}}, shapes: [{{plane: {{}}, "
                "material: m}}]}}\n"
                "- {{name: body, mass: 1.5, position: [{:.17g}, 0, {:.17g}], orientation: {{axis: [0, 1, 0], angle: "
                "30}}, shapes: [{{{}, material: m}}]}}\n",
                step, up * (1.0 + 2.0 * e + e * e), -0.5 * g, -g * std::sqrt(0.75), e, 0.5 * (height + half),
                std::sqrt(0.75) * (height + half), shape));
            run.finish();
            const auto& at = run.pose("body").position;
            EXPECT_NEAR(0.5 * at[0] + std::sqrt(0.75) * at[2] - half, std::pow(e, 4) * height, 1e-8);
            EXPECT_NEAR(std::sqrt(0.75) * at[0] - 0.5 * at[2], 0.0, 1e-8);
        }
}

// A ball meets another one off its middle, without friction: the impulse is along the line of centres then, however
// early or late in a step that is.
TEST(ImpactMotion, BallsPartAlongTheLineOfTheirCentresAtTheMeeting) {
    const double e = 0.9, radius = 0.1, speed = 2.3, first = 3.0, second = 1.2;
    for (const double aside : {0.06, 0.12})
        for (const double step : {1.0 / 60.0, 0.004, 0.002})
            for (int phase = 0; phase < 8; ++phase) {
                const double way = 0.5 + phase / 8.0 * speed * step, end = 1.25 / speed;
                const double ahead = std::sqrt(4.0 * radius * radius - aside * aside);
                const std::array<double, 2> n{ahead / (2.0 * radius), -aside / (2.0 * radius)};
                const double impulse = (1.0 + e) * speed * n[0] / (1.0 / first + 1.0 / second);
                const double left = end - way / speed;
                auto run = run_of(fmt::format(
                    "step: {:.17g}\nend: {:.17g}\ngravity: [0, 0, 0]\nmaterials: {{m: {{restitution: {}}}}}\nbodies:\n"
                    "- {{name: first, mass: {}, position: [0, {}, 0], velocity: [{}, 0, 0], shapes: [{{sphere: "
                    "{{radius: {}}}, material: m}}]}}\n"
                    "- {{name: second, mass: {}, position: [{:.17g}, 0, 0], shapes: [{{sphere: {{radius: {}}}, "
                    "material: m}}]}}\n",
                    step, end, e, first, aside, speed, radius, second, way + ahead, radius));
                run.finish();
                const auto& at = run.pose("second").position;
                const double off = std::hypot(at[0] - way - ahead - impulse / second * n[0] * left,
                                              at[1] - impulse / second * n[1] * left);
                EXPECT_LT(off, 1e-6 * way) << "step " << step << ", aside " << aside << ", phase " << phase;
            }
}

// A plate that swings meets a falling ball with the speed of that moment.
TEST(ImpactMotion, AShakenPlateGivesItsSpeedOfTheMeeting) {
    const double e = 0.6, g = 9.81, amplitude = 0.08, rate = 2.0 * std::acos(-1.0) * 1.5, drop = 0.4, radius = 0.1;
    const auto plate = [&](double t) { return amplitude * std::sin(rate * t); };
    double low = 0.15, high = 0.4;  // the gap is open and closed there, and has one root between
    for (int i = 0; i < 60; ++i) {
        const double t = 0.5 * (low + high);
        (drop - 0.5 * g * t * t - plate(t) > 0.0 ? low : high) = t;
    }
    const double plate_speed = amplitude * rate * std::cos(rate * low), after = 0.12;
    const double speed = plate_speed - e * (-g * low - plate_speed);
    for (const double step : {0.01, 0.0033}) {
        SCOPED_TRACE(step);
        auto run = run_of(fmt::format(
            "step: {}\nend: {:.17g}\nmaterials: {{m: {{friction: 0.3, restitution: {}}}}}\nbodies:\n"
            "- {{name: plate, position: [0, 0, -0.1], motion: {{translation: [0, 0, {{sine: {{amplitude: {}, "
            "frequency: 1.5}}}}]}}, shapes: [{{box: {{size: [2, 2, 0.2]}}, material: m}}]}}\n"
            "- {{name: ball, mass: 1, position: [0, 0, {}], shapes: [{{sphere: {{radius: {}}}, material: m}}]}}\n",
            step, low + after, e, amplitude, radius + drop, radius));
        run.finish();
        const double right = radius + drop - 0.5 * g * low * low + (speed - 0.5 * g * after) * after;
        EXPECT_NEAR(run.pose("ball").position[2], right, 5e-4 * drop);
    }
}

// What holds against an impact holds at its time: a plate that lies on the floor stays there when a ball falls onto it.
TEST(ImpactMotion, APlateThatIsStruckStaysOnTheFloor) {
    for (const char* method : {"linearly_implicit_trapezoidal", "moreau_jean"})
        for (const double e : {0.0, 0.5})
            for (const double height : {0.5, 0.5143, 0.5286, 0.5429, 0.5571, 0.5714, 0.6}) {
                SCOPED_TRACE(fmt::format("{} {} {}", method, e, height));
                auto run = run_of(fmt::format(
                    "step: 0.01\nend: 0.9\nintegrator: {}\ngravity: [0, 0, -9.81]\nmaterials: {{m: {{friction: 0.3, "
                    "restitution: {}}}}}\nbodies:\n"
                    "- {{name: floor, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                    "- {{name: plate, mass: 1, position: [0, 0, 0.1], shapes: [{{box: {{size: [0.5, 0.5, 0.2]}}, "
                    "material: m}}]}}\n"
                    "- {{name: ball, mass: 5, position: [0, 0, {:.17g}], shapes: [{{sphere: {{radius: 0.1}}, material: "
                    "m}}]}}\n",
                    method, e, 0.3 + height));
                double highest = 0.0;
                while (!run.simulation.finished()) {
                    run.simulation.step();
                    highest = std::max(highest, run.pose("plate").position[2]);
                }
                EXPECT_LT(highest, 0.1 + 1e-9);
            }
}

// A pendulum meets its stop within a step and loses its speed there. It then swings back by the time that is left.
// J = 1.1 kg m² about the hinge, m g l = 9.81 Nm; by Runge and Kutta's method of order 4, with the time of the stop.
TEST(ImpactMotion, AJointMeetsItsStopAtItsTime) {
    constexpr double start = 1.2, stop = -0.5, end = 2.0, step_of_reference = 1e-4;
    using Point = std::array<double, 2>;
    const auto rate = [](const Point& y) { return Point{y[1], -9.81 / 1.1 * std::sin(y[0])}; };
    const auto moved = [&](const Point& y, double h) {
        const auto at = [&](const Point& slope, double part) {
            return Point{y[0] + part * slope[0], y[1] + part * slope[1]};
        };
        const Point a = rate(y), b = rate(at(a, 0.5 * h)), c = rate(at(b, 0.5 * h)), d = rate(at(c, h));
        return Point{y[0] + h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]),
                     y[1] + h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1])};
    };
    Point right{start, 0.0};
    double t = 0.0;
    for (Point next = moved(right, step_of_reference); next[0] > stop; next = moved(right, step_of_reference)) {
        right = next;
        t += step_of_reference;
    }
    double low = 0.0, high = step_of_reference;
    for (int i = 0; i < 50; ++i) {
        const double middle = 0.5 * (low + high);
        (moved(right, middle)[0] > stop ? low : high) = middle;
    }
    right = {stop, 0.0};
    for (t += low; t < end - 1e-12; t += step_of_reference) right = moved(right, std::min(step_of_reference, end - t));
    for (const auto& [step, accuracy, allowed] : {std::tuple{0.005, 0.0, 3e-5},
                                                  {0.01, 0.0, 3e-4},
                                                  {0.01, 1e-3, 1e-4},
                                                  {0.01, 1e-5, 2e-5},
                                                  {0.05, 1e-5, 2e-5}}) {
        SCOPED_TRACE(fmt::format("{} {}", step, accuracy));
        auto run = run_of(fmt::format(
            "step: {}\nend: {}\n{}bodies:\n- {{name: b, mass: 1, inertia: {{xx: 0.1, yy: 0.1, zz: 0.1}}, position: "
            "[{:.17g}, 0, {:.17g}]}}\njoints:\n- {{name: j, kind: revolute, second: b, axis: [0, 1, 0], lower: {}}}\n",
            step, end, accuracy > 0.0 ? fmt::format("accuracy: {}\n", accuracy) : std::string(), -std::sin(start),
            -std::cos(start), stop - start));
        run.finish();
        const auto& at = run.pose("b").position;
        EXPECT_NEAR(std::atan2(-at[0], -at[2]), right[0], allowed);
    }
}

// A heavy box lies on a light one, which strikes the floor. Between them nothing strikes, whatever rounding or a last
// approach by 1e-8 m/s makes of their gap: both rise from the time at which the lower one strikes.
TEST(ImpactMotion, WhatFallsTogetherRisesTogether) {
    constexpr double e = 0.5, g = 9.81, height = 0.3, after = 0.011;
    const double falls = std::sqrt(2.0 * height / g);
    for (const double unit : {1.0, 1e3})  // m, then mm with the same mass and time
        for (const double closes : {0.0, 1e-12, 1e-8, 1e-6})
            for (const double step : {0.01, 0.0071}) {
                SCOPED_TRACE(fmt::format("{} {} {}", unit, closes, step));
                auto run = run_of(fmt::format(
                    "step: {0:.17g}\nend: {1:.17g}\ngravity: [0, 0, {2:.17g}]\n"
                    "materials: {{m: {{friction: 0.8, restitution: 0.5}}}}\nbodies:\n"
                    "- {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                    "- {{name: light, density: {3:.17g}, position: [0, 0, {4:.17g}], shapes: [{{box: {{size: "
                    "[{5:.17g}, "
                    "{5:.17g}, {5:.17g}]}}, material: m}}]}}\n"
                    "- {{name: heavy, density: {6:.17g}, position: [0, 0, {7:.17g}], velocity: [0, 0, {8:.17g}], "
                    "shapes: "
                    "[{{box: {{size: [{9:.17g}, {9:.17g}, {9:.17g}]}}, material: m}}]}}\n",
                    step, falls + after, -g * unit, 1000.0 / (unit * unit * unit), (height + 0.15) * unit, 0.3 * unit,
                    7800.0 / (unit * unit * unit), (height + 0.5 + 0.24 * closes) * unit, -closes * unit, 0.4 * unit));
                run.finish();
                const double rises = e * g * falls * after - 0.5 * g * after * after;
                EXPECT_NEAR(run.pose("light").position[2] / unit, 0.15 + rises, 2e-4);
                EXPECT_NEAR(run.pose("heavy").position[2] / unit, 0.5 + rises, 2e-4);
            }
}

// Of a stack of seven, several rest, some open a little and are struck at once: no impact gives what closes it again
// more than it takes.
TEST(ImpactMotion, AStackThatBouncesGainsNoEnergy) {
    auto run = run_of(R"(
step: 0.01
end: 1
gravity: [0, 0, -9.81]
materials: {m: {friction: 0.6, restitution: 0.83}}
bodies:
- {name: floor, fixed: true, shapes: [{plane: {}, material: m}]}
- {name: a, mass: 1.66, position: [0, 0, 0.145455], orientation: {axis: [0, 0, 1], angle: 47.9}, velocity: [-0.11, 0, 0],
   shapes: [{box: {size: [0.34, 0.24, 0.19]}, material: m}]}
- {name: b, mass: 0.88, position: [0, 0, 0.409809], orientation: {axis: [0, 0, 1], angle: 106.9},
   shapes: [{box: {size: [0.27, 0.4, 0.34]}, material: m}]}
- {name: c, mass: 1.56, position: [0, 0, 0.6353], orientation: {axis: [0, 0, 1], angle: 6.1},
   shapes: [{cylinder: {radius: 0.07, length: 0.11}, material: m}]}
- {name: d, mass: 0.33, position: [0, 0, 0.819009], orientation: {axis: [0, 0, 1], angle: 85.4},
   shapes: [{box: {size: [0.38, 0.29, 0.25]}, material: m}]}
- {name: e, mass: 2.54, position: [0, 0, 1.026217], orientation: {axis: [0, 0, 1], angle: 63.5},
   shapes: [{box: {size: [0.16, 0.31, 0.16]}, material: m}]}
- {name: f, mass: 2.03, position: [0, 0, 1.488358], orientation: {axis: [0, 0, 1], angle: 87.6},
   shapes: [{box: {size: [0.15, 0.18, 0.36]}, material: m}]}
- {name: g, mass: 1.28, position: [0, 0, 1.851579], orientation: {axis: [0, 0, 1], angle: 87.3},
   shapes: [{cylinder: {radius: 0.16, length: 0.26}, material: m}]}
)");
    const auto energy = [&] { return run.system().energy(run.simulation.state()); };
    const double first = energy();
    double least = first, gained = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        least = std::min(least, energy());
        gained = std::max(gained, energy() - least);
    }
    EXPECT_LT(least, first - 5.0);
    EXPECT_LT(gained, 2e-2 * (first - least));
}

// Housner (Bull. Seism. Soc. Am. 53, 1963): at each impact on the other edge a slender block keeps 1 − 3/2 sin² α of
// its rate, tan α being its width by its height. Between two impacts its energy is m g r cos(α − θ) at the largest tilt
// θ.
TEST(ImpactMotion, ABlockRocksAsHousnerHasIt) {
    struct Block {
        double half_width, half_height, tilt;  // m, degrees
    };
    constexpr double degree = std::numbers::pi / 180.0;
    for (const char* method : {"", "integrator: moreau_jean\n"})
        for (const Block& block : {Block{0.1, 0.5, 5.0}, Block{0.07, 0.45, 3.0}})
            for (const auto& [step, share] : {std::pair(1.0 / 60.0, 0.02), std::pair(0.0041, 0.004)}) {
                SCOPED_TRACE(fmt::format("{}{} by {} m, step {}", method, 2.0 * block.half_width,
                                         2.0 * block.half_height, step));
                const double c = std::cos(block.tilt * degree), s = std::sin(block.tilt * degree);
                auto run = run_of(
                    method + fmt::format("step: {}\nend: 4\nmaterials: {{m: {{friction: 0.9}}}}\nbodies:\n"
                                         "- {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                                         "- {{name: block, mass: 7, position: [{:.17g}, 0.3, {:.17g}], orientation: "
                                         "{{axis: [0, 1, 0], angle: "
                                         "{}}}, "
                                         "shapes: [{{box: {{size: [{}, 0.3, {}]}}, material: m}}]}}\n",
                                         step, block.half_height * s - block.half_width * c,
                                         block.half_width * s + block.half_height * c, block.tilt,
                                         2.0 * block.half_width, 2.0 * block.half_height));
                std::vector<double> tilts = {block.tilt * degree, block.tilt * degree}, peaks;
                while (!run.simulation.finished()) {
                    run.simulation.step();
                    const auto orientation = run.pose("block").orientation;
                    tilts.push_back(std::abs(2.0 * std::atan2(orientation[2], orientation[0])));
                    const std::size_t k = tilts.size() - 2;
                    if (k > 1 && tilts[k] >= tilts[k - 1] && tilts[k] > tilts[k + 1]) peaks.push_back(tilts[k]);
                }
                ASSERT_GE(peaks.size(), 4U);
                const double alpha = std::atan2(block.half_width, block.half_height);
                const double kept = std::pow(1.0 - 1.5 * std::pow(std::sin(alpha), 2), 2);
                double right = block.tilt * degree;
                for (int k = 0; k < 4; ++k) {
                    right = alpha - std::acos(std::cos(alpha) + kept * (std::cos(alpha - right) - std::cos(alpha)));
                    EXPECT_NEAR(peaks[static_cast<std::size_t>(k)], right, share * right) << k;
                }
            }
}

// A face that meets a wall at the very end of a step, where rounding lets one corner meet in it and another one after
// it.
TEST(ImpactMotion, AFaceMeetsWithAllItsCornersWhereAStepEnds) {
    for (const double e : {1.0, 0.5})
        for (const int steps : {13, 21, 30})
            for (const double h : {1.0 / 60.0, 0.01, 0.007}) {
                const double speed = 3.7, width = 0.37;
                SCOPED_TRACE(fmt::format("e {}, {} steps of {}", e, steps, h));
                auto run = run_of(fmt::format(
                    "step: {:.17g}\nend: {:.17g}\nmaterials: {{m: {{friction: 0}}, w: {{friction: 0}}}}\n"
                    "material_pairs: [{{first: m, second: w, friction: 0, restitution: {}}}]\nbodies:\n"
                    "- {{name: floor, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                    "- {{name: wall, fixed: true, position: [{:.17g}, 0, 0.5], shapes: [{{box: {{size: [1, 4, "
                    "3]}}, material: w}}]}}\n"
                    "- {{name: box, mass: 1.5, position: [0, 0, 0.11], velocity: [{}, 0, 0], shapes: [{{box: "
                    "{{size: [{}, 0.3, 0.22]}}, material: m}}]}}\n",
                    h, (steps + 9) * h, e, 0.5 + 0.5 * width + speed * steps * h, speed, width));
                run.finish();
                const auto [v, omega] = run.velocities("box");
                EXPECT_NEAR(v[0], -e * speed, 1e-9 * speed);
                EXPECT_NEAR(v[2], 0.0, 1e-9 * speed);
                EXPECT_NEAR(omega[1], 0.0, 1e-8 * speed);
            }
}

// Friction turns round where a box that slides on the ground bounces off a wall: it comes back by e² u²/(2 μ g), u
// being the speed with which it meets.
TEST(ImpactMotion, FrictionTurnsRoundWhereABoxBouncesOffAWall) {
    const double g = 9.81;
    for (const char* method : {"", "integrator: moreau_jean\n"})
        for (const auto& [v0, mu, e, way] :
             {std::tuple(1.0, 0.3, 0.8, 0.1019), {6.0, 0.2, 0.6, 2.31}, {2.0, 0.5, 0.0, 0.2}})
            for (const double h : {0.02, 1.0 / 60.0, 0.0073}) {
                SCOPED_TRACE(fmt::format("{}{} m/s, step {}", method, v0, h));
                auto run = run_of(
                    method +
                    fmt::format(
                        "step: {:.17g}\nend: 4\nmaterials: {{m: {{friction: {}}}, w: {{friction: 0}}}}\n"
                        "material_pairs: [{{first: m, second: w, friction: 0, restitution: {}}}]\nbodies:\n"
                        "- {{name: floor, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                        "- {{name: wall, fixed: true, position: [{}, 0, 0.5], shapes: [{{box: {{size: [1, 4, 3]}}, "
                        "material: w}}]}}\n"
                        "- {{name: box, mass: 1.5, position: [0, 0, 0.05], velocity: [{}, 0, 0], shapes: [{{box: "
                        "{{size: [1, 0.4, 0.1]}}, material: m}}]}}\n",
                        h, mu, e, 1.0 + way, v0));
                run.finish();
                const double square = v0 * v0 - 2.0 * mu * g * way, back = e * e * square / (2.0 * mu * g);
                const double far = std::max(v0 * v0 / (2.0 * mu * g), way);
                EXPECT_NEAR(way - run.pose("box").position[0], back, 0.03 * std::max(back, 0.1 * far));
            }
}

}  // namespace
}  // namespace delassus::impact_motion_test
