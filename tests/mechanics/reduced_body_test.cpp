// SPDX-License-Identifier: BSD-3-Clause
// Elastic bodies of few modes: derivatives, frequencies and deflections against the whole mesh, and rigid motion.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"
#include "delassus/registry.hpp"
#include "delassus/step_solver.hpp"
#include "delassus/timestepper.hpp"
#include "support/system_derivatives.hpp"

#ifdef DELASSUS_HAS_SPECTRA

namespace delassus::reduced_body_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double length = 1.0, depth = 0.1, width = 0.08;

/// A bar along x from the origin.
ElasticBlock bar(std::array<std::int32_t, 3> cells = {6, 1, 1}, double poisson = 0.3) {
    ElasticBlock block;
    block.name = "bar";
    block.corner = {0.0, -0.5 * width, -0.5 * depth};
    block.edges = {length, width, depth};
    block.cells = cells;
    block.material.young = 1e9;
    block.material.poisson = poisson;
    block.material.density = 1000.0;
    return block;
}

BodyParameters rigid(const std::string& name, const Vector3& position) {
    BodyParameters body;
    body.name = name;
    body.mass = 0.5;
    body.inertia = {0.003, 0.004, 0.005, 0.0002, -0.0003, 0.0001};
    body.pose.position = position;
    return body;
}

std::vector<std::int32_t> nodes_at(const MultibodySystem& system, std::int32_t first, double x) {
    return system.nodes_in(first, system.node_count() - first, {{x - 1e-9, -9.0, -9.0}, {x + 1e-9, 9.0, 9.0}});
}

std::int32_t add(MultibodySystem& system, const ElasticBlock& block, std::int32_t modes) {
    return modes < 0 ? system.add_elastic_block(block) : system.add_reduced_body({block, modes});
}

MatrixXd matrix(const MultibodySystem& system, std::int32_t rows, auto&& fill) {
    MatrixAssembler assembler;
    assembler.begin(rows, system.n());
    fill(assembler);
    return tests::dense(assembler.finish());
}
MatrixXd mass_of(const MultibodySystem& system, const State& state) {
    return matrix(system, system.n(), [&](auto& H) { system.add_mass(state, 1.0, H); });
}
MatrixXd stiffness_of(const MultibodySystem& system, const State& state) {
    return matrix(system, system.n(), [&](auto& H) { system.add_stiffness(state, 1.0, Tangent::Exact, H); });
}

/// A basis of the velocities that the rows allow.
MatrixXd allowed(const MultibodySystem& system) {
    if (system.m() == 0) return MatrixXd::Identity(system.n(), system.n());
    const MatrixXd D =
        matrix(system, system.m(), [&](auto& H) { system.add_constraint_jacobian(system.initial_state(), 0, H); });
    const Eigen::FullPivLU<MatrixXd> lu(D);
    EXPECT_EQ(lu.rank(), system.m());
    return lu.kernel();
}

/// ω² of small vibrations about the start, ascending.
VectorXd squares_of(const MultibodySystem& system) {
    const State start = system.initial_state();
    const MatrixXd Z = allowed(system);
    const MatrixXd K = stiffness_of(system, start);
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(Z.transpose() * (0.5 * (K + K.transpose())) * Z,
                                                                    Z.transpose() * mass_of(system, start) * Z,
                                                                    Eigen::EigenvaluesOnly | Eigen::Ax_lBx);
    return solver.eigenvalues();
}

// ---- Derivatives ----

