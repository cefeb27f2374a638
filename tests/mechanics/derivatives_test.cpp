// SPDX-License-Identifier: BSD-3-Clause
// Every Jacobian of a multibody system against differences, away from the configuration that its joints hold.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"
#include "support/system_derivatives.hpp"

namespace delassus::derivatives_test {
namespace {

using Eigen::VectorXd;
using tests::expect_derivatives;
using tests::expect_group;

BodyParameters tumbling(const std::string& name, const Vector3& position) {
    BodyParameters body;
    body.name = name;
    body.mass = 2.0;
    body.inertia = {0.3, 0.4, 0.5, 0.02, -0.03, 0.01};
    body.pose = {position, {0.8, 0.2, -0.4, 0.3}};
    body.velocity = {0.3, -0.2, 0.5};
    body.angular_velocity = {0.7, -1.1, 0.4};
    return body;
}

/// A displaced state: the joints do not hold there, nothing is small.
State displaced(const MultibodySystem& system) {
    State state = system.initial_state();
    state.t = 0.3;
    VectorXd delta(system.n());
    for (int i = 0; i < delta.size(); ++i) delta[i] = 0.2 * std::sin(1.0 + 3.0 * i);
    system.increment(state.q.data(), delta.data(), state.q.data());
    for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] += 0.3 * std::cos(2.0 + static_cast<double>(i));
    return state;
}

VectorXd some_lambda(const MultibodySystem& system) {
    VectorXd lambda(system.m());
    for (int i = 0; i < lambda.size(); ++i) lambda[i] = 1.5 * std::cos(0.5 + i);
    return lambda;
}

void check(MultibodySystem& system, bool less_of_symmetric = false) {
    system.finish();
    const State state = displaced(system);
    expect_derivatives(system, state, some_lambda(system), 1e-7, less_of_symmetric);
}

class JointDerivatives : public testing::TestWithParam<JointKind> {};

TEST_P(JointDerivatives, OfTwoBodies) {
    MultibodySystem system;
    const auto a = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    const auto b = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    JointParameters joint;
    joint.kind = GetParam();
    joint.first = a;
    joint.second = b;
    joint.point = {0.5, 0.2, 0.1};
    joint.second_point = {0.9, -0.2, 0.6};
    joint.axis = {1.0, 2.0, -0.5};
    joint.second_axis = {2.0, -1.0, 0.0};
    system.add_joint(joint);
    check(system);
}

TEST_P(JointDerivatives, OfABodyAndTheWorld) {
    MultibodySystem system;
    JointParameters joint;
    joint.kind = GetParam();
    joint.first = world_body;
    joint.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    joint.point = {0.5, 0.2, 0.1};
    joint.second_point = {0.9, -0.2, 0.6};
    joint.axis = {1.0, 2.0, -0.5};
    joint.second_axis = {2.0, -1.0, 0.0};
    system.add_joint(joint);
    check(system);
}

INSTANTIATE_TEST_SUITE_P(Kinds, JointDerivatives,
                         testing::Values(JointKind::Spherical, JointKind::Revolute, JointKind::Prismatic,
                                         JointKind::Cylindrical, JointKind::Universal, JointKind::Fixed,
                                         JointKind::PointOnPlane, JointKind::Distance));

TEST_P(JointDerivatives, KeepADefiniteStiffness) {
    MultibodySystem system;
    JointParameters joint;
    joint.kind = GetParam();
    joint.first = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    joint.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    joint.point = {0.5, 0.2, 0.1};
    joint.second_point = {0.9, -0.2, 0.6};
    joint.axis = {1.0, 2.0, -0.5};
    joint.second_axis = {2.0, -1.0, 0.0};
    system.add_joint(joint);
    system.finish();
    const State state = displaced(system);
    for (const double sign : {1.0, -1.0}) {
        const VectorXd lambda = sign * some_lambda(system);
        MatrixAssembler assembler;
        assembler.begin(system.n(), system.n());
        system.add_definite_constraint_stiffness(state, lambda.data(), 2.0, assembler);
        const Eigen::MatrixXd G = tests::dense(assembler.finish());
        EXPECT_LE((G - G.transpose()).norm(), 1e-13);
        EXPECT_GE(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(G).eigenvalues().minCoeff(), -1e-12);
    }
}

// A body on a ball joint, pulled along its arm: all of a stiffness is kept that is large beside the moment of inertia,
// nothing of a small one, and nothing under pressure.
TEST(DefiniteStiffness, IsTheWholeUnderAStrongPull) {
    MultibodySystem system;
    JointParameters joint;
    joint.kind = JointKind::Spherical;
    joint.second = system.add_body(tumbling("b", {0.4, -0.3, 0.5}));
    system.add_joint(joint);
    system.finish();
    const State state = system.initial_state();
    const auto n = system.n();
    for (const double pull : {3e6, 1e-2, -3e6}) {
        const VectorXd lambda = pull * Eigen::Vector3d(-0.4, 0.3, -0.5);  // towards the joint
        MatrixAssembler assembler;
        assembler.begin(n, n);
        system.add_constraint_stiffness(state, lambda.data(), -2.0, Tangent::Exact, assembler);
        const Eigen::MatrixXd whole = tests::dense(assembler.finish());
        assembler.begin(n, n);
        system.add_definite_constraint_stiffness(state, lambda.data(), 2.0, assembler);
        const Eigen::MatrixXd G = tests::dense(assembler.finish());
        EXPECT_GT(whole.norm(), 1e-3);
        if (pull > 1.0) {
            EXPECT_LE((G - whole).norm(), 1e-6 * whole.norm());
        } else {
            EXPECT_EQ(G.norm(), 0.0);
        }
    }
}

struct Sizes {
    JointKind kind;
    std::int32_t rows;
};

TEST(Joints, HoldAtTheStartWithTheirNumberOfRows) {
    for (const auto& [kind, rows] : {Sizes{JointKind::Spherical, 3},
                                     {JointKind::Revolute, 5},
                                     {JointKind::Prismatic, 5},
                                     {JointKind::Cylindrical, 4},
                                     {JointKind::Universal, 4},
                                     {JointKind::Fixed, 6},
                                     {JointKind::PointOnPlane, 1},
                                     {JointKind::Distance, 1}}) {
        MultibodySystem system;
        JointParameters joint;
        joint.kind = kind;
        joint.first = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
        joint.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
        joint.point = {0.5, 0.2, 0.1};
        joint.second_point = {0.9, -0.2, 0.6};
        system.add_joint(joint);
        system.finish();
        ASSERT_EQ(system.m(), rows);
        VectorXd C(rows);
        system.constraint(system.initial_state(), C.data());
        EXPECT_LE(C.cwiseAbs().maxCoeff(), 1e-15);
    }
}

MultibodySystem& with_joint(MultibodySystem& system, JointKind kind, std::int32_t& joint_index) {
    JointParameters joint;
    joint.kind = kind;
    joint.first = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    joint.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    joint.point = {0.5, 0.2, 0.1};
    joint.axis = {1.0, 2.0, -0.5};
    joint_index = system.add_joint(joint);
    return system;
}

TEST(Motors, OfSlidesHaveTheDerivativesTheyClaim) {
    for (const bool speed : {false, true}) {
        MultibodySystem system;
        MotorParameters motor;
        with_joint(system, JointKind::Prismatic, motor.joint);
        motor.speed = speed;
        motor.motion = Motion::sine(0.4, 0.7, 0.2, 0.1);
        system.add_motor(motor);
        EXPECT_NO_THROW(check(system));
        EXPECT_EQ(system.m(), 6);
    }
}

TEST(Motors, OfAnglesHaveTheDerivativesTheyClaimWhileTheirJointsHold) {
    for (const bool speed : {false, true}) {
        MultibodySystem system;
        MotorParameters motor;
        with_joint(system, JointKind::Revolute, motor.joint);
        motor.speed = speed;
        motor.motion = Motion::sine(0.4, 0.7, 0.2, 0.1);
        system.add_motor(motor);
        system.finish();
        // Both bodies turn alike, and the second one beside that about the axis.
        State state = system.initial_state();
        const Quaternion& q = system.body(1).pose.orientation;
        const Eigen::Vector3d axis =
            Eigen::Quaterniond(q[0], q[1], q[2], q[3]).conjugate() * Eigen::Vector3d(1.0, 2.0, -0.5).normalized();
        Eigen::Map<Eigen::Vector3d>(state.v.data() + 9) += 0.8 * axis;
        expect_derivatives(system, state, some_lambda(system));
    }
}

TEST(Gears, HaveTheDerivativesTheyClaimWhileTheirJointsHold) {
    MultibodySystem system;
    BodyParameters wheel = tumbling("first", {0.0, 0.0, 0.0});
    JointParameters joint;
    joint.kind = JointKind::Revolute;
    joint.axis = {0.3, -0.5, 1.0};
    joint.first = system.add_body(tumbling("carrier", {0.0, 0.0, -1.0}));
    joint.second = system.add_body(wheel);
    const auto one = system.add_joint(joint);
    wheel.pose.position = {2.0, 0.0, 0.0};
    joint.point = {2.0, 0.0, 0.0};
    joint.second = system.add_body(wheel);
    const auto two = system.add_joint(joint);
    JointParameters gear;
    gear.kind = JointKind::Gear;
    gear.gear_first = one;
    gear.gear_second = two;
    gear.gear_ratio = -2.0 / 3.0;
    system.add_joint(gear);
    system.finish();
    // Turn everything rigidly: the joints still hold. Rates of the wheels about their axes only.
    State state = system.initial_state();
    VectorXd lambda = VectorXd::Zero(system.m());
    lambda[system.m() - 1] = 1.3;
    for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] = 0.0;
    expect_derivatives(system, state, lambda);
}

