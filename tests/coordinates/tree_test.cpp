// SPDX-License-Identifier: BSD-3-Clause
// Joint coordinates against the bodies that they place: Jacobians, masses, forces and all derivatives.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/joint_coordinates.hpp"
#include "delassus/multibody.hpp"
#include "support/system_derivatives.hpp"

namespace delassus::tests::tree_test {
namespace {

BodyParameters tumbling(const std::string& name, const Vector3& position) {
    BodyParameters body;
    body.name = name;
    body.mass = 2.0 + 0.1 * position[0];
    body.inertia = {0.3, 0.4, 0.5, 0.02, -0.03, 0.01};
    body.pose = {position, {0.8, 0.2, -0.4, 0.3}};
    return body;
}

JointParameters joint_of(JointKind kind, BodyIndex first, BodyIndex second, const Vector3& point) {
    JointParameters joint;
    joint.kind = kind;
    joint.first = first;
    joint.second = second;
    joint.point = point;
    joint.second_point = {point[0] + 0.4, point[1] - 0.3, point[2] + 0.6};
    joint.axis = {1.0, 2.0, -0.5};
    joint.second_axis = {2.0, -1.0, 0.0};
    return joint;
}

/// A trunk on the world or free, two branches of which one is given the other way round, one more link on the first.
struct Mechanism {
    explicit Mechanism(JointKind kind, bool grounded = true) {
        const BodyIndex trunk = system.add_body(tumbling("trunk", {0.0, 0.1, 0.2}));
        const BodyIndex left = system.add_body(tumbling("left", {1.0, -0.3, 0.4}));
        const BodyIndex right = system.add_body(tumbling("right", {-1.0, 0.3, 0.7}));
        const BodyIndex tip = system.add_body(tumbling("tip", {2.0, -0.1, 0.1}));
        if (grounded) system.add_joint(joint_of(kind, world_body, trunk, {-0.3, 0.2, 0.1}));
        system.add_joint(joint_of(kind, trunk, left, {0.5, 0.2, 0.1}));
        system.add_joint(joint_of(kind, right, trunk, {-0.5, 0.3, 0.6}));
        system.add_joint(joint_of(JointKind::Revolute, left, tip, {1.5, -0.1, 0.3}));
        bodies = {trunk, left, right, tip};
    }

    void add_forces() {
        SpringParameters spring;
        spring.first = bodies[2];
        spring.second = bodies[3];
        spring.first_point = {-1.1, 0.2, 0.5};
        spring.second_point = {2.0, 0.3, 0.2};
        spring.stiffness = 30.0;
        spring.damping = 2.0;
        spring.rest_length = 1.0;
        system.add_spring(spring);
        std::swap(spring.first, spring.second);
        std::swap(spring.first_point, spring.second_point);
        spring.second = bodies[1];
        spring.second_point = {0.9, 0.4, 0.1};
        system.add_spring(spring);
        BushingParameters bushing;
        bushing.second = bodies[1];
        bushing.point = {0.9, -0.2, 0.3};
        bushing.stiffness = {10.0, 20.0, 30.0};
        bushing.damping = {1.0, 2.0, 3.0};
        bushing.turn_stiffness = {4.0, 5.0, 6.0};
        bushing.turn_damping = {0.4, 0.5, 0.6};
        system.add_bushing(bushing);
        LoadParameters load;
        load.body = bodies[3];
        load.force = {Motion::constant(3.0), Motion::constant(-2.0), Motion::constant(1.0)};
        load.torque = {Motion::constant(0.3), Motion::constant(0.2), Motion::constant(-0.1)};
        load.point = {2.1, 0.1, 0.3};
        system.add_load(load);
        load.follower = true;
        load.body = bodies[2];
        system.add_load(load);
    }