struct Tumbling {
    MultibodySystem system;
    Tumbling() {
        BodyParameters free = rigid("free", {-0.1, 0.0, 0.05}), driven = rigid("driven", {1.1, 0.0, 0.0});
        free.pose.orientation = {0.8, 0.2, -0.4, 0.3};
        BodyMotion motion;
        motion.translation = {Motion::sine(0.2, 0.7), {}, Motion::linear(0.0, 0.4)};
        motion.angle = Motion::sine(0.5, 0.3);
        driven.motion = motion;
        const auto a = system.add_body(free), b = system.add_body(driven);
        ElasticBlock block = bar({2, 1, 1});
        block.material.young = 1e3;
        block.material.damping_time = 0.02;
        block.material.damping_rate = 0.7;
        block.velocity = {0.2, -0.3, 0.1};
        block.angular_velocity = {0.4, 0.5, -0.6};
        const auto first = system.add_reduced_body({block, 3});
        system.add_attachment({"left", nodes_at(system, first, 0.0), a});
        system.add_attachment({"right", nodes_at(system, first, length), b});
        system.add_attachment({"point", {first + 22}, a});
        LoadParameters load;
        load.name = "load";
        load.nodes = {{first + 13, 0.7}, {first + 20, 0.5}};
        load.force = {Motion::constant(3.0), Motion::sine(1.0, 0.3), {}};
        system.add_load(load);
        system.finish();
    }
    [[nodiscard]] State displaced(double amplitude = 0.1) const {
        State state = system.initial_state();
        state.t = 0.3;
        VectorXd delta(system.n());
        for (int i = 0; i < delta.size(); ++i) delta[i] = amplitude * std::sin(1.0 + 3.0 * i);
        system.increment(state.q.data(), delta.data(), state.q.data());
        for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] += 0.3 * std::cos(2.0 + static_cast<double>(i));
        return state;
    }
};

TEST(ReducedBody, HasTheDerivativesItClaims) {
    const Tumbling one;
    const auto& body = one.system.reduced_bodies().at(0);
    EXPECT_EQ(body.frequencies.size(), 6U + 3U + 3U + 2U) << "an interface, vibrations, a single node, a load";
    EXPECT_EQ(one.system.m(), 15);
    EXPECT_EQ(one.system.constraint_blocks(), (std::vector<std::int32_t>{3, 3, 3, 3, 3}));
    VectorXd lambda(one.system.m()), delta(one.system.n());
    for (int i = 0; i < lambda.size(); ++i) lambda[i] = 1.5 * std::cos(0.5 + i);
    for (int i = 0; i < delta.size(); ++i) delta[i] = 0.2 * std::cos(0.3 + i);
    const State state = one.displaced();
    tests::expect_derivatives(one.system, state, lambda, 1e-7, true);
    tests::expect_group(one.system, state, delta);
}

TEST(ReducedBody, HasTheInertialStiffnessItClaims) {
    const Tumbling one;
    const State state = one.displaced();
    VectorXd acceleration(one.system.n());
    for (int i = 0; i < acceleration.size(); ++i) acceleration[i] = std::cos(1.0 + 2.0 * i);
    const MatrixXd K = matrix(one.system, one.system.n(), [&](auto& H) {
        one.system.add_inertial_stiffness(state, acceleration.data(), 1.0, Tangent::Exact, H);
    });
    const auto product = [&](const State& at) {
        VectorXd result = VectorXd::Zero(one.system.n());
        one.system.multiply_mass(at, 1.0, acceleration.data(), result.data());
        return result;
    };
    tests::expect_near(K, tests::along_positions(one.system, state, product), 1e-7, "inertial stiffness");
    EXPECT_GT(K.norm(), 1.0);
}