TEST(Springs, HaveTheStiffnessAndDampingTheyClaim) {
    MultibodySystem system;
    SpringParameters spring;
    spring.first = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    spring.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    spring.first_point = {0.2, 0.4, 0.1};
    spring.second_point = {0.9, -0.1, 0.7};
    spring.stiffness = 30.0;
    spring.damping = 2.0;
    spring.rest_length = 0.4;
    system.add_spring(spring);
    spring.first = world_body;
    system.add_spring(spring);
    check(system);
}

TEST(Bushings, HaveTheStiffnessAndDampingTheyClaim) {
    MultibodySystem system;
    BushingParameters bushing;
    bushing.first = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    bushing.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    bushing.point = {0.4, 0.1, 0.3};
    bushing.stiffness = {10.0, 20.0, 30.0};
    bushing.damping = {1.0, 2.0, 3.0};
    bushing.turn_stiffness = {4.0, 5.0, 6.0};
    bushing.turn_damping = {0.4, 0.5, 0.6};
    system.add_bushing(bushing);
    check(system);
}

TEST(Loads, TurnWithNothingButTheirPoint) {
    MultibodySystem system;
    LoadParameters load;
    load.body = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    load.force = {Motion::constant(3.0), Motion::sine(1.0, 0.3), Motion::linear(1.0, 2.0)};
    load.torque = {Motion::constant(0.5), Motion(), Motion::constant(-0.7)};
    load.point = {0.3, 0.3, 0.1};
    system.add_load(load);
    check(system);
}

