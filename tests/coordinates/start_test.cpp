// SPDX-License-Identifier: BSD-3-Clause
// Joints that start elsewhere than where the scene places the bodies, against closed forms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <string>

#include "delassus/error.hpp"
#include "delassus/joint_coordinates.hpp"
#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"

namespace delassus::tests::start_test {
namespace {

using Eigen::Vector3d;

std::string body(const std::string& name, const std::string& position) {
    return fmt::format("  - {{name: {}, mass: 1, inertia: {{xx: 0.02, yy: 0.03, zz: 0.04}}, position: {}}}\n", name,
                       position);
}

struct Begun {
    explicit Begun(const std::string& text) : scene(parse_scene("step: 1e-3\nend: 1\n" + text, "test")) {
        system = scene.systems[0].system.get();
        assembly = system->assemble();
        start = system->initial_state();
    }
    [[nodiscard]] Vector3d position(const std::string& name) const {
        return Vector3d(system->pose(start, system->find_body(name)).position.data());
    }
    [[nodiscard]] Vector3d velocity(const std::string& name) const {
        return Vector3d(system->velocities(start, system->find_body(name))[0].data());
    }

    Scene scene;
    MultibodySystem* system;
    Assembly assembly;
    State start;
};

const std::string bodies = "bodies:\n" + body("a", "[0.5, 0, 0]") + body("b", "[1.5, 0, 0]");

// Two links of length 1 about y, the angles p and q = p + 0.4 from the x axis downwards.
TEST(JointStart, PlacesADoublePendulum) {
    const double p = 0.7, q = p - 0.4, dp = 1.5, dq = dp + 2.0;
    const auto along = [](double angle) { return Vector3d(std::cos(angle), 0.0, -std::sin(angle)); };
    const auto across = [](double angle) { return Vector3d(-std::sin(angle), 0.0, -std::cos(angle)); };
    for (const bool reversed : {false, true}) {
        // With the bodies in the other order the coordinate has the other sign.
        const std::string ends = reversed ? "first: b, second: a" : "first: a, second: b";
        const double sign = reversed ? -1.0 : 1.0;
        const Begun begun(bodies + fmt::format("joints:\n"
                                               "  - {{name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, "
                                               "1, 0], start: {}, start_rate: {}}}\n"
                                               "  - {{name: j, kind: revolute, {}, point: [1, 0, 0], axis: [0, 1, 0], "
                                               "start: {}, start_rate: {}}}\n",
                                               p, dp, ends, sign * (q - p), sign * (dq - dp)));
        EXPECT_LT((begun.position("a") - 0.5 * along(p)).norm(), 1e-14);
        EXPECT_LT((begun.position("b") - along(p) - 0.5 * along(q)).norm(), 1e-14);
        EXPECT_LT((begun.velocity("a") - 0.5 * dp * across(p)).norm(), 1e-14);
        EXPECT_LT((begun.velocity("b") - dp * across(p) - 0.5 * dq * across(q)).norm(), 1e-14);
        EXPECT_LT(begun.assembly.displacement, 1e-14);
    }
}

TEST(JointStart, PlacesSlidesAndCylinders) {
    const Begun begun(
        bodies +
        "joints:\n  - {name: i, kind: prismatic, second: a, point: [0, 0, 0], axis: [0, 0, 2], start: 0.25, "
        "start_rate: -1}\n"
        "  - {name: j, kind: cylindrical, first: a, second: b, point: [1, 0, 0], axis: [0, 0, 1], slide: "
        "{start: 0.5}, turn: {start: 1.5707963267948966, start_rate: 2}}\n");
    EXPECT_LT((begun.position("a") - Vector3d(0.5, 0.0, 0.25)).norm(), 1e-14);
    EXPECT_LT((begun.position("b") - Vector3d(1.0, 0.5, 0.75)).norm(), 1e-14);
    EXPECT_LT((begun.velocity("b") - Vector3d(-1.0, 0.0, -1.0)).norm(), 1e-14);
}

// Stops that the scene's own configuration does not meet are for the run; only a start must lie between them.
TEST(JointStart, IsNotAskedForByStops) {
    const std::string joint =
        "joints:\n  - {name: i, kind: revolute, second: a, axis: [0, 1, 0], lower: 0.1, upper: 0.5";
    EXPECT_NO_THROW(Begun(bodies + joint + "}\n"));
    EXPECT_NO_THROW(Begun(bodies + joint + ", start: 0.3}\n"));
    EXPECT_THROW(Begun(bodies + joint + ", start: 0.6}\n"), InputError);
}

// What is not given stays, and is carried along.
TEST(JointStart, MovesWhatTheJointCarriesAlone) {
    const std::string joints =
        "joints:\n  - {name: i, kind: spherical, second: a, point: [0, 0, 0]}\n"
        "  - {name: j, kind: revolute, first: a, second: b, point: [1, 0, 0], axis: [0, 1, 0]";
    const Begun as_placed(bodies + joints + "}\n"), begun(bodies + joints + ", start: -0.3}\n");
    EXPECT_EQ(begun.position("a"), as_placed.position("a"));
    EXPECT_LT((begun.position("b") - Vector3d(1.0 + 0.5 * std::cos(0.3), 0.0, 0.5 * std::sin(0.3))).norm(), 1e-14);
}

// A pendulum with a spring that is at rest where it starts: its energy is that of the start, and stays.
TEST(JointStart, IsWhereARunBegins) {
    for (const char* coordinates : {"joint", "maximal"}) {
        auto scene = parse_scene(
            fmt::format("coordinates: {}\nintegrator: rk4\nstep: 1e-3\nend: 0.4\nbodies:\n{}joints:\n"
                        "  - {{name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0], start: 0.5, "
                        "start_rate: 0.25, spring: {{stiffness: 3, rest: 0.5}}}}\n",
                        coordinates, body("a", "[0.5, 0, 0]")),
            "test");
        const Registry registry;
        Simulation simulation(scene.systems[0], registry);
        // ½ (J + m r²) ω² + m g z
        const double energy = 0.5 * (0.03 + 0.25) * 0.25 * 0.25 - 9.81 * 0.5 * std::sin(0.5);
        EXPECT_NEAR(simulation.totals().start_energy, energy, 1e-12) << coordinates;
        while (!simulation.finished()) simulation.step();
        EXPECT_NEAR(scene.systems[0].system->energy(simulation.state()), energy, 1e-9) << coordinates;
    }
}

// A parallelogram: one start says where all of it is, whichever joint has it; what contradicts it is refused.
TEST(JointStart, OfALoopIsHeldAndFollowed) {
    const auto linkage = [](const std::string& i, const std::string& j, const std::string& k, const std::string& l) {
        return "bodies:\n" + body("a", "[0, 0.15, 0]") + body("b", "[0.25, 0.3, 0]") + body("c", "[0.5, 0.15, 0]") +
               fmt::format(
                   "joints:\n"
                   "  - {{name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 0, 1]{}}}\n"
                   "  - {{name: j, kind: revolute, first: a, second: b, point: [0, 0.3, 0], axis: [0, 0, 1]{}}}\n"
                   "  - {{name: k, kind: revolute, first: b, second: c, point: [0.5, 0.3, 0], axis: [0, 0, 1]{}}}\n"
                   "  - {{name: l, kind: revolute, second: c, point: [0.5, 0, 0], axis: [0, 0, 1]{}}}\n",
                   i, j, k, l);
    };
    const auto expect_at = [&](const Begun& begun, double angle, double rate) {
        const Vector3d along(-std::sin(angle), std::cos(angle), 0.0), across(-std::cos(angle), -std::sin(angle), 0.0);
        EXPECT_LT((begun.position("a") - 0.15 * along).norm(), 1e-9);
        EXPECT_LT((begun.position("b") - Vector3d(0.25, 0.0, 0.0) - 0.3 * along).norm(), 1e-9);
        EXPECT_LT((begun.position("c") - Vector3d(0.5, 0.0, 0.0) - 0.15 * along).norm(), 1e-9);
        EXPECT_LT((begun.velocity("a") - 0.15 * rate * across).norm(), 1e-8);
        EXPECT_LT((begun.velocity("b") - 0.3 * rate * across).norm(), 1e-8);
    };
    const std::string start = ", start: 1.2, start_rate: 3";
    expect_at(Begun(linkage(", start: 0.4", ", start: -0.4", ", start: 0.4", "")), 0.4, 0.0);
    expect_at(Begun(linkage(start, "", "", "")), 1.2, 3.0);
    expect_at(Begun(linkage("", "", "", start)), 1.2, 3.0);
    expect_at(Begun(linkage(", start_rate: 3", "", "", "")), 0.0, 3.0);
    // Digits that contradict each other are not.
    expect_at(Begun(linkage(", start: 1.2, start_rate: 3", "", "", ", start: 1.2, start_rate: 3")), 1.2, 3.0);
    EXPECT_NO_THROW(Begun(linkage(", start: 0.4", "", "", ", start: 0.40001")));
    EXPECT_EQ(Begun(linkage(start, "", "", "")).assembly.rotation, 0.0);

    const auto sentence_of = [&](const std::string& i, const std::string& l) -> std::string {
        try {
            const Begun refused(linkage(i, "", "", l));
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_NE(sentence_of(", start: 0.4", ", start: 0.6").find("the start of joint"), std::string::npos);
    EXPECT_NE(sentence_of(", start_rate: 1", ", start_rate: 2").find("has a rate that cannot be had"),
              std::string::npos);
}

TEST(JointStart, OfAMechanismWithNodesIsRefused) {
    EXPECT_THROW(
        Begun(bodies +
              "nodes:\n  - {name: n, mass: 1, position: [0, 0, 3]}\n"
              "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0], start: 1}\n"),
        InputError);
}

}  // namespace
}  // namespace delassus::tests::start_test
