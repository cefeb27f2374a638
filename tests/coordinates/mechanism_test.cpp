// SPDX-License-Identifier: BSD-3-Clause
// Mechanisms in joint and in maximal coordinates: the same motion. And orders, closed forms, energy.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"
#include "support/places.hpp"

namespace delassus::tests::mechanism_test {
namespace {

const std::string inertia = "mass: 1, inertia: {xx: 0.02, yy: 0.03, zz: 0.04}";

std::string body(const std::string& name, const std::string& position, const std::string& more = "") {
    return fmt::format("  - {{name: {}, {}, position: {}{}}}\n", name, inertia, position, more);
}

struct Mechanism {
    std::string name, text;
};

std::ostream& operator<<(std::ostream& out, const Mechanism& mechanism) {
    return out << mechanism.name;
}

std::vector<Mechanism> mechanisms() {
    const std::string three =
        "bodies:\n" + body("a", "[0.3, 0, 0]") + body("b", "[0.8, 0.1, 0]") + body("c", "[1.2, 0.3, 0.1]");
    const std::string four_bar = "bodies:\n" + body("a", "[0, 0.15, 0]", ", angular_velocity: [0, 0, 1]") +
                                 body("b", "[0.25, 0.35, 0]") + body("c", "[0.5, 0.2, 0]");
    return {
        {"double pendulum",
         "bodies:\n" + body("a", "[0.3, 0, 0]") + body("b", "[0.8, 0, 0]") +
             "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0]}\n"
             "  - {name: j, kind: revolute, first: b, second: a, point: [0.5, 0, 0], axis: [0, 1, 0.2]}\n"},
        {"balls", three + "joints:\n  - {name: i, kind: spherical, second: a, point: [0, 0, 0]}\n"
                          "  - {name: j, kind: spherical, first: a, second: b, point: [0.5, 0, 0]}\n"
                          "  - {name: k, kind: spherical, first: b, second: c, point: [1, 0.2, 0]}\n"},
        {"mixed", three + "joints:\n  - {name: i, kind: universal, second: a, point: [0, 0, 0], axis: [0, 1, 0], "
                          "second_axis: [1, 0, 0]}\n"
                          "  - {name: j, kind: cylindrical, first: a, second: b, point: [0.5, 0, 0], axis: [1, 0, 0], "
                          "slide: {spring: {stiffness: 200}, damping: 1}, turn: {damping: 0.05}}\n"
                          "  - {name: k, kind: prismatic, first: c, second: b, point: [1, 0.2, 0], axis: [0, 1, 1], "
                          "spring: {stiffness: 100}}\n"},
        {"planar", "bodies:\n" + body("a", "[0.3, 0, 0]", ", velocity: [0, 1, 0], angular_velocity: [0, 0, 2]") +
                       body("b", "[0.8, 0, 0]", ", velocity: [0, 1, 0]") +
                       "joints:\n  - {name: i, kind: planar, second: a, point: [0, 0, 0], axis: [0, 0.2, 1]}\n"
                       "  - {name: j, kind: universal, first: a, second: b, point: [0.5, 0, 0], axis: [0, 1, 0], "
                       "second_axis: [0, 0, 1]}\n"
                       "springs:\n  - {name: s, second: b, first_point: [0, 0, 1], second_point: [0.8, 0, 0], "
                       "stiffness: 40, damping: 0.5, rest_length: 0.5}\n"},
        {"free pair", "bodies:\n" + body("a", "[0.3, 0, 0]", ", velocity: [1, 0, 2], angular_velocity: [1, 2, 3]") +
                          body("b", "[0.8, 0, 0]") + body("alone", "[3, 0, 0]", ", angular_velocity: [1, 2, 0.1]") +
                          "joints:\n  - {name: j, kind: universal, first: a, second: b, point: [0.5, 0, 0], axis: [0, "
                          "1, 0], second_axis: [0, 0, 1]}\n"},
        {"four-bar", four_bar +
                         "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 0, 1]}\n"
                         "  - {name: j, kind: revolute, first: a, second: b, point: [0, 0.3, 0], axis: [0, 0, 1]}\n"
                         "  - {name: k, kind: revolute, first: b, second: c, point: [0.5, 0.4, 0], axis: [0, 0, 1]}\n"
                         "  - {name: l, kind: revolute, second: c, point: [0.5, 0, 0], axis: [0, 0, 1]}\n"},
        {"spatial loop", three +
                             "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0]}\n"
                             "  - {name: j, kind: universal, first: a, second: b, point: [0.5, 0, 0], axis: [0, 1, "
                             "0], second_axis: [0, 0, 1]}\n"
                             "  - {name: k, kind: spherical, first: b, second: c, point: [1, 0.2, 0]}\n"
                             "  - {name: l, kind: revolute, second: c, point: [1.3, 0.5, 0.1], axis: [0, 0, 1]}\n"},
        {"driven slider-crank",
         "bodies:\n" + body("crank", "[0.05, 0, 0]") + body("rod", "[0.25, 0, 0]") + body("slider", "[0.4, 0, 0]") +
             "joints:\n  - {name: i, kind: revolute, second: crank, point: [0, 0, 0], axis: [0, 0, 1]}\n"
             "  - {name: j, kind: revolute, first: crank, second: rod, point: [0.1, 0, 0], axis: [0, 0, 1]}\n"
             "  - {name: k, kind: prismatic, second: slider, point: [0.4, 0, 0], axis: [1, 0, 0]}\n"
             "  - {name: l, kind: revolute, first: slider, second: rod, point: [0.4, 0, 0], axis: [0, 0, 1]}\n"
             "motors:\n  - {name: m, joint: i, motion: {polynomial: [0, 3, 0.5]}}\n"},
        {"gear", "bodies:\n" + body("a", "[0.1, 0, 0]") + body("b", "[1.1, 0.2, 0]") +
                     "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0]}\n"
                     "  - {name: j, kind: revolute, second: b, point: [1, 0, 0], axis: [0, 1, 0]}\n"
                     "  - {name: g, kind: gear, gear_first: i, gear_second: j, gear_ratio: -0.5}\n"},
        {"on a kinematic body",
         "bodies:\n  - {name: hand, position: [0, 0, 0], motion: {rotation: {angle: {sine: {amplitude: 0.5, frequency: "
         "1}}, axis: "
         "[0, 1, 0]}}}\n" +
             body("a", "[0.3, 0, 0]") + body("b", "[0.8, 0, 0]") +
             "joints:\n  - {name: i, kind: spherical, first: hand, second: a, point: [0.1, 0, 0]}\n"
             "  - {name: j, kind: revolute, first: a, second: b, point: [0.5, 0, 0], axis: [0, 1, 0]}\n"}};
}

struct Finished {
    Finished(const std::string& text, const std::string& coordinates, const std::string& integrator, double h,
             double end, const std::string& more = "")
        : scene(parse_scene(fmt::format("coordinates: {}\nintegrator: {}\nstep: {}\nend: {}\n{}{}", coordinates,
                                        integrator, h, end, more, text),
                            "test")),
          simulation(scene.systems[0], registry) {
        while (!simulation.finished()) simulation.step();
    }
    [[nodiscard]] Eigen::VectorXd q() const {
        const auto& all = simulation.state().q;
        return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
    }
    /// The largest difference of poses; the signs of quaternions count for nothing.
    [[nodiscard]] double off(const Finished& other) const {
        Eigen::VectorXd mine = q(), its = other.q();
        for (Eigen::Index k = 0; k + 7 <= mine.size(); k += 7)
            if (mine.segment<4>(k + 3).dot(its.segment<4>(k + 3)) < 0.0) its.segment<4>(k + 3) *= -1.0;
        return (mine - its).cwiseAbs().maxCoeff();
    }