TEST(Loads, ThatFollowTurnWithTheirBody) {
    MultibodySystem system;
    LoadParameters load;
    load.body = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    load.force = {Motion::constant(3.0), Motion::sine(1.0, 0.3), Motion::linear(1.0, 2.0)};
    load.torque = {Motion::constant(0.5), Motion(), Motion::constant(-0.7)};
    load.point = {0.3, 0.3, 0.1};
    load.follower = true;
    system.add_load(load);
    system.finish();
    const State state = displaced(system);
    expect_derivatives(system, state, some_lambda(system), 1e-7, true);
    MatrixAssembler assembler;
    assembler.begin(system.n(), system.n());
    system.add_stiffness(state, 1.0, Tangent::Symmetric, assembler);
    EXPECT_EQ(tests::dense(assembler.finish()).norm(), 0.0);
}

/// The joint at a state where it holds: both bodies turned and moved alike, the second also by its coordinates.
State held(const MultibodySystem& system, const Eigen::Vector3d& axis, double angle, double slide) {
    State state = system.initial_state();
    state.t = 0.3;
    VectorXd delta = VectorXd::Zero(system.n());
    const Eigen::Vector3d n = axis.normalized();
    const Eigen::Vector3d point(0.5, 0.2, 0.1), centre(1.0, -0.3, 0.4);
    // The second body is turned by the angle about the axis through the point, and moved along it.
    const Eigen::AngleAxisd turn(angle, n);
    delta.segment<3>(6) = point + turn * (centre - point) + slide * n - centre;
    const Eigen::Quaterniond A(0.8, 0.2, -0.4, 0.3);
    delta.segment<3>(9) = A.normalized().conjugate() * (angle * n);
    system.increment(state.q.data(), delta.data(), state.q.data());
    return state;
}

