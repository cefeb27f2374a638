// SPDX-License-Identifier: BSD-3-Clause
// Mechanisms that hit stops, the ground and each other: the same motion in joint and in maximal coordinates.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "support/scenes.hpp"

namespace delassus::tests::contact_agreement_test {
namespace {

std::string body(const std::string& name, const std::string& position, const std::string& more = "") {
    return fmt::format("  - {{name: {}, mass: 1, inertia: {{xx: 0.02, yy: 0.03, zz: 0.04}}, position: {}{}}}\n", name,
                       position, more);
}
std::string ball(double radius) {
    return fmt::format(", shapes: [{{sphere: {{radius: {}}}, material: m}}]", radius);
}
std::string ground(double friction, double restitution, double z) {
    return fmt::format(
        "materials: {{m: {{friction: {}, restitution: {}}}}}\nbodies:\n"
        "  - {{name: ground, fixed: true, position: [0, 0, {}], shapes: [{{plane: {{}}, material: m}}]}}\n",
        friction, restitution, z);
}

struct Mechanism {
    std::string name, text;
};
std::ostream& operator<<(std::ostream& out, const Mechanism& mechanism) {
    return out << mechanism.name;
}

/// Each hits something, most several times, and what comes to rest lies still.
std::vector<Mechanism> mechanisms() {
    const std::string hinge = "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0]";
    std::string wheels, hubs;
    for (const auto& [name, x, y] : {std::tuple{"fl", 0.35, 0.3}, {"fr", 0.35, -0.3}, {"rl", -0.35, 0.3}}) {
        wheels += fmt::format(
            "  - {{name: {}, mass: 2.1, inertia: {{xx: 0.015, yy: 0.023, zz: 0.015}}, position: [{}, {}, 0.1512], "
            "velocity: [1.4, 0, 0]{}}}\n",
            name, x, y, ball(0.15));
        hubs += fmt::format(
            "  - {{name: h{0}, kind: revolute, first: frame, second: {0}, point: [{1}, {2}, 0.1512], axis: [0, 1, "
            "0]}}\n",
            name, x, y);
    }
    return {
        {"pendulum and stops", "bodies:\n" + body("a", "[0.3, 0, 0]") + hinge + ", lower: -0.4, upper: 0.7}\n"},
        {"bouncing pendulum", ground(0, 0.5, -0.31) + body("a", "[0.4, 0, 0]", ball(0.1)) + hinge + "}\n"},
        {"pendulum with friction",
         ground(0.3, 0, -0.31) + body("a", "[0.4, 0, 0]", ball(0.1)) +
             "joints:\n  - {name: i, kind: spherical, second: a, point: [0, 0, 0], damping: 0.01}\n"},
        {"gear", "bodies:\n" + body("a", "[0.1, 0, 0]") + body("b", "[1.1, 0.2, 0]") + hinge +
                     ", upper: 0.8}\n  - {name: j, kind: revolute, second: b, point: [1, 0, 0], axis: [0, 1, 0]}\n"
                     "  - {name: g, kind: gear, gear_first: i, gear_second: j, gear_ratio: -0.5}\n"},
        {"free pair", ground(0, 0.4, -0.6) + body("a", "[0.3, 0, 0]", ball(0.12) + ", velocity: [0.2, 0, 0]") +
                          body("b", "[0.8, 0, 0]", ball(0.12) + ", velocity: [0.2, 0, 0]") +
                          "joints:\n  - {name: j, kind: revolute, first: a, second: b, point: [0.5, 0, 0], axis: [0, "
                          "1, 0], damping: 0.5}\n"},
        {"four-bar",
         "gravity: [1, -9.81, 0]\nbodies:\n" + body("a", "[0, 0.15, 0]", ", angular_velocity: [0, 0, 1]") +
             body("b", "[0.25, 0.35, 0]") + body("c", "[0.5, 0.2, 0]") +
             "joints:\n"
             "  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 0, 1], lower: -0.4, upper: 0.5}\n"
             "  - {name: j, kind: revolute, first: a, second: b, point: [0, 0.3, 0], axis: [0, 0, 1]}\n"
             "  - {name: k, kind: revolute, first: b, second: c, point: [0.5, 0.4, 0], axis: [0, 0, 1]}\n"
             "  - {name: l, kind: revolute, second: c, point: [0.5, 0, 0], axis: [0, 0, 1]}\n"},
        {"slider-crank",
         "gravity: [0.5, -9.81, 0]\nbodies:\n" + body("crank", "[0.05, 0, 0]") + body("rod", "[0.25, 0, 0]") +
             body("slider", "[0.4, 0, 0]") +
             "joints:\n  - {name: i, kind: revolute, second: crank, point: [0, 0, 0], axis: [0, 0, 1]}\n"
             "  - {name: j, kind: revolute, first: crank, second: rod, point: [0.1, 0, 0], axis: [0, 0, 1]}\n"
             "  - {name: k, kind: prismatic, second: slider, point: [0.4, 0, 0], axis: [1, 0, 0], lower: -0.12, upper: "
             "0.1}\n"
             "  - {name: l, kind: revolute, first: slider, second: rod, point: [0.4, 0, 0], axis: [0, 0, 1]}\n"},
        {"spatial loop", "bodies:\n" + body("a", "[0.3, 0, 0]") + body("b", "[0.8, 0.1, 0]") +
                             body("c", "[1.2, 0.3, 0.1]") + hinge +
                             ", lower: -0.05, upper: 0.05, damping: 0.1}\n"
                             "  - {name: j, kind: universal, first: a, second: b, point: [0.5, 0, 0], axis: [0, 1, "
                             "0], second_axis: [0, 0, 1]}\n"
                             "  - {name: k, kind: spherical, first: b, second: c, point: [1, 0.2, 0]}\n"
                             "  - {name: l, kind: revolute, second: c, point: [1.3, 0.5, 0.1], axis: [0, 0, 1], "
                             "damping: 0.1}\n"},
        {"vehicle", ground(0.8, 0, 0) +
                        "  - {name: frame, mass: 30.7, inertia: {xx: 0.9, yy: 2.3, zz: 2.9}, position: [0.1, 0.08, "
                        "0.3123], velocity: [1.4, 0, 0]}\n" +
                        wheels + "joints:\n" + hubs},
        {"door and ball",
         "materials: {m: {friction: 0.3, restitution: 0.4}}\nbodies:\n"
         "  - {name: door, mass: 20.3, inertia: {xx: 6.7, yy: 8.1, zz: 1.4}, position: [0.45, 0, 1], shapes: [{box: "
         "{size: [0.86, 0.05, 2]}, material: m}]}\n"
         "  - {name: ball, mass: 0.63, position: [0.7123, -0.8123, 1.2], velocity: [0, 4.17, 1.3], shapes: [{sphere: "
         "{radius: 0.12}, material: m}]}\n"
         "joints:\n  - {name: h, kind: revolute, second: door, point: [0, 0, 1], axis: [0, 0, 1], damping: 0.3}\n"}};
}

/// A run that keeps the positions of its bodies every 0.1 s.
struct Path {
    Path(const std::string& text, const std::string& coordinates, double step, double end)
        : run(parse_scene(
              fmt::format("integrator: {{name: switching, options: {{error_limit: 1.0e-11}}}}\ncoordinates: {}\n"
                          "step: {}\nend: {}\n{}",
                          coordinates, step, end, text),
              "test")) {
        const auto every = std::lround(0.1 / step);
        while (!run.simulation.finished()) {
            const StepRecord& record = run.simulation.step();
            acted = acted || run.simulation.report().active_blocks > 0;
            if (record.step % every == 0) states.push_back(run.simulation.state());
        }
    }
    /// The largest difference of positions so far; a body's orientation is seen in what it carries and hits.
    [[nodiscard]] double off(const Path& other) const {
        double worst = 0.0;
        const auto bodies = static_cast<BodyIndex>(run.scene.systems[0].bodies.size());
        for (std::size_t k = 0; k < states.size(); ++k)
            for (BodyIndex i = 0; i < bodies; ++i) {
                const Pose mine = run.system().pose(states[k], i), its = other.run.system().pose(other.states[k], i);
                double same = 0.0, turned = 0.0;  // of quaternions, whose signs count for nothing
                for (std::size_t j = 0; j < 4; ++j) {
                    same = std::max(same, std::abs(mine.orientation[j] - its.orientation[j]));
                    turned = std::max(turned, std::abs(mine.orientation[j] + its.orientation[j]));
                }
                worst = std::max(worst, std::min(same, turned));
                for (std::size_t j = 0; j < 3; ++j)
                    worst = std::max(worst, std::abs(mine.position[j] - its.position[j]));
            }
        return worst;
    }