TEST(ReducedBody, HasTheEnergyAndMomentumOfItsNodes) {
    MultibodySystem mesh, system;
    ElasticBlock block = bar({2, 1, 1});
    mesh.add_elastic_block(block);
    mesh.finish();
    const VectorXd mass = mass_of(mesh, mesh.initial_state()).diagonal();
    system.add_reduced_body({block, 6});
    system.finish();
    State state = system.initial_state();
    for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] = std::cos(2.0 + static_cast<double>(i));
    VectorXd delta(system.n());
    for (int i = 0; i < delta.size(); ++i) delta[i] = 0.3 * std::sin(1.0 + 3.0 * i);
    system.increment(state.q.data(), delta.data(), state.q.data());
    double energy = 0.0;
    Eigen::Vector3d linear(0.0, 0.0, 0.0), angular(0.0, 0.0, 0.0);
    for (std::int32_t node = 0; node < system.node_count(); ++node) {
        const auto position = system.node_position(state, node), velocity = system.node_velocity(state, node);
        const Eigen::Map<const Eigen::Vector3d> x(position.data()), v(velocity.data());
        energy += 0.5 * mass[3 * node] * v.squaredNorm();
        linear += mass[3 * node] * v;
        angular += mass[3 * node] * x.cross(v);
        // The velocity is that of the position.
        const VectorXd step = 1e-6 * Eigen::Map<const VectorXd>(state.v.data(), system.n());
        const auto ahead = system.node_position(tests::moved(system, state, step), node),
                   behind = system.node_position(tests::moved(system, state, -step), node);
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR((ahead[i] - behind[i]) / 2e-6, velocity[i], 1e-8);
    }
    EXPECT_NEAR(system.kinetic_energy(state), energy, 1e-12 * energy);
    const auto momentum = system.momentum(state);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(momentum[0][i], linear[static_cast<Eigen::Index>(i)], 1e-11);
        EXPECT_NEAR(momentum[1][i], angular[static_cast<Eigen::Index>(i)], 1e-11);
    }
}

// ---- Vibrations and deflections ----

/// Relative errors of ω against those of the whole mesh. held: the root by the world. tip: a small weight there, and at
/// the root where it is not held.
std::vector<double> errors(std::int32_t modes, bool held, bool tip, std::size_t count) {
    const auto squares = [&](std::int32_t kept) {
        MultibodySystem system;
        system.set_gravity({0.0, 0.0, 0.0});
        const auto first = add(system, bar(), kept);
        if (held) system.add_attachment({"root", nodes_at(system, first, 0.0), world_body});
        const auto weigh = [&](const std::string& name, double x) {
            BodyParameters weight = rigid(name, {x, 0.0, 0.0});
            weight.mass = 1e-3;
            weight.inertia = {1e-6, 1e-6, 1e-6};
            system.add_attachment({name, nodes_at(system, first, x), system.add_body(weight)});
        };
        if (tip) weigh("tip", length);
        if (tip && !held) weigh("root", 0.0);
        system.finish();
        return squares_of(system);
    };
    const Eigen::Index rigid_motions = held ? 0 : 6;
    const VectorXd reduced = squares(modes), whole = squares(-1);
    std::vector<double> result;
    for (Eigen::Index i = rigid_motions; i < rigid_motions + static_cast<Eigen::Index>(count); ++i)
        result.push_back(std::sqrt(reduced[i] / whole[i]) - 1.0);
    return result;
}

TEST(ReducedBody, FrequenciesConvergeFromAboveToThoseOfTheMesh) {
    for (const bool held : {true, false}) {
        std::vector<double> before(6, 1e9);
        for (const std::int32_t modes : {4, 10, 20}) {
            const auto error = errors(modes, held, true, 6);
            for (std::size_t i = 0; i < 6; ++i) {
                EXPECT_GT(error[i], -1e-8) << modes << " " << i;
                EXPECT_LT(error[i], before[i] + 1e-8) << modes << " " << i;
            }
            before = error;
            RecordProperty((held ? "held, " : "free, ") + std::to_string(modes) + " vibrations",
                           testing::PrintToString(error));
        }
        for (const double error : before) EXPECT_LT(error, 1e-3);
    }
}

// With one interface and with none the vibrations that are kept are those of the mesh.
TEST(ReducedBody, KeptVibrationsAreExact) {
    for (const bool held : {true, false})
        for (const double error : errors(6, held, false, 6)) EXPECT_NEAR(error, 0.0, 1e-8);
}

// A cube has pairs and triples of equal frequencies.
TEST(ReducedBody, RepeatedFrequenciesAreAllFound) {
    ElasticBlock cube = bar({2, 2, 2});
    cube.edges = {length, length, length};
    MultibodySystem mesh, system;
    mesh.add_elastic_block(cube);
    mesh.finish();
    const VectorXd whole = squares_of(mesh);
    system.add_reduced_body({cube, 20});
    system.finish();
    const auto& frequencies = system.reduced_bodies().at(0).frequencies;
    EXPECT_NEAR(frequencies[1] / frequencies[0], 1.0, 1e-9);
    for (std::size_t i = 0; i < frequencies.size(); ++i)
        EXPECT_NEAR(2.0 * std::numbers::pi * frequencies[i] / std::sqrt(whole[static_cast<Eigen::Index>(i) + 6]), 1.0,
                    1e-9);
}