TEST(JointForces, HaveTheStiffnessAndDampingTheyClaimWhileTheJointHolds) {
    MultibodySystem system;
    JointParameters joint;
    joint.kind = JointKind::Cylindrical;
    joint.first = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    joint.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    joint.point = {0.5, 0.2, 0.1};
    joint.axis = {1.0, 2.0, -0.5};
    joint.slide = {2.0, 30.0, 0.1, 0.0};
    joint.turn = {0.7, 20.0, 0.2, 0.0};
    system.add_joint(joint);
    system.finish();
    State state = held(system, {1.0, 2.0, -0.5}, 0.8, 0.3);
    VectorXd C(system.m());
    system.constraint(state, C.data());
    ASSERT_LE(C.norm(), 1e-14);
    // The angle is that of a joint that holds. Along increments which keep the axes parallel K is exact at rest.
    std::fill(state.v.begin(), state.v.end(), 0.0);
    const Eigen::Vector3d n = Eigen::Vector3d(1.0, 2.0, -0.5).normalized();
    const auto force = [&](const State& at) {
        VectorXd f = VectorXd::Zero(system.n());
        system.add_force(at, 1.0, f.data());
        return f;
    };
    MatrixAssembler assembler;
    assembler.begin(system.n(), system.n());
    system.add_stiffness(state, 1.0, Tangent::Exact, assembler);
    const Eigen::MatrixXd K = tests::dense(assembler.finish());
    VectorXd along = VectorXd::Zero(system.n());
    const Eigen::Vector3d axis_in_second =
        Eigen::Quaterniond(0.8, 0.2, -0.4, 0.3).normalized().conjugate() * n;  // the turn keeps it
    along.segment<3>(6) = 0.7 * n;
    along.segment<3>(9) = axis_in_second;
    const double step = 1e-6;
    const VectorXd expected =
        -(force(tests::moved(system, state, step * along)) - force(tests::moved(system, state, -step * along))) /
        (2.0 * step);
    EXPECT_LE((K * along - expected).norm(), 1e-7 * expected.norm());
    EXPECT_GT(expected.norm(), 10.0);
    // The symmetric tangent is positive semidefinite.
    assembler.begin(system.n(), system.n());
    system.add_stiffness(state, 1.0, Tangent::Symmetric, assembler);
    const Eigen::MatrixXd S = tests::dense(assembler.finish());
    EXPECT_LE((S - S.transpose()).norm(), 1e-12);
    EXPECT_GE(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(S).eigenvalues().minCoeff(), -1e-10);
}

TEST(JointForces, OfABallJointHaveTheDerivativesTheyClaim) {
    for (const bool to_world : {false, true}) {
        MultibodySystem system;
        JointParameters joint;
        joint.kind = JointKind::Spherical;
        joint.second = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
        joint.first = to_world ? world_body : system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
        joint.point = {0.5, 0.2, 0.1};
        joint.turn.damping = 1.3;
        system.add_joint(joint);
        check(system, true);
    }
}

// Everything that a kinematic body takes part in: joints, springs, bushings. Its motion is part of ∂/∂t.
TEST(KinematicBodies, AreFunctionsOfTimeInAllDerivatives) {
    for (const JointKind kind :
         {JointKind::Spherical, JointKind::Revolute, JointKind::Prismatic, JointKind::Cylindrical, JointKind::Universal,
          JointKind::Fixed, JointKind::PointOnPlane, JointKind::Distance}) {
        MultibodySystem system;
        BodyParameters kinematic = tumbling("a", {0.0, 0.1, 0.2});
        kinematic.velocity = kinematic.angular_velocity = {};
        BodyMotion& motion = kinematic.motion.emplace();
        motion.translation = {Motion::sine(0.3, 0.7), Motion(), Motion::linear(0.0, 0.4)};
        motion.angle = Motion::sine(0.8, 0.5, 0.2);
        motion.axis = {1.0, -2.0, 0.7};
        motion.point = Vector3{0.3, 0.2, -0.6};
        JointParameters joint;
        joint.kind = kind;
        joint.first = system.add_body(kinematic);
        joint.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
        joint.point = {0.5, 0.2, 0.1};
        joint.second_point = {0.9, -0.2, 0.6};
        joint.axis = {1.0, 2.0, -0.5};
        joint.second_axis = {2.0, -1.0, 0.0};
        system.add_joint(joint);
        SpringParameters spring;
        spring.first = joint.first;
        spring.second = joint.second;
        spring.first_point = {0.2, 0.4, 0.1};
        spring.second_point = {0.9, -0.1, 0.7};
        spring.stiffness = 30.0;
        spring.damping = 2.0;
        system.add_spring(spring);
        BushingParameters bushing;
        bushing.first = joint.first;
        bushing.second = joint.second;
        bushing.stiffness = bushing.damping = {1.0, 2.0, 3.0};
        bushing.turn_stiffness = bushing.turn_damping = {0.1, 0.2, 0.3};
        system.add_bushing(bushing);
        check(system);
        EXPECT_EQ(system.n(), 6);
    }
}