    MultibodySystem system;
    std::vector<BodyIndex> bodies;
};

State displaced(const JointCoordinates& system) {
    State state = system.initial_state();
    state.t = 0.3;
    VectorXd delta(system.n());
    for (int i = 0; i < delta.size(); ++i) delta[i] = 0.4 * std::sin(1.0 + 3.0 * i);
    system.increment(state.q.data(), delta.data(), state.q.data());
    for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] += 0.7 * std::cos(2.0 + static_cast<double>(i));
    return state;
}

VectorXd some_lambda(std::int32_t m) {
    VectorXd lambda(m);
    for (int i = 0; i < m; ++i) lambda[i] = 1.5 * std::cos(0.5 + i);
    return lambda;
}

/// J by central differences of the bodies' poses.
MatrixXd jacobian(const JointCoordinates& joints, const State& state) {
    const double step = 1e-6;
    MatrixXd J(joints.bodies().n(), joints.n());
    for (std::int32_t j = 0; j < joints.n(); ++j) {
        const VectorXd delta = step * VectorXd::Unit(joints.n(), j);
        const State up = joints.bodies_of(moved(joints, state, delta));
        const State down = joints.bodies_of(moved(joints, state, -delta));
        VectorXd change(J.rows());
        joints.bodies().difference(down.q.data(), up.q.data(), change.data());
        J.col(j) = change / (2.0 * step);
    }
    return J;
}

MatrixXd mass(const DynamicalSystem& system, const State& state) {
    MatrixAssembler assembler;
    assembler.begin(system.n(), system.n());
    system.add_mass(state, 1.0, assembler);
    return dense(assembler.finish());
}

class TreeOf : public testing::TestWithParam<JointKind> {};

TEST_P(TreeOf, PlacesAndMovesTheBodies) {
    for (const bool grounded : {true, false}) {
        Mechanism mechanism(GetParam(), grounded);
        mechanism.system.finish();
        mechanism.system.assemble();
        JointCoordinates joints(mechanism.system);
        const State state = displaced(joints), bodies = joints.bodies_of(state);
        std::vector<double> C(static_cast<std::size_t>(mechanism.system.constraint_rows()));
        mechanism.system.all_constraints(bodies, C.data());
        for (const double row : C) EXPECT_LE(std::abs(row), 1e-14);
        const MatrixXd J = jacobian(joints, state);
        const Eigen::Map<const VectorXd> u(state.v.data(), joints.n()), v(bodies.v.data(), J.rows());
        expect_near(v, J * u, 1e-8, "J u");
        expect_near(mass(joints, state), J.transpose() * mass(mechanism.system, bodies) * J, 1e-8, "M");
        const State again = joints.coordinates_of(bodies);
        VectorXd off(joints.n());
        joints.difference(state.q.data(), again.q.data(), off.data());
        EXPECT_LE(off.norm(), 1e-13);
        expect_near(Eigen::Map<const VectorXd>(again.v.data(), joints.n()), u, 1e-13, "u");
        EXPECT_EQ(joints.m(), 0);
        expect_group(joints, state, 0.3 * some_lambda(joints.n()));
    }
}

// J̇ u by differences along the motion; then f = Jᵀ (f̄ − M̄ J̇ u).
TEST_P(TreeOf, ProjectsForcesAndAcceleratesByArticulatedBodies) {
    Mechanism mechanism(GetParam());
    mechanism.add_forces();
    mechanism.system.finish();
    mechanism.system.assemble();
    JointCoordinates joints(mechanism.system);
    const State state = displaced(joints), bodies = joints.bodies_of(state);
    const Eigen::Map<const VectorXd> u(state.v.data(), joints.n());
    const double step = 1e-6;
    const auto velocities = [&](double time) {
        const State at = joints.bodies_of(moved(joints, state, time * u));
        return VectorXd(Eigen::Map<const VectorXd>(at.v.data(), static_cast<Eigen::Index>(at.v.size())));
    };
    const VectorXd bias = (velocities(step) - velocities(-step)) / (2.0 * step);
    VectorXd force = VectorXd::Zero(bias.size()), projected = VectorXd::Zero(joints.n());
    mechanism.system.add_force(bodies, 1.0, force.data());
    joints.add_force(state, 1.0, projected.data());
    const MatrixXd J = jacobian(joints, state);
    expect_near(projected, J.transpose() * (force - mass(mechanism.system, bodies) * bias), 1e-7, "f");
    VectorXd acceleration(joints.n());
    ASSERT_TRUE(joints.accelerate(state, acceleration.data()));
    expect_near(acceleration, mass(joints, state).llt().solve(projected), 1e-11, "accelerations");
    EXPECT_DOUBLE_EQ(joints.energy(state), mechanism.system.energy(bodies));
}

TEST_P(TreeOf, HasTheDerivativesOfItsForcesAndLoops) {
    for (const bool grounded : {true, false}) {
        Mechanism mechanism(GetParam(), grounded);
        mechanism.add_forces();
        mechanism.system.add_joint(
            joint_of(JointKind::Distance, mechanism.bodies[2], mechanism.bodies[3], {0.1, 0.3, 0.5}));
        mechanism.system.add_joint(joint_of(JointKind::Distance, world_body, mechanism.bodies[1], {0.3, 0.3, 0.5}));
        mechanism.system.finish();
        mechanism.system.assemble();
        JointCoordinates joints(mechanism.system);
        // Where all is fixed to the ground the second one is implied.
        EXPECT_EQ(joints.m(), grounded && GetParam() == JointKind::Fixed ? 1 : 2);
        const State state = displaced(joints);
        expect_derivatives(joints, state, some_lambda(joints.m()), 2e-7, true);
        const VectorXd a = some_lambda(joints.n());
        const auto inertial = [&](const State& at) {
            VectorXd result = VectorXd::Zero(joints.n());
            joints.multiply_mass(at, 1.0, a.data(), result.data());
            return result;
        };
        MatrixAssembler assembler;
        assembler.begin(joints.n(), joints.n());
        joints.add_inertial_stiffness(state, a.data(), 1.0, Tangent::Exact, assembler);
        expect_near(dense(assembler.finish()), along_positions(joints, state, inertial), 1e-7, "inertial stiffness");
    }
}

INSTANTIATE_TEST_SUITE_P(Kinds, TreeOf,
                         testing::Values(JointKind::Spherical, JointKind::Revolute, JointKind::Prismatic,
                                         JointKind::Cylindrical, JointKind::Universal, JointKind::Planar,
                                         JointKind::Fixed));

// The loops of a row end where the ways of its two bodies to the ground meet.
TEST(Tree, RowsBetweenBranchesDoNotReachTheTrunk) {
    Mechanism mechanism(JointKind::Revolute);
    mechanism.system.add_joint(
        joint_of(JointKind::Distance, mechanism.bodies[2], mechanism.bodies[3], {0.1, 0.3, 0.5}));
    mechanism.system.finish();
    mechanism.system.assemble();
    JointCoordinates joints(mechanism.system);
    MatrixAssembler assembler;
    assembler.begin(1, joints.n());
    joints.add_constraint_jacobian(displaced(joints), 0, assembler);
    const SparseMatrix& D = assembler.finish();
    EXPECT_EQ(D.column, (std::vector<std::int32_t>{1, 2, 3}));  // not the trunk's own
}

// Also where the joint names the later body first.
TEST(Tree, SpringsAndDampersOfJointsActOnTheirCoordinateAlone) {
    Mechanism mechanism(JointKind::Revolute);
    const BodyIndex last = mechanism.system.add_body(tumbling("last", {2.5, 0.3, 0.2}));
    JointParameters sprung = joint_of(JointKind::Revolute, last, mechanism.bodies[3], {2.2, 0.1, 0.1});
    sprung.turn.stiffness = 7.0;
    sprung.turn.damping = 0.3;
    mechanism.system.add_joint(sprung);
    mechanism.system.finish();
    mechanism.system.assemble();
    JointCoordinates joints(mechanism.system);
    const State state = displaced(joints);
    MatrixAssembler assembler;
    assembler.begin(joints.n(), joints.n());
    joints.add_stiffness(state, 2.0, Tangent::Symmetric, assembler);
    joints.add_damping(state, 10.0, Tangent::Symmetric, assembler);
    const SparseMatrix& H = assembler.finish();
    ASSERT_EQ(H.column, std::vector<std::int32_t>{joints.n() - 1});
    EXPECT_NEAR(H.value[0], 2.0 * 7.0 + 10.0 * 0.3, 1e-12);
}

// Limits, friction and a limited motor: D_A = D̄_A J, with the same gaps, cones and keys.
TEST(Tree, ProjectsUnilateralRows) {
    Mechanism mechanism(JointKind::Revolute);
    JointParameters stopped =
        joint_of(JointKind::Revolute, mechanism.bodies[3],
                 mechanism.system.add_body(tumbling("stopped", {2.5, 0.3, 0.2})), {2.2, 0.1, 0.1});
    stopped.lower = -0.001;
    stopped.upper = 0.002;
    stopped.turn.friction = 0.4;
    const auto joint = mechanism.system.add_joint(stopped);
    MotorParameters motor;
    motor.joint = joint;
    motor.speed = true;
    motor.motion = Motion::constant(1.0);
    motor.force_limit = 3.0;
    mechanism.system.add_motor(motor);
    mechanism.system.finish();
    mechanism.system.assemble();
    JointCoordinates joints(mechanism.system);
    State state = displaced(joints);
    state.q.back() = 0.0;  // the angle with the stops
    const State bodies = joints.bodies_of(state);
    UnilateralRows rows, of_bodies;
    rows.measure_speeds_at(state.v.data());
    of_bodies.measure_speeds_at(bodies.v.data());
    ASSERT_TRUE(joints.has_unilateral());
    joints.collect_unilateral(state, 1e-3, rows);
    mechanism.system.collect_unilateral(bodies, 1e-3, of_bodies);
    ASSERT_EQ(rows.blocks().size(), 4U);
    ASSERT_EQ(rows.blocks().size(), of_bodies.blocks().size());
    for (std::size_t k = 0; k < rows.blocks().size(); ++k) {
        EXPECT_EQ(rows.blocks()[k].key, of_bodies.blocks()[k].key);
        EXPECT_NEAR(rows.blocks()[k].speed, of_bodies.blocks()[k].speed, 1e-13);
        EXPECT_EQ(rows.rows()[k].gap, of_bodies.rows()[k].gap);
        EXPECT_EQ(rows.rows()[k].rate, of_bodies.rows()[k].rate);
        EXPECT_EQ(rows.row_start()[k + 1] - rows.row_start()[k], 1);  // the angle is a coordinate
    }
}

TEST(Tree, TellsItsJointsAndRefusesNodes) {
    Mechanism mechanism(JointKind::Spherical, false);
    mechanism.system.finish();
    mechanism.system.assemble();
    const JointCoordinates joints(mechanism.system);
    const auto all = joints.joints();
    ASSERT_EQ(all.size(), 4U);
    EXPECT_EQ(all[0].joint, -1);
    EXPECT_EQ(all[0].body, mechanism.bodies[2]) << "the one that no joint has as its second";
    EXPECT_EQ(all[0].freedoms, 6);
    EXPECT_EQ(joints.n(), 6 + 3 + 3 + 1);
    EXPECT_EQ(joints.position_size(), 7 + 4 + 4 + 1);
    EXPECT_EQ(joints.rows_saved(), 3 + 3 + 5);
    EXPECT_EQ(joints.body_velocities(), 24);

    MultibodySystem soft;
    NodeParameters node;
    node.mass = 1.0;
    soft.add_node(node);
    soft.finish();
    soft.assemble();
    EXPECT_THROW(JointCoordinates{soft}, Unsupported);
}

}  // namespace
}  // namespace delassus::tests::tree_test