TEST(ReducedBody, VibratesAsABeam) {
    MultibodySystem system;
    system.add_reduced_body({bar({10, 1, 1}, 0.0), 8});
    system.finish();
    const auto& frequencies = system.reduced_bodies().at(0).frequencies;
    // Free beam of Euler and Bernoulli, β L = 4.7300; shear and rotary inertia lower it by a few per cent.
    for (const auto& [mode, thickness] : {std::pair{0U, width}, {1U, depth}}) {
        const double beam = 4.7300 * 4.7300 * std::sqrt(1e9 / 1000.0 * thickness * thickness / 12.0) /
                            (2.0 * std::numbers::pi * length * length);
        EXPECT_LT(frequencies[mode], beam);
        EXPECT_NEAR(frequencies[mode] / beam, 1.0, 0.05);
    }
}

/// Where the tip goes under a force and a torque, to first order.
VectorXd deflection(std::int32_t modes) {
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    const auto first = add(system, bar(), modes);
    system.add_attachment({"root", nodes_at(system, first, 0.0), world_body});
    const auto tip = system.add_body(rigid("tip", {length + 0.02, 0.01, 0.0}));
    system.add_attachment({"tip", nodes_at(system, first, length), tip});
    LoadParameters load;
    load.name = "load";
    load.body = tip;
    load.force = {Motion::constant(20.0), Motion::constant(-3.0), Motion::constant(5.0)};
    load.torque = {Motion::constant(1.0), Motion::constant(0.3), Motion::constant(-0.4)};
    load.point = {length + 0.02, 0.01, 0.0};
    system.add_load(load);
    system.finish();
    VectorXd f = VectorXd::Zero(system.n());
    system.add_force(system.initial_state(), 1.0, f.data());
    const MatrixXd Z = allowed(system), K = stiffness_of(system, system.initial_state());
    const VectorXd x = Z * (Z.transpose() * K * Z).partialPivLu().solve(Z.transpose() * f);
    return x.segment<6>(system.body_column(tip));
}

TEST(ReducedBody, StaticDeflectionsAtInterfacesAreExact) {
    const VectorXd whole = deflection(-1);
    for (const std::int32_t modes : {0, 4}) {
        const VectorXd reduced = deflection(modes);
        RecordProperty("error with " + std::to_string(modes) + " vibrations",
                       testing::PrintToString((reduced - whole).norm() / whole.norm()));
        EXPECT_LE((reduced - whole).norm(), 1e-9 * whole.norm());
    }
}

/// Where the middle goes under a load on its nodes while both ends are held.
Vector3 sag(std::int32_t modes) {
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    const auto first = add(system, bar(), modes);
    system.add_attachment({"left", nodes_at(system, first, 0.0), world_body});
    system.add_attachment({"right", nodes_at(system, first, length), world_body});
    const auto middle = nodes_at(system, first, 0.5 * length);
    LoadParameters load;
    load.name = "load";
    for (const auto node : middle) load.nodes.push_back({node, 1.0 / static_cast<double>(middle.size())});
    load.force = {Motion::constant(1.0), Motion::constant(2.0), Motion::constant(-3.0)};
    system.add_load(load);
    system.finish();
    VectorXd f = VectorXd::Zero(system.n());
    State state = system.initial_state();
    system.add_force(state, 1.0, f.data());
    const MatrixXd Z = allowed(system), K = stiffness_of(system, state);
    const VectorXd x = Z * (Z.transpose() * K * Z).partialPivLu().solve(Z.transpose() * f);
    const Vector3 before = system.node_position(state, middle[0]);
    const Vector3 after = system.node_position(tests::moved(system, state, x), middle[0]);
    return {after[0] - before[0], after[1] - before[1], after[2] - before[2]};
}