// The pose has the velocities that it says.
TEST(KinematicBodies, MoveWithTheirVelocities) {
    MultibodySystem system;
    BodyParameters body = tumbling("a", {0.0, 0.1, 0.2});
    body.velocity = body.angular_velocity = {};
    body.motion.emplace().translation = {Motion::sine(0.3, 0.7), Motion(), Motion::linear(0.1, 0.4)};
    body.motion->angle = Motion::polynomial({0.2, 0.5, 0.7});
    body.motion->axis = {1.0, -2.0, 0.7};
    body.motion->point = Vector3{0.3, 0.2, -0.6};
    system.add_body(body);
    system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    system.finish();
    State state = system.initial_state(), before = state, after = state;
    constexpr double step = 1e-5;
    state.t = 0.4;
    before.t = state.t - step;
    after.t = state.t + step;
    const Pose from = system.pose(before, 0), to = system.pose(after, 0);
    const auto [v, omega] = system.velocities(state, 0);
    const auto quaternion = [](const Quaternion& q) { return Eigen::Quaterniond(q[0], q[1], q[2], q[3]); };
    const Eigen::Quaterniond turn = quaternion(from.orientation).conjugate() * quaternion(to.orientation);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR((to.position[i] - from.position[i]) / (2.0 * step), v[i], 1e-8);
        EXPECT_NEAR(2.0 * turn.vec()[static_cast<Eigen::Index>(i)] / (2.0 * step), omega[i], 1e-8);
    }
}

MultibodySystem& with_nodes(MultibodySystem& system, int count) {
    const std::vector<Vector3> positions = {
        {0.0, 0.0, 0.0}, {1.0, 0.1, 0.0}, {0.0, 1.2, 0.1}, {0.1, 0.0, 0.9}, {1.0, 1.0, 1.0}};
    for (int k = 0; k < count; ++k) {
        NodeParameters node;
        node.position = positions[static_cast<std::size_t>(k)];
        node.fixed = k == 4;
        system.add_node(node);
    }
    return system;
}

TEST(Elements, HaveTheStiffnessAndDampingTheyClaim) {
    for (const ElementModel model : {ElementModel::Corotational, ElementModel::StVenantKirchhoff})
        for (const double damping_time : {0.0, 0.1}) {
            MultibodySystem system;
            with_nodes(system, 5);
            const ElasticMaterial material{100.0, 0.3, 10.0, damping_time};
            system.add_tetrahedron({0, 1, 2, 3}, material, model);
            system.add_tetrahedron({1, 2, 3, 4}, material, model);
            check(system);
        }
}

TEST(Elements, DoNotFeelRigidMotion) {
    for (const ElementModel model : {ElementModel::Corotational, ElementModel::StVenantKirchhoff}) {
        MultibodySystem system;
        with_nodes(system, 4);
        system.set_gravity({0.0, 0.0, 0.0});
        system.add_tetrahedron({0, 1, 2, 3}, {100.0, 0.3, 10.0, 0.1}, model);
        system.finish();
        State state = system.initial_state();
        // Turned by a right angle about z, moved, and spinning about z: x' = (−y, x, z) + d, v = (−y', x', 0) + e.
        for (int k = 0; k < 4; ++k) {
            const double x = state.q[3 * k], y = state.q[3 * k + 1];
            state.q[3 * k] = -y + 5.0;
            state.q[3 * k + 1] = x - 3.0;
            state.v[3 * k] = -state.q[3 * k + 1] + 2.0;
            state.v[3 * k + 1] = state.q[3 * k] + 1.0;
        }
        VectorXd f = VectorXd::Zero(12);
        system.add_force(state, 1.0, f.data());
        EXPECT_LE(f.cwiseAbs().maxCoeff(), 1e-12);
        EXPECT_NEAR(system.energy(state), system.kinetic_energy(state), 1e-12);
    }
}