    Registry registry;
    Scene scene;
    Simulation simulation;
};

class Agreement : public testing::TestWithParam<Mechanism> {};

TEST_P(Agreement, OfJointAndMaximalCoordinates) {
    const double end = GetParam().name == "planar" ? 2.0 : 5.0;  // in 5 s it magnifies rounding by 3e5
    const Finished joint(GetParam().text, "joint", "dormand_prince", 1e-3, end);
    const Finished maximal(GetParam().text, "maximal", "dormand_prince", 1e-3, end);
    EXPECT_LE(joint.off(maximal), 1e-9);
    EXPECT_LE(joint.simulation.totals().worst_drift, 1e-13);
    EXPECT_LT(joint.simulation.joint_coordinates()->n(), maximal.scene.systems[0].system->n());
    // The start is the same, however the coordinates are.
    EXPECT_NEAR(joint.simulation.totals().start_energy, maximal.simulation.totals().start_energy, 1e-12);
}

// The Newton methods and the default one solve for the same motion with H, D, K and R of the trees.
TEST_P(Agreement, OfImplicitMethods) {
    const Finished exact(GetParam().text, "joint", "rk4", 1e-3, 0.5);
    for (const std::string method : {"generalized_alpha", "euler_implicit_linearized"}) {
        const Finished coarse(GetParam().text, "joint", method, 4e-3, 0.5),
            fine(GetParam().text, "joint", method, 2e-3, 0.5);
        // A mechanism whose motors say all leaves rounding alone; others may gain orders by their symmetry.
        const double order = std::log2(coarse.off(exact) / fine.off(exact));
        EXPECT_TRUE(order > (method == "generalized_alpha" ? 1.6 : 0.6) || coarse.off(exact) < 1e-9)
            << method << " has the order " << order;
        EXPECT_LE(fine.off(exact), method == "generalized_alpha" ? 3e-3 : 0.1) << method;
    }
}

void expect_same_reactions(const Finished& joint, const Finished& maximal, double tolerance) {
    const std::vector<double> found = joint.simulation.multipliers(), expected = maximal.simulation.multipliers();
    ASSERT_EQ(found.size(), expected.size());
    double largest = 0.0;
    for (const double value : expected) largest = std::max(largest, std::abs(value));
    EXPECT_GT(largest, 1.0);
    for (std::size_t row = 0; row < found.size(); ++row)
        EXPECT_NEAR(found[row], expected[row], tolerance * largest) << "row " << row;
}

// Where rows imply others, each choice of rows has reactions of its own.
TEST_P(Agreement, OfReactions) {
    const Finished joint(GetParam().text, "joint", "rk4", 1e-3, 0.4);
    const Finished maximal(GetParam().text, "maximal", "rk4", 1e-3, 0.4);
    if (const auto& system = *maximal.scene.systems[0].system; system.m() < system.constraint_rows())
        GTEST_SKIP() << "some of its rows imply others";
    expect_same_reactions(joint, maximal, 1e-7);
}

// The stop carries the bar: the hinge has what is left. And asking changes no step.
TEST(Reactions, KnowOfStops) {
    const std::string text = "bodies:\n" + body("a", "[0.3, 0, 0]") + body("b", "[0.8, 0, 0]") +
                             "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0], "
                             "upper: 0.3, lower: -1}\n"
                             "  - {name: j, kind: revolute, first: a, second: b, point: [0.5, 0, 0], axis: [0, 1, 0], "
                             "damping: 2}\n";
    const Finished joint(text, "joint", "moreau_jean", 1e-3, 2.0), maximal(text, "maximal", "moreau_jean", 1e-3, 2.0);
    ASSERT_GT(joint.simulation.report().active_blocks, 0);
    expect_same_reactions(joint, maximal, 1e-2);

    Registry registry;
    Scene scene = parse_scene("coordinates: joint\nintegrator: moreau_jean\nstep: 0.001\nend: 2\n" + text, "test");
    Simulation asked(scene.systems[0], registry);
    while (!asked.finished()) {
        asked.step();
        EXPECT_EQ(asked.multipliers().size(), 10U);
    }
    EXPECT_EQ(asked.state().q, joint.simulation.state().q);
}

INSTANTIATE_TEST_SUITE_P(Mechanisms, Agreement, testing::ValuesIn(mechanisms()), [](const auto& chosen) {
    std::string name = chosen.param.name;
    std::erase_if(name, [](char c) { return !std::isalnum(c); });
    return name;
});

// With steps at which the error is well above rounding.
TEST(ExplicitOrders, WithAndWithoutLoops) {
    for (const auto& [wanted, longest] : {std::pair{"balls", 1.6e-2}, {"four-bar", 1.6e-2}, {"spatial loop", 2.5e-3}}) {
        const std::string name = wanted;
        const auto all = mechanisms();
        const auto found = std::find_if(all.begin(), all.end(), [&](const Mechanism& one) { return one.name == name; });
        ASSERT_NE(found, all.end());
        std::string text = found->text;
        const std::string slow = "angular_velocity: [0, 0, 1]";
        if (const auto at = text.find(slow); at != std::string::npos)
            text.replace(at, slow.size(), "angular_velocity: [0, 0, 4]");
        const Finished best(text, "joint", "dormand_prince", longest / 8.0, 0.48);
        for (const auto& [method, order] : {std::pair{"rk4", 4.0}, {"dormand_prince", 5.0}}) {
            const Finished coarse(text, "joint", method, longest, 0.48);
            const Finished fine(text, "joint", method, 0.5 * longest, 0.48);
            EXPECT_GE(std::log2(coarse.off(best) / fine.off(best)), order - 0.5) << name << ", " << method;
        }
    }
}

TEST(EmbeddedError, MeetsTheTolerance) {
    const auto all = mechanisms();
    for (const std::size_t k : {0U, 1U, 5U}) {
        const Finished best(all[k].text, "joint", "dormand_prince", 5e-4, 1.0);
        for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
            Registry registry;
            Scene scene =
                parse_scene(fmt::format("coordinates: joint\nintegrator: dormand_prince\ntolerance: {}\nend: 1\n{}",
                                        tolerance, all[k].text),
                            "test");
            Simulation simulation(scene.systems[0], registry);
            while (!simulation.finished()) simulation.step();
            double off = 0.0;
            for (std::size_t i = 0; i < simulation.state().q.size(); ++i)
                off = std::max(off, std::abs(simulation.state().q[i] - best.simulation.state().q[i]));
            EXPECT_LE(off, 10.0 * tolerance) << all[k].name;
            EXPECT_LE(simulation.totals().newton_iterations,
                      8 * (simulation.save().step + simulation.totals().rejected + 1) + 200)
                << "one trial a step";
        }
    }
}

// A bar on a hinge, released from the horizontal: ½ J θ̇² = m g l sin θ with J about the hinge.
TEST(Pendulum, HasItsEnergyAtEachAngle) {
    const Finished run(
        "bodies:\n  - {name: a, mass: 2, inertia: {xx: 0.1, yy: 0.3, zz: 0.3}, position: [0.5, 0, 0]}\n"
        "joints: [{name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 1, 0]}]\n",
        "joint", "rk4", 1e-3, 0.4);
    const State& state = run.simulation.coordinates();
    ASSERT_EQ(state.q.size(), 1U);
    EXPECT_NEAR(0.5 * (0.3 + 2.0 * 0.25) * state.v[0] * state.v[0], 2.0 * 9.81 * 0.5 * std::sin(state.q[0]), 1e-9);
    EXPECT_GT(state.q[0], 0.5);
}

// Regular precession of a symmetric top whose axis is horizontal: Ω (Js ω − 0) = m g l with the spin ω of the body
// beside it, for J_t Ω² terms vanish there (Goldstein, Classical Mechanics, section 5.7).
TEST(HeavyTop, PrecessesRegularly) {
    const double spin = 100.0, moment = 0.02, weight = 9.81, arm = 0.3, precession = weight * arm / (moment * spin);
    const Finished run(
        fmt::format("bodies:\n  - {{name: top, mass: 1, inertia: {{xx: {}, yy: 0.015, zz: 0.015}}, position: [{}, "
                    "0, 0], velocity: [0, {}, 0], angular_velocity: [{}, 0, {}]}}\n"
                    "joints: [{{name: i, kind: spherical, second: top, point: [0, 0, 0]}}]\n",
                    moment, arm, arm * precession, spin, precession),
        "joint", "rk4", 1e-4, 0.3);
    const auto& q = run.simulation.state().q;
    EXPECT_NEAR(q[0], arm * std::cos(precession * 0.3), 1e-8);
    EXPECT_NEAR(q[1], arm * std::sin(precession * 0.3), 1e-8);
    EXPECT_NEAR(q[2], 0.0, 1e-8);
}

TEST(Energy, OfAChainIsKeptToTheOrder) {
    std::string text = "bodies:\n";
    std::string joints = "joints:\n";
    for (int i = 0; i < 8; ++i) {
        text += fmt::format(
            "  - {{name: b{}, mass: 0.1, inertia: {{xx: 1e-6, yy: 8e-5, zz: 8e-5}}, position: [{}, 0, 0]}}\n", i,
            0.05 + 0.1 * i);
        joints += fmt::format(
            "  - {{name: j{}, kind: revolute, first: {}, second: b{}, point: [{}, 0, 0], axis: [0, 1, 0]}}\n", i,
            i == 0 ? std::string("world") : fmt::format("b{}", i - 1), i, 0.1 * i);
    }
    const auto change = [&](double h) {
        const Finished run(text + joints, "joint", "rk4", h, 1.0);
        return std::abs(run.simulation.totals().energy - run.simulation.totals().start_energy);
    };
    const double coarse = change(1e-3), fine = change(5e-4);
    EXPECT_LE(fine, 1e-6);
    EXPECT_GT(coarse, 10.0 * fine);
}

// The head of the scene says where the last link is at its end.
TEST(ArticulatedChain, EndsWhereItsReferenceDoes) {
    const auto off = [](double step) {
        SceneOverrides overrides;
        overrides.step = step;
        Registry registry;
        Scene scene =
            read_scene(std::string(tests::places::source) + "/examples/scenes/articulated_chain.yaml", overrides);
        Simulation simulation(scene.systems[0], registry);
        while (!simulation.finished()) simulation.step();
        const Vector3 x = scene.systems[0].system->pose(simulation.state(), 19).position;
        return std::hypot(x[0] - 1.8863757639658685, x[1], x[2] + 0.4774302574045009);
    };
    const double coarse = off(0.005), fine = off(0.0025);
    EXPECT_LE(coarse, 2e-6);
    EXPECT_LE(fine, coarse / 16.0);
}

#ifdef DELASSUS_HAS_FCL
// A gate on a hinge that a servo with a limit drives against dry friction, and a parcel on a belt: in its coordinate
// servo and friction cancel each other while the gate sticks.
TEST(ParcelLine, RunsInJointCoordinates) {
    const auto gate = [](const std::string& coordinates) {
        SceneOverrides overrides;
        overrides.end = 2.5;
        overrides.values = {{"coordinates", coordinates}};
        Registry registry;
        Scene scene = read_scene(std::string(tests::places::source) + "/examples/scenes/parcel_line.yaml", overrides);
        Simulation simulation(scene.systems[0], registry);
        while (!simulation.finished()) simulation.step();
        EXPECT_EQ(simulation.totals().unsolved_steps, 0) << coordinates;
        const MultibodySystem& system = *scene.systems[0].system;
        return system.pose(simulation.state(), system.find_body("gate")).position;
    };
    const Vector3 joint = gate("joint"), maximal = gate("maximal");
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(joint[i], maximal[i], 1e-3);
    EXPECT_GT(std::hypot(joint[0] - 1.5, joint[1] + 0.1), 0.3);  // it has opened
}

// A chain of spheres on hinges that falls on the ground, and a sphere that nothing holds.
TEST(Contacts, AreThoseOfTheBodies) {
    const std::string text =
        "materials: {m: {friction: 0.4}}\n"
        "bodies:\n  - {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "  - {name: a, mass: 1, inertia: {xx: 0.004, yy: 0.004, zz: 0.004}, position: [0.3, 0, 0.3], shapes: [{sphere: "
        "{radius: 0.1}, material: m}]}\n"
        "  - {name: b, mass: 1, inertia: {xx: 0.004, yy: 0.004, zz: 0.004}, position: [0.7, 0, 0.3], shapes: [{sphere: "
        "{radius: 0.1}, material: m}]}\n"
        "  - {name: c, mass: 1, inertia: {xx: 0.004, yy: 0.004, zz: 0.004}, position: [2, 0, 0.2], velocity: [1, 0, "
        "0], "
        "shapes: [{sphere: {radius: 0.1}, material: m}]}\n"
        "joints:\n  - {name: i, kind: revolute, second: a, point: [0, 0, 0.3], axis: [0, 1, 0]}\n"
        "  - {name: j, kind: revolute, first: a, second: b, point: [0.5, 0, 0.3], axis: [0, 1, 0]}\n";
    const Finished joint(text, "joint", "euler_implicit_linearized", 5e-4, 1.0);
    const Finished maximal(text, "maximal", "euler_implicit_linearized", 5e-4, 1.0);
    EXPECT_GE(joint.simulation.totals().most_contacts, 3);
    EXPECT_LE(joint.off(maximal), 5e-3);
    const auto& q = joint.simulation.state().q;
    for (const std::size_t z : {2U, 9U, 16U}) EXPECT_NEAR(q[z], 0.1, 2e-3);  // on the ground
    EXPECT_LE(joint.simulation.totals().worst_drift, 1e-13);
    const auto of_joint = joint.simulation.contacts(), of_maximal = maximal.simulation.contacts();
    ASSERT_EQ(of_joint.size(), of_maximal.size());
    // On the sphere that nothing holds: the forces of the chain are not unique, for friction can brace it.
    const auto weight = [](const std::vector<ContactRecord>& contacts) {
        double sum = 0.0;
        for (const auto& contact : contacts)
            if (contact.bodies[0] == 3 || contact.bodies[1] == 3) sum += std::abs(contact.force[2]);
        return sum;
    };
    EXPECT_NEAR(weight(of_joint), 9.81, 1e-3);
    EXPECT_NEAR(weight(of_maximal), 9.81, 1e-3);
}
#endif

TEST(JointScenes, GoOnFromACheckpointWithTheSameBits) {
    for (const std::size_t k : {1U, 5U}) {
        const auto mechanism = mechanisms()[k];
        for (const std::string method : {"rk4", "dormand_prince"}) {
            const std::string text =
                fmt::format("coordinates: joint\nintegrator: {}\nstep: 0.005\nend: 0.2\n{}", method, mechanism.text);
            Registry registry;
            Scene scene = parse_scene(text, "test"), other = parse_scene(text, "test");
            Simulation whole(scene.systems[0], registry);
            for (int i = 0; i < 10; ++i) whole.step();
            Simulation resumed(other.systems[0], registry);
            resumed.load(whole.save());
            for (int i = 0; i < 10; ++i) {
                whole.step();
                resumed.step();
            }
            EXPECT_EQ(whole.coordinates().q, resumed.coordinates().q) << mechanism.name << ", " << method;
            EXPECT_EQ(whole.state().v, resumed.state().v);
        }
    }
}

TEST(JointScenes, SayWhatIsSavedAndRefuseWhatCannotBe) {
    const auto mechanism = mechanisms()[5];  // the four-bar
    Registry registry;
    Scene scene = parse_scene("coordinates: joint\nstep: 0.01\nend: 1\n" + mechanism.text, "test");
    const auto plan = make_plan(scene, registry).front();
    EXPECT_EQ(plan.velocities, 3);
    const auto says = [](const std::vector<PlanLine>& lines, std::string_view part) {
        return std::any_of(lines.begin(), lines.end(), [&](const PlanLine& line) {
            return (line.what + ": " + line.reason).find(part) != std::string::npos;
        });
    };
    EXPECT_TRUE(says(plan.kept, "joint coordinates"));
    EXPECT_TRUE(says(plan.left_out, "15 of 18 velocities and 15 rows"));
    EXPECT_THROW(
        Simulation(
            parse_scene("coordinates: joint\nsleeping: true\nstep: 0.01\nend: 1\n" + mechanism.text, "test").systems[0],
            registry),
        Unsupported);
    EXPECT_THROW(static_cast<void>(parse_scene("coordinates: reduced\nstep: 0.01\nend: 1\n" + mechanism.text, "test")),
                 InputError);
}

}  // namespace
}  // namespace delassus::tests::mechanism_test