TEST(ReducedBody, StaticDeflectionsUnderLoadsOnNodesAreExact) {
    const Vector3 whole = sag(-1), reduced = sag(2);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(reduced[i] / whole[i], 1.0, 1e-7);
}

// ---- Motion ----

void run(MultibodySystem& system, State& state, const std::string& method, double h, int steps) {
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper(method, system, {});
    for (int step = 0; step < steps; ++step) stepper->step(state, h, solver);
}

TEST(ReducedBody, FreeMotionConservesMomentaAndEnergy) {
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    ElasticBlock block = bar({4, 1, 1});
    block.velocity = {1.0, -2.0, 0.5};
    block.angular_velocity = {30.0, 20.0, -10.0};
    system.add_reduced_body({block, 6});
    system.finish();
    State state = system.initial_state();
    state.v.back() += 0.3;  // a mode swings
    const auto before = system.momentum(state);
    const double energy = system.energy(state);
    run(system, state, "rk4", 1e-5, 10000);
    const auto after = system.momentum(state);
    for (std::size_t part = 0; part < 2; ++part)
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(after[part][i], before[part][i], 1e-9) << part << i;
    RecordProperty("energy", testing::PrintToString(system.energy(state) / energy - 1.0));
    EXPECT_NEAR(system.energy(state), energy, 1e-9 * energy);
    double strain = 0.0;
    for (std::size_t i = state.q.size() - 6; i < state.q.size(); ++i) strain += std::abs(state.q[i]);
    EXPECT_GT(strain, 1e-4) << "nothing has swung";
}

// A rod that spins about its middle: E u'' + ρ ω² (x + u) = 0 with free ends, u = sin(β x)/(β cos(β L/2)) − x with
// β² = ρ ω²/E, so that its end moves by tan(β L/2)/β − L/2.
TEST(ReducedBody, ASpinningRodStretches) {
    const double omega = 600.0, beta = omega * std::sqrt(1000.0 / 1e9);
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    ElasticBlock block = bar({16, 1, 1}, 0.0);
    const auto first = system.add_reduced_body({block, 60});
    system.finish();
    State state = system.initial_state();
    const auto column = static_cast<std::size_t>(system.reduced_bodies()[0].column);
    const auto modes = static_cast<Eigen::Index>(system.reduced_bodies()[0].frequencies.size());
    state.v[column + 5] = omega;
    for (int i = 0; i < 3; ++i) {  // linear in s
        VectorXd f = VectorXd::Zero(system.n());
        system.add_force(state, 1.0, f.data());
        const MatrixXd K = stiffness_of(system, state).bottomRightCorner(modes, modes);
        Eigen::Map<VectorXd>(state.q.data() + column + 7, modes) += K.partialPivLu().solve(f.tail(modes));
    }
    const auto tip = nodes_at(system, first, length);
    double x = 0.0;
    for (const auto node : tip) x += system.node_position(state, node)[0] / static_cast<double>(tip.size());
    const double stretch = x - length, expected = std::tan(0.5 * beta * length) / beta - 0.5 * length;
    RecordProperty("stretch", testing::PrintToString(stretch / expected));
    EXPECT_NEAR(stretch / expected, 1.0, 0.012);  // the mesh, with one brick over the section
    // It goes on like that.
    run(system, state, "generalized_alpha", 1e-4, 50);
    double later = 0.0;
    for (const auto node : tip) {
        const auto at = system.node_position(state, node);
        later += std::hypot(at[0] - 0.5 * length, at[1]) / static_cast<double>(tip.size());
    }
    double now = 0.0;
    for (const auto node : tip) {
        const auto at = system.node_position(system.initial_state(), node);
        now += std::hypot(at[0] - 0.5 * length, at[1]) / static_cast<double>(tip.size());
    }
    EXPECT_NEAR((later - now) / stretch, 1.0, 0.02);
}