TEST(Elements, RefuseToBeInverted) {
    MultibodySystem system;
    with_nodes(system, 4);
    EXPECT_THROW(system.add_tetrahedron({0, 2, 1, 3}, {}), InputError);
    EXPECT_THROW(system.add_tetrahedron({0, 1, 2, 2}, {}), InputError);
    EXPECT_THROW(system.add_tetrahedron({0, 1, 2, 9}, {}), InputError);
    EXPECT_THROW(system.add_tetrahedron({0, 1, 2, 3}, {1e6, 0.5, 1000.0, 0.0}), InputError);
}

TEST(Cables, HaveTheStiffnessAndDampingTheyClaim) {
    MultibodySystem system;
    with_nodes(system, 5);
    CableParameters cable;
    cable.young = 100.0;
    cable.area = 0.5;
    cable.damping_time = 0.2;
    for (const auto& nodes : {std::array<std::int32_t, 2>{0, 1}, {1, 2}, {2, 3}, {3, 4}}) {
        cable.nodes = nodes;
        cable.rest_length = 0.3;  // taut
        system.add_cable(cable);
        cable.rest_length = 9.0;  // slack
        system.add_cable(cable);
    }
    check(system);
}

// The matrices of a step are assembled again and again: entries stay in their places whatever their values.
TEST(Patterns, LastFromSlowToFastSpins) {
    MultibodySystem system;
    const auto a = system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    const auto b = system.add_body(tumbling("b", {1.0, -0.3, 0.4}));
    JointParameters joint;
    joint.kind = JointKind::Spherical;
    joint.first = a;
    joint.second = b;
    joint.point = {0.5, 0.2, 0.1};
    system.add_joint(joint);
    system.finish();
    MatrixAssembler H;
    for (const double speed : {0.0, 1.0, 1e4}) {
        State state = displaced(system);
        for (double& value : state.v) value *= speed;
        const VectorXd lambda = speed * some_lambda(system);
        H.begin(system.n(), system.n());
        system.add_mass(state, 1.0, H);
        system.add_gyroscopic_damping(state, 1.0, Tangent::Symmetric, H);
        system.add_constraint_stiffness(state, lambda.data(), 1.0, Tangent::Symmetric, H);
        EXPECT_GT(H.finish().entries(), 0);
    }
    EXPECT_EQ(H.patterns(), 1);
}

TEST(Group, IncrementsFromTinyToHuge) {
    MultibodySystem system;
    system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    NodeParameters node;
    node.mass = 1.0;
    system.add_node(node);
    system.finish();
    const State state = system.initial_state();
    for (const double size : {1e-9, 1e-5, 1e-3, 0.03, 0.1, 1.0, 3.0}) {
        VectorXd delta(9);
        delta << 0.3, -0.2, 0.1, 0.6 * size, -0.64 * size, 0.48 * size, 1.0, 2.0, 3.0;
        expect_group(system, state, delta);
    }
    // Beyond half a turn the increment goes on; a whole turn is none.
    VectorXd turn = VectorXd::Zero(9);
    turn.segment<3>(3) << 0.0, 200.0 * M_PI, 0.0;
    const State same = tests::moved(system, state, turn);
    for (std::size_t i = 0; i < state.q.size(); ++i) EXPECT_NEAR(std::abs(same.q[i]), std::abs(state.q[i]), 1e-12);
}

TEST(Group, QuaternionsKeepTheirLength) {
    MultibodySystem system;
    system.add_body(tumbling("a", {0.0, 0.1, 0.2}));
    system.finish();
    State state = system.initial_state();
    const std::vector<double> delta = {0.0, 0.0, 0.0, 0.013, -0.11, 0.07};
    for (int k = 0; k < 1000000; ++k) system.increment(state.q.data(), delta.data(), state.q.data());
    double square = 0.0;
    for (std::size_t i = 3; i < 7; ++i) square += state.q[i] * state.q[i];
    EXPECT_NEAR(square, 1.0, 1e-15);
}

}  // namespace
}  // namespace delassus::derivatives_test
