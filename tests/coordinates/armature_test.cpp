// SPDX-License-Identifier: BSD-3-Clause
// Rotors behind joints, bodies without mass between joints, and gears of slides.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "delassus/error.hpp"
#include "delassus/joint_coordinates.hpp"
#include "support/scenes.hpp"
#include "support/system_derivatives.hpp"

namespace delassus::tests::armature_test {
namespace {

BodyParameters tumbler(const std::string& name, const Vector3& position, bool massless = false) {
    BodyParameters body;
    body.name = name;
    body.mass = 1.7;
    body.inertia = {0.3, 0.4, 0.5, 0.02, -0.03, 0.01};
    body.pose = {position, {0.8, 0.2, -0.4, 0.3}};
    body.massless = massless;
    return body;
}

JointParameters joint_of(JointKind kind, const std::string& name, BodyIndex first, BodyIndex second,
                         const Vector3& axis, double armature = 0.0) {
    JointParameters joint;
    joint.name = name;
    joint.kind = kind;
    joint.first = first;
    joint.second = second;
    joint.axis = axis;
    joint.point = {0.1, 0.2, -0.1};
    (kind == JointKind::Prismatic ? joint.slide : joint.turn).armature = armature;
    return joint;
}

/// A slide, a hinge and a ball, each with a rotor, and a free body that carries a hinge with one.
void add_rotors(MultibodySystem& system, double a) {
    const auto slider = system.add_body(tumbler("slider", {0.0, 0.1, 0.0}));
    const auto arm = system.add_body(tumbler("arm", {0.5, 0.2, 0.1}));
    const auto hand = system.add_body(tumbler("hand", {0.9, -0.1, 0.3}));
    const auto ship = system.add_body(tumbler("ship", {3.0, 0.0, 0.0}));
    const auto wheel = system.add_body(tumbler("wheel", {3.2, 0.4, 0.0}));
    system.add_joint(joint_of(JointKind::Prismatic, "rail", world_body, slider, {1.0, 0.2, 0.0}, 0.7 * a));
    system.add_joint(joint_of(JointKind::Revolute, "elbow", slider, arm, {0.0, 1.0, 0.3}, 0.4 * a));
    system.add_joint(joint_of(JointKind::Spherical, "wrist", arm, hand, {0.0, 0.0, 1.0}, 0.2 * a));
    system.add_joint(joint_of(JointKind::Revolute, "axle", wheel, ship, {0.0, 1.0, 0.0}, 0.3 * a));
    system.finish();
    system.assemble();
}

State somewhere(const JointCoordinates& joints) {
    State state = joints.initial_state();
    VectorXd by = VectorXd::LinSpaced(joints.n(), -0.6, 0.7);
    joints.increment(state.q.data(), by.data(), state.q.data());
    for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] = 0.3 + 0.2 * static_cast<double>(i % 4);
    return state;
}

MatrixXd mass_of(const JointCoordinates& joints, const State& state) {
    MatrixAssembler M;
    M.begin(joints.n(), joints.n());
    joints.add_mass(state, 1.0, M);
    return dense(M.finish(), joints.n(), joints.n());
}

TEST(Armature, AddsToTheDiagonalOfTheMassMatrixAndToTheEnergy) {
    MultibodySystem with, without;
    add_rotors(with, 1.0);
    add_rotors(without, 0.0);
    EXPECT_EQ(with.needs_joint_coordinates(), "the joint \"rail\" has an armature");
    EXPECT_EQ(without.needs_joint_coordinates(), "");
    const JointCoordinates rotors(with), plain(without);
    const State state = somewhere(rotors);
    const MatrixXd difference = mass_of(rotors, state) - mass_of(plain, state);
    VectorXd expected(rotors.n());
    expected << 0.7, 0.4, 0.2, 0.2, 0.2, VectorXd::Zero(6), 0.3;
    EXPECT_LE((difference - MatrixXd(expected.asDiagonal())).cwiseAbs().maxCoeff(), 1e-13) << difference;
    const Eigen::Map<const VectorXd> u(state.v.data(), rotors.n());
    EXPECT_NEAR(rotors.energy(state) - plain.energy(state), 0.5 * u.dot(expected.cwiseProduct(u)), 1e-12);
    expect_derivatives(rotors, state, VectorXd(), 1e-6, true);

    // Articulated bodies against the matrix.
    VectorXd f = VectorXd::Zero(rotors.n()), u_dot(rotors.n());
    rotors.add_force(state, 1.0, f.data());
    ASSERT_TRUE(rotors.accelerate(state, u_dot.data()));
    EXPECT_LE((mass_of(rotors, state) * u_dot - f).norm(), 1e-11 * f.norm());
}

// The linear momentum of an arm changes by its weight, by what the ground's joint carries, and by the push of its
// rotor.
TEST(Armature, ReactionsBalanceBodiesAndRotors) {
    MultibodySystem system;
    add_rotors(system, 1.0);
    const JointCoordinates joints(system);
    const State state = somewhere(joints);
    const State bodies = joints.bodies_of(state);
    std::vector<double> force(static_cast<std::size_t>(system.n()), 0.0);
    system.add_force(bodies, 1.0, force.data());
    const std::vector<double> carried = joints.tree_reactions(state, force);
    VectorXd u_dot(joints.n()), total = Eigen::Map<const VectorXd>(force.data(), system.n());
    joints.accelerate(state, u_dot.data());
    MatrixAssembler rows;
    rows.begin(system.constraint_rows(), system.n());
    system.add_joint_jacobian(bodies, rows);
    std::vector<double> all(static_cast<std::size_t>(system.constraint_rows()), 0.0);
    for (std::size_t i = 0; i < carried.size(); ++i)
        all[static_cast<std::size_t>(joints.rows_of_trees()[i])] = carried[i];
    rows.finish().transpose_multiply_add(1.0, all.data(), total.data());
    const auto at = [&](double h) {
        State moved = state;
        const VectorXd step = h * Eigen::Map<const VectorXd>(state.v.data(), joints.n());
        joints.increment(state.q.data(), step.data(), moved.q.data());
        for (std::int32_t i = 0; i < joints.n(); ++i) moved.v[static_cast<std::size_t>(i)] += h * u_dot[i];
        return joints.bodies_of(moved);
    };
    const double h = 1e-6;
    const State after = at(h), before = at(-h);
    const double size = std::hypot(1.0, 0.2);
    const Vector3 axis{1.0 / size, 0.2 / size, 0.0};
    for (std::size_t i = 0; i < 3; ++i) {
        double rate = 0.0, sum = -0.7 * u_dot[0] * axis[i];
        for (BodyIndex body = 0; body < 3; ++body) {
            const auto place = static_cast<std::size_t>(system.body_column(body)) + i;
            rate += system.body(body).mass * (after.v[place] - before.v[place]) / (2.0 * h);
            sum += total[static_cast<Eigen::Index>(place)];
        }
        EXPECT_NEAR(sum, rate, 1e-6) << i;
    }
}

// A weight m on a string about a drum: a = m g/(m + J/r²), with the drum as the armature J/r² of the slide.
TEST(Armature, SlowsAFallingWeight) {
    Running run(
        parse_scene("step: 0.01\nend: 1\nbodies: [{name: w, mass: 2, inertia: {xx: 1, yy: 1, zz: 1}}]\n"
                    "joints: [{name: s, kind: prismatic, second: w, axis: [0, 0, 1], armature: 3}]\n",
                    "s"));
    EXPECT_EQ(run.scene.systems[0].coordinates, Coordinates::Joint);
    run.finish();
    EXPECT_NEAR(run.pose("w").position[2], -0.5 * 9.81 * 2.0 / 5.0, 1e-9);
}

// Two hinges whose axes cross, with a piece without mass between them, are a universal joint.
TEST(MasslessBody, BetweenTwoHingesMakesAUniversalJoint) {
    MultibodySystem chain, cross;
    const Vector3 first{1.0, 2.0, -0.5}, second{2.0, -1.0, 0.0};
    {
        const auto piece = chain.add_body(tumbler("piece", {0.3, 0.0, 0.0}, true));
        const auto body = chain.add_body(tumbler("body", {0.5, -0.2, 0.4}));
        chain.add_joint(joint_of(JointKind::Revolute, "one", world_body, piece, first));
        chain.add_joint(joint_of(JointKind::Revolute, "two", piece, body, second));
    }
    {
        const auto body = cross.add_body(tumbler("body", {0.5, -0.2, 0.4}));
        auto joint = joint_of(JointKind::Universal, "both", world_body, body, first);
        joint.second_axis = second;
        cross.add_joint(joint);
    }
    for (auto* system : {&chain, &cross}) {
        system->finish();
        system->assemble();
    }
    const JointCoordinates two(chain), one(cross);
    ASSERT_EQ(two.n(), 2);
    State state = two.initial_state();
    state.q = {0.7, -0.4};
    state.v = {1.3, -0.8};
    EXPECT_LE((mass_of(two, state) - mass_of(one, state)).cwiseAbs().maxCoeff(), 1e-13);
    VectorXd a(2), b(2);
    two.accelerate(state, a.data());
    one.accelerate(state, b.data());
    EXPECT_LE((a - b).norm(), 1e-12 * b.norm());
    expect_derivatives(two, state, VectorXd(), 1e-6, true);
}

TEST(MasslessBody, SaysWhereNothingResistsItsJoint) {
    MultibodySystem system;
    const auto piece = system.add_body(tumbler("piece", {0.3, 0.0, 0.0}, true));
    const auto body = system.add_body(tumbler("body", {0.5, -0.2, 0.4}));
    system.add_joint(joint_of(JointKind::Revolute, "one", world_body, piece, {0.0, 0.0, 1.0}));
    system.add_joint(joint_of(JointKind::Revolute, "two", piece, body, {0.0, 0.0, 1.0}));
    system.finish();
    system.assemble();
    const JointCoordinates joints(system);
    VectorXd a(2);
    EXPECT_THROW(joints.accelerate(joints.initial_state(), a.data()), StepFailure);
}

std::string refusal(const std::string& yaml) {
    try {
        const Running run(parse_scene("step: 0.01\nend: 1\n" + yaml, "s"));
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

TEST(MasslessBody, IsRefusedWhereItCannotBe) {
    const std::string ball = "{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}", piece = "{name: p, massless: true}";
    const auto scene = [&](const std::string& joints, const std::string& more = "") {
        return "bodies: [" + ball + ", " + piece + "]\njoints: [" + joints + "]\n" + more;
    };
    const std::string hold = "{name: h, kind: revolute, second: p}, ", carry =
                                                                           "{name: c, kind: revolute, first: p, "
                                                                           "second: b, axis: [1, 0, 0]}";
    EXPECT_EQ(refusal(scene(hold + carry)), "");
    EXPECT_NE(refusal(scene(hold)).find("has no mass, and carries none"), std::string::npos);
    EXPECT_NE(refusal("bodies: [" + piece + "]\n").find("no joint of a tree holds it"), std::string::npos);
    EXPECT_NE(refusal(scene(hold + carry, "coordinates: maximal\n")).find("which joint coordinates alone take"),
              std::string::npos);
    EXPECT_NE(refusal(scene(hold + carry, "start: equilibrium\n")).find("moves bodies by their masses"),
              std::string::npos);
    EXPECT_NE(refusal("bodies: [{name: p, massless: true, mass: 1}]\n").find("is massless, and has a mass"),
              std::string::npos);
    EXPECT_NE(refusal("bodies: [{name: p, massless: true, fixed: true}]\n").find("is massless, and is fixed"),
              std::string::npos);
    EXPECT_NE(refusal(scene("{name: d, kind: planar, second: b, armature: 1}")).find("no angle for"),
              std::string::npos);
    EXPECT_NE(refusal(scene("{name: d, kind: universal, second: b, armature: 1}")).find("is universal"),
              std::string::npos);
}

// Of a triangle of three joints the tree must hold the two with rotors; with three it cannot.
TEST(Armature, OfALoopIsHeldByTheTree) {
    const auto scene = [](const std::string& rotor) {
        return "bodies: [{name: a, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, position: [0.5, 0, 0.5]},\n"
               "  {name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, position: [1.5, 0, 0.5]}]\n"
               "joints: [{name: one, kind: revolute, second: a, axis: [0, 1, 0], armature: 0.1},\n"
               "  {name: two, kind: spherical, first: a, second: b, point: [1, 0, 1], armature: 0.1},\n"
               "  {name: three, kind: fixed, second: b, point: [2, 0, 0]" +
               rotor + "}]\n";
    };
    EXPECT_EQ(refusal(scene("")), "");
    EXPECT_NE(refusal(scene("}, {name: four, kind: revolute, second: b, point: [2, 0, 0], axis: [0, 1, 0], "
                            "armature: 0.1"))
                  .find("has an armature and closes a loop"),
              std::string::npos);
}

// Two weights on slides whose ways have the ratio r: (m₁ + r² m₂) s̈ = −g (m₁ + r m₂).
TEST(Gear, OfTwoSlidesKeepsTheirRatio) {
    for (const std::string how :
         {"coordinates: joint\nintegrator: dormand_prince\n", "coordinates: maximal\nintegrator: trapezoidal\n", ""}) {
        Running run(parse_scene("step: 0.01\nend: 0.5\n" + how +
                                    "bodies: [{name: a, mass: 3, inertia: {xx: 1, yy: 1, zz: 1}},\n"
                                    "  {name: b, mass: 2, inertia: {xx: 1, yy: 1, zz: 1}, position: [1, 0, 0]}]\n"
                                    "joints: [{name: a, kind: prismatic, second: a, axis: [0, 0, 1]},\n"
                                    "  {name: b, kind: prismatic, second: b, axis: [0, 0, 1]},\n"
                                    "  {name: g, kind: gear, gear_first: a, gear_second: b, gear_ratio: -0.3141592}]\n",
                                "s"));
        run.finish();
        constexpr double r = -0.3141592, m1 = 3.0, m2 = 2.0;
        const double way = -0.5 * 9.81 * (m1 + r * m2) / (m1 + r * r * m2) * 0.25;
        EXPECT_NEAR(run.pose("a").position[2], way, 1e-8) << how;
        EXPECT_NEAR(run.pose("b").position[2], r * way, 1e-8) << how;
    }
}

TEST(Gear, OfTwoSlidesHasExactDerivatives) {
    MultibodySystem system;
    const auto arm = system.add_body(tumbler("arm", {0.5, 0.2, 0.1}));
    const auto left = system.add_body(tumbler("left", {0.9, -0.1, 0.3}));
    const auto right = system.add_body(tumbler("right", {0.9, 0.4, 0.3}));
    system.add_joint(joint_of(JointKind::Revolute, "hinge", world_body, arm, {0.0, 1.0, 0.3}));
    const auto one = system.add_joint(joint_of(JointKind::Prismatic, "left", arm, left, {1.0, 0.2, 0.0}));
    const auto two = system.add_joint(joint_of(JointKind::Prismatic, "right", right, arm, {0.3, 0.2, 1.0}));
    JointParameters gear;
    gear.name = "gear";
    gear.kind = JointKind::Gear;
    gear.gear_first = one;
    gear.gear_second = two;
    gear.gear_ratio = 0.7;
    system.add_joint(gear);
    gear.gear_first = 0;
    EXPECT_THROW(system.add_joint(gear), InputError);
    system.finish();
    State state = system.initial_state();
    for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] = 0.3 + 0.1 * static_cast<double>(i % 5);
    expect_derivatives(system, state, VectorXd::LinSpaced(system.m(), -1.0, 2.0), 1e-6);
    system.assemble();
    const JointCoordinates joints(system);
    ASSERT_EQ(joints.m(), 1);
    expect_derivatives(joints, somewhere(joints), VectorXd::Constant(1, 1.3), 1e-6, true);
}

}  // namespace
}  // namespace delassus::tests::armature_test