/// The end of an arm on a hinge that falls, and of one whose mesh is whole.
Vector3 fallen(std::int32_t modes, const std::string& method, double h, int steps, double young = 2e7) {
    MultibodySystem system;
    const auto hub = system.add_body(rigid("hub", {0.0, 0.0, 0.0}));
    const auto weight = system.add_body(rigid("weight", {length, 0.0, 0.0}));
    JointParameters hinge;
    hinge.name = "hinge";
    hinge.kind = JointKind::Revolute;
    hinge.second = hub;
    hinge.axis = {0.0, 1.0, 0.0};
    system.add_joint(hinge);
    ElasticBlock block = bar({4, 1, 1});
    block.material.young = young;
    const auto first = add(system, block, modes);
    system.add_attachment({"root", nodes_at(system, first, 0.0), hub});
    system.add_attachment({"tip", nodes_at(system, first, length), weight});
    system.finish();
    system.assemble();
    State state = system.initial_state();
    run(system, state, method, h, steps);
    return system.pose(state, weight).position;
}

// What is left is of second order in the deflection.
TEST(ReducedBody, AFallingArmIsThatOfTheMesh) {
    for (const auto& [young, most] : {std::pair{2e7, 5e-4}, {2e8, 2e-5}}) {
        const Vector3 whole = fallen(-1, "generalized_alpha", 2e-3, 150, young);
        const Vector3 reduced = fallen(8, "generalized_alpha", 2e-3, 150, young);
        RecordProperty("difference " + std::to_string(young),
                       testing::PrintToString(std::hypot(reduced[0] - whole[0], reduced[2] - whole[2])));
        EXPECT_LT(whole[2], -0.3);
        for (const std::size_t i : {0U, 1U, 2U}) EXPECT_NEAR(reduced[i], whole[i], most);
    }
}

TEST(ReducedBody, EveryTimestepperTakesIt) {
    const Vector3 reference = fallen(3, "trapezoidal", 5e-4, 100);
    for (const char* method :
         {"euler_implicit_linearized", "euler_implicit", "trapezoidal_linearized", "newmark", "hht",
          "generalized_alpha", "linearly_implicit_trapezoidal", "moreau_jean", "nonsmooth_generalized_alpha"}) {
        const Vector3 end = fallen(3, method, 5e-4, 100);
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(end[i], reference[i], 2e-3) << method;
    }
    for (const char* method : {"rk4", "dormand_prince"}) {
        const Vector3 end = fallen(3, method, 2e-5, 2500);
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(end[i], reference[i], 2e-4) << method;
    }
}

// A hub that turns at the start takes the arm along as a rigid body.
TEST(ReducedBody, StartsWithTheBodiesThatHoldIt) {
    MultibodySystem system;
    BodyParameters hub = rigid("hub", {0.0, 0.0, 0.0});
    hub.velocity = {0.1, 0.2, -0.3};
    hub.angular_velocity = {0.5, 2.0, -1.0};
    const auto body = system.add_body(hub);
    const auto first = system.add_reduced_body({bar(), 4});
    system.add_attachment({"root", nodes_at(system, first, 0.0), body});
    system.finish();
    system.assemble();
    const State start = system.initial_state();
    for (const auto node : nodes_at(system, first, length)) {
        const auto x = system.node_position(start, node), v = system.node_velocity(start, node);
        const Eigen::Vector3d expected =
            Eigen::Vector3d(0.1, 0.2, -0.3) + Eigen::Vector3d(0.5, 2.0, -1.0).cross(Eigen::Vector3d(x[0], x[1], x[2]));
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(v[i], expected[static_cast<Eigen::Index>(i)], 1e-12);
    }
}

