// SPDX-License-Identifier: BSD-3-Clause
// Nodes that bodies carry: derivatives, the start, and bending against beam theory.
#include <gtest/gtest.h>

#include <cmath>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"
#include "delassus/registry.hpp"
#include "delassus/step_solver.hpp"
#include "delassus/timestepper.hpp"
#include "support/system_derivatives.hpp"

namespace delassus::attachment_test {
namespace {

using Eigen::VectorXd;

BodyParameters tumbling(const std::string& name) {
    BodyParameters body;
    body.name = name;
    body.mass = 2.0;
    body.inertia = {0.3, 0.4, 0.5, 0.02, -0.03, 0.01};
    body.pose = {{0.1, -0.2, 0.3}, {0.8, 0.2, -0.4, 0.3}};
    body.velocity = {0.3, -0.2, 0.5};
    body.angular_velocity = {0.7, -1.1, 0.4};
    return body;
}

NodeParameters node_at(const Vector3& position) {
    NodeParameters node;
    node.name = "node";
    node.mass = 0.3;
    node.position = position;
    return node;
}

/// A bar of 0.4 m along x with the root at the origin.
ElasticBlock bar() {
    ElasticBlock block;
    block.name = "bar";
    block.corner = {0.0, -0.02, -0.02};
    block.edges = {0.4, 0.04, 0.04};
    block.cells = {6, 1, 1};
    block.material.young = 1e7;
    block.material.density = 1000.0;
    return block;
}

std::vector<std::int32_t> nodes_at_x(const MultibodySystem& system, std::int32_t first, double x) {
    return system.nodes_in(first, system.node_count() - first, {{x - 1e-9, -1.0, -1.0}, {x + 1e-9, 1.0, 1.0}});
}

TEST(Attachment, DerivativesOfAFreeAndAKinematicBody) {
    MultibodySystem system;
    const auto free = system.add_body(tumbling("free"));
    BodyParameters driven = tumbling("driven");
    BodyMotion motion;
    motion.translation = {Motion::sine(0.2, 0.7), {}, Motion::linear(0.0, 0.4)};
    motion.angle = Motion::sine(0.5, 0.3);
    driven.motion = motion;
    const auto kinematic = system.add_body(driven);
    const auto first = system.add_node(node_at({0.5, 0.1, 0.2}));
    system.add_node(node_at({-0.4, 0.3, 0.1}));
    system.add_node(node_at({0.2, 0.6, -0.3}));
    system.add_attachment({"two", {first, first + 1}, free});
    system.add_attachment({"one", {first + 2}, kinematic});
    system.finish();
    ASSERT_EQ(system.m(), 9);
    EXPECT_EQ(system.constraint_blocks(), (std::vector<std::int32_t>{3, 3, 3}));
    State state = system.initial_state();
    state.t = 0.3;
    VectorXd delta(system.n()), lambda(system.m());
    for (int i = 0; i < delta.size(); ++i) delta[i] = 0.2 * std::sin(1.0 + 3.0 * i);
    for (int i = 0; i < lambda.size(); ++i) lambda[i] = 1.5 * std::cos(0.5 + i);
    system.increment(state.q.data(), delta.data(), state.q.data());
    tests::expect_derivatives(system, state, lambda);
}

TEST(Attachment, NodesStartWithTheirBody) {
    MultibodySystem system;
    const auto body = system.add_body(tumbling("free"));
    NodeParameters given = node_at({0.5, 0.1, 0.2});
    given.velocity = {9.0, 9.0, 9.0};
    const auto node = system.add_node(given);
    system.add_attachment({"a", {node}, body});
    system.finish();
    system.assemble();
    const State start = system.initial_state();
    VectorXd rate = VectorXd::Zero(3), C(3);
    MatrixAssembler D;
    D.begin(3, system.n());
    system.add_constraint_jacobian(start, 0, D);
    rate = tests::dense(D.finish()) * Eigen::Map<const VectorXd>(start.v.data(), system.n());
    system.constraint(start, C.data());
    EXPECT_LT(rate.norm(), 1e-15);
    EXPECT_LT(C.norm(), 1e-15);
}

TEST(Attachment, ToAFixedBodyTheNodesAreFixed) {
    const auto size_of = [](bool attached) {
        MultibodySystem system;
        BodyParameters wall;
        wall.name = "wall";
        wall.fixed = true;
        const auto body = system.add_body(wall);
        ElasticBlock block = bar();
        block.fixed_faces[0] = !attached;
        const auto first = system.add_elastic_block(block);
        if (attached) system.add_attachment({"root", nodes_at_x(system, first, 0.0), body});
        system.finish();
        EXPECT_EQ(system.m(), 0);
        return system.n();
    };
    EXPECT_EQ(size_of(true), size_of(false));
}

TEST(Attachment, WhatCannotBeIsRefused) {
    MultibodySystem system;
    const auto body = system.add_body(tumbling("free"));
    NodeParameters held = node_at({1.0, 0.0, 0.0});
    held.fixed = true;
    const auto fixed = system.add_node(held), node = system.add_node(node_at({2.0, 0.0, 0.0}));
    EXPECT_THROW(system.add_attachment({"none", {}, body}), InputError);
    EXPECT_THROW(system.add_attachment({"fixed", {fixed}, body}), InputError);
    EXPECT_THROW(system.add_attachment({"no such node", {7}, body}), InputError);
    EXPECT_THROW(system.add_attachment({"no such body", {node}, 3}), InputError);
    system.add_attachment({"once", {node}, body});
    try {
        system.add_attachment({"twice", {node}, body});
        FAIL() << "it was attached twice";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("\"twice\" holds a node that is fixed or attached already"),
                  std::string::npos)
            << error.what();
    }
}

// A bar that floats with a rigid block at each end conserves both momenta, whatever it does.
TEST(Attachment, MomentaAreConserved) {
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    const auto block = [](const std::string& name, double x, const Vector3& spin) {
        BodyParameters body;
        body.name = name;
        body.mass = 0.5;
        body.inertia = Inertia::box(0.5, {0.05, 0.08, 0.1});
        body.pose.position = {x, 0.0, 0.0};
        body.angular_velocity = spin;
        return body;
    };
    const auto left = system.add_body(block("left", -0.025, {3.0, 5.0, 0.0}));
    const auto right = system.add_body(block("right", 0.425, {-2.0, 0.0, 4.0}));
    const auto first = system.add_elastic_block(bar());
    system.add_attachment({"left", nodes_at_x(system, first, 0.0), left});
    system.add_attachment({"right", nodes_at_x(system, first, 0.4), right});
    system.finish();
    system.assemble();
    State state = system.initial_state();
    const auto before = system.momentum(state);
    const double energy = system.energy(state);
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper("trapezoidal", system, {});
    for (int step = 0; step < 200; ++step) stepper->step(state, 5e-4, solver);
    const auto after = system.momentum(state);
    for (std::size_t part = 0; part < 2; ++part)
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(after[part][i], before[part][i], 2e-5) << part << i;
    EXPECT_NEAR(system.energy(state), energy, 2e-3 * energy);
    VectorXd C(system.m());
    system.constraint(state, C.data());
    EXPECT_LT(C.cwiseAbs().maxCoeff(), 1e-10);
}

}  // namespace
}  // namespace delassus::attachment_test