    Running run;
    std::vector<State> states;
    bool acted = false;
};

class ContactAgreement : public testing::TestWithParam<Mechanism> {
protected:
    void SetUp() override {
#ifndef DELASSUS_HAS_FCL
        GTEST_SKIP() << "this build has no collision";
#endif
    }
};

INSTANTIATE_TEST_SUITE_P(Mechanisms, ContactAgreement, testing::ValuesIn(mechanisms()), [](const auto& chosen) {
    std::string name = chosen.param.name;
    std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
    return name;
});

TEST_P(ContactAgreement, OfJointAndMaximalCoordinates) {
    const Path joint(GetParam().text, "joint", 1e-3, 5.0), maximal(GetParam().text, "maximal", 1e-3, 5.0);
    EXPECT_TRUE(joint.acted);
    ASSERT_EQ(joint.states.size(), 50U);
    EXPECT_LE(joint.off(maximal), 1e-6);  // steps are divided alike but for thresholds
    EXPECT_LE(joint.run.simulation.totals().worst_drift, 1e-13);
    EXPECT_EQ(joint.run.simulation.totals().unsolved_steps, 0);
    EXPECT_EQ(maximal.run.simulation.totals().unsolved_steps, 0);
}

// Where something pushes while it moves on, the steps are those of a method of order 2, whose error depends on the
// coordinates: the difference falls with the square of the step.
TEST(ContactAgreement, OfWhatMovesInTouchIsOfOrderTwo) {
    const std::vector<std::string> moving = {
        "bodies:\n" + body("a", "[0, 0, 0.5]") + body("b", "[0.4, 0, 0.5]") +
            "joints:\n  - {name: i, kind: prismatic, second: a, point: [0, 0, 0.5], axis: [0.3, 0, 1], lower: -0.1, "
            "upper: 0.2, spring: {stiffness: 150}}\n"
            "  - {name: j, kind: revolute, first: a, second: b, point: [0.2, 0, 0.5], axis: [0, 1, 0], upper: 1.2, "
            "damping: 0.2}\n",
        "bodies:\n" + body("a", "[0.3, 0, 0]") + body("b", "[0.8, 0, 0]") +
            "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0], upper: 0.9, damping: "
            "0.2}\n"
            "  - {name: j, kind: revolute, first: a, second: b, point: [0.5, 0, 0], axis: [0, 1, 0.2], lower: -0.6, "
            "upper: 0.5, damping: 0.1}\n"};
    for (const auto& text : moving) {
        const auto off = [&](double step) {
            return Path(text, "joint", step, 2.0).off(Path(text, "maximal", step, 2.0));
        };
        const double coarse = off(2e-3), fine = off(1e-3);
        EXPECT_LE(fine, 1e-6);
        EXPECT_GE(coarse, 3.0 * fine);
        EXPECT_LE(coarse, 5.5 * fine);
    }
}

/// What a contact alone has at a time of a smooth motion is what all have at the state of that time. Returns how many.
int compare_each_alone(DynamicalSystem& system, State begin) {
    constexpr double h = 0.01, time = 0.007;
    const auto n = static_cast<std::size_t>(system.n());
    std::vector<double> end(n), curve(n), way(n);
    for (std::size_t i = 0; i < n; ++i) {
        const double phase = static_cast<double>(i);
        begin.v[i] += 0.05 * std::sin(phase);
        end[i] = begin.v[i] + 0.1 * std::cos(2.0 * phase);
        curve[i] = 100.0 * std::sin(3.0 * phase);
    }
    const SmoothMotion motion{begin, end.data(), curve, h};
    for (std::size_t i = 0; i < n; ++i) way[i] = motion.way(i, time);
    State then = begin;
    system.increment(begin.q.data(), way.data(), then.q.data());
    then.t += time;
    UnilateralRows all, alone;
    system.collect_unilateral(begin, h, all);
    system.collect_unilateral(then, 1e-9, all);
    const std::size_t first = all.blocks().size() - all.contacts().size();
    std::size_t row = 0;
    for (std::size_t k = 0; k < first; ++k) row += static_cast<std::size_t>(all.blocks()[k].cone.rows);
    for (std::size_t k = 0; k < all.contacts().size(); ++k) {
        EXPECT_TRUE(system.collect_contact(motion, time, all.contacts()[k], alone));
        EXPECT_EQ(alone.blocks().size(), 1U);
        EXPECT_EQ(alone.blocks()[0].key, all.blocks()[first + k].key);
        EXPECT_NEAR(alone.rows()[0].gap, all.rows()[row].gap, 1e-13);
        const auto rows = static_cast<std::size_t>(all.blocks()[first + k].cone.rows);
        const auto begins = static_cast<std::size_t>(all.row_start()[row]),
                   ends = static_cast<std::size_t>(all.row_start()[row + rows]);
        EXPECT_EQ(alone.column().size(), ends - begins);
        for (std::size_t e = begins; e < ends && alone.column().size() == ends - begins; ++e) {
            EXPECT_EQ(alone.column()[e - begins], all.column()[e]);
            EXPECT_NEAR(alone.value()[e - begins], all.value()[e], 1e-12);
        }
        row += rows;
    }
    return static_cast<int>(all.contacts().size());
}

TEST(ContactAgreement, RowsOfAContactAloneAreThoseOfAllAtItsTime) {
    const Scene scene = parse_scene(
        "step: 0.01\nend: 1\nmaterials: {m: {friction: 0.4, restitution: 0.3}}\nbodies:\n"
        "  - {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "  - {name: table, position: [1, 0, 0.1], motion: {rotation: {axis: [0, 0, 1], angle: {polynomial: [0, 2]}}}, "
        "shapes: [{box: {size: [1, 1, 0.2]}, material: m}]}\n"
        "  - {name: rider, density: 500, position: [1.2, 0.1, 0.2506], orientation: {axis: [1, 2, 0], angle: 0.2}, "
        "shapes: [{box: {size: [0.2, 0.3, 0.1]}, material: m}]}\n"
        "  - {name: a, density: 500, position: [-0.3, 0, 0.0506], orientation: {axis: [1, 2, 0], angle: 0.2}, shapes: "
        "[{box: {size: [0.2, 0.3, 0.1]}, material: m}]}\n"
        "  - {name: b, density: 500, position: [-0.7, 0, 0.1], shapes: [{sphere: {radius: 0.1}, material: m}]}\n"
        "joints:\n  - {name: i, kind: spherical, first: a, second: b, point: [-0.5, 0, 0.1]}\n",
        "test.yaml");
    auto& system = *scene.systems[0].system;
    EXPECT_GE(compare_each_alone(system, system.initial_state()), 4);
    JointCoordinates joints(system);
    EXPECT_GE(compare_each_alone(joints, joints.initial_state()), 4);
}

}  // namespace
}  // namespace delassus::tests::contact_agreement_test