#ifdef DELASSUS_HAS_FCL
// Rows of contacts are the velocities of the nodes that touch, along the normal and across it.
TEST(ReducedBody, ContactRowsAreTheVelocitiesOfItsNodes) {
    MultibodySystem system;
    BodyParameters ground = rigid("ground", {0.0, 0.0, 0.0});
    ground.fixed = true;
    Shape plane;
    plane.kind = ShapeKind::Plane;
    plane.body = system.add_body(ground);
    const auto material = system.add_material({0.4, 0.0});
    system.add_shape(plane, material);
    ElasticBlock block = bar({2, 1, 1});
    block.corner[2] = 0.01;
    block.contact_radius = 0.01;
    block.contact_material = material;
    system.add_reduced_body({block, 5});
    system.finish();
    State state = system.initial_state();
    for (std::size_t i = 0; i < state.v.size(); ++i) state.v[i] = 0.01 * std::cos(2.0 + static_cast<double>(i));
    UnilateralRows rows;
    system.collect_unilateral(state, 1e-3, rows);
    ASSERT_EQ(rows.contacts().size(), 15U) << "the nodes of the face below";
    for (std::size_t k = 0; k < rows.contacts().size(); ++k) {
        const auto& contact = rows.contacts()[k];
        const auto owners = system.contact_bodies(contact);
        const bool node_is_second = owners[1] >= system.body_count();
        const auto node = owners[node_is_second ? 1 : 0] - system.body_count();
        const Vector3 v = system.node_velocity(state, node);
        const double along = v[0] * contact.normal[0] + v[1] * contact.normal[1] + v[2] * contact.normal[2];
        EXPECT_NEAR(rows.speed(3 * k, state.v.data()), node_is_second ? along : -along, 1e-14);
        const double across = std::hypot(rows.speed(3 * k + 1, state.v.data()), rows.speed(3 * k + 2, state.v.data()));
        EXPECT_NEAR(across, std::hypot(v[0], v[1]), 1e-14);
    }
}
#endif

std::string refusal(auto&& build) {
    MultibodySystem system;
    try {
        build(system);
        system.finish();
    } catch (const InputError& error) {
        return error.what();
    }
    return "taken";
}

TEST(ReducedBody, WhatCannotBeIsRefusedInOneSentence) {
    EXPECT_EQ(refusal([](auto& system) { system.add_reduced_body({bar(), 4}); }), "taken");
    EXPECT_EQ(refusal([](auto& system) {
                  system.add_reduced_body({bar(), -1});
              }),
              "the modes of the elastic body \"bar\" are -1; their number must not be negative");
    EXPECT_EQ(refusal([](auto& system) {
                  system.add_reduced_body({bar(), 0});
              }),
              "the elastic body \"bar\" cannot be reduced to modes: no mode is left of it; keep at least one");
    EXPECT_EQ(
        refusal([](auto& system) {
            system.add_reduced_body({bar({1, 1, 1}), 100});
        }),
        "the elastic body \"bar\" cannot be reduced to modes: 100 normal modes are too many for the 81 freedoms of "
        "its nodes that are not held; up to 34 can be kept");
    EXPECT_EQ(
        refusal([](auto& system) {
            const auto first = system.add_reduced_body({bar(), 4});
            system.add_attachment({"edge", {first, first + 1, first + 2}, world_body});
        }),
        "the elastic body \"bar\" cannot be reduced to modes: the 3 nodes of one of its interfaces lie on a line, "
        "which holds no turn about it; take a single node, or three that make a triangle");
    EXPECT_EQ(refusal([](auto& system) {
                  const auto first = system.add_reduced_body({bar(), 4});
                  CableParameters cable;
                  cable.name = "rope";
                  cable.nodes = {first, first + 1};
                  system.add_cable(cable);
              }),
              "the cable \"rope\" names a node of \"bar\", which is reduced to modes: its nodes take no element and "
              "no cable");
    EXPECT_EQ(refusal([](auto& system) {
                  const auto first = system.add_reduced_body({bar(), 4});
                  system.add_attachment({"one", nodes_at(system, first, 0.0), world_body});
                  system.add_attachment({"two", {first}, world_body});
              }),
              "the attachment \"two\" holds a node that is fixed or attached already");
    EXPECT_NE(refusal([](auto& system) {
                  ElasticMeshParameters mesh;
                  mesh.name = "two";
                  mesh.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1},
                                        {5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {5, 0, 1}};
                  mesh.mesh.tetrahedra = {{0, 1, 2, 3}, {4, 5, 6, 7}};
                  system.add_reduced_body({mesh, 2});
              }).find("its mesh falls into 2 parts that do not hang together"),
              std::string::npos);
}

}  // namespace
}  // namespace delassus::reduced_body_test

#endif
