// SPDX-License-Identifier: BSD-3-Clause
// Beams against the theory of Euler, Bernoulli and Timoshenko, and against the elastica.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <string>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"
#include "support/system_derivatives.hpp"

namespace delassus::beam_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::dense;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double young = 2e11, density = 7800.0;

/// Along x, clamped at the origin; bending is much softer than stretching. E I_y = 2 E I_z.
ElasticBeamParameters cantilever(int elements, double length = 1.0) {
    ElasticBeamParameters beam;
    beam.name = "beam";
    beam.to = {length, 0.0, 0.0};
    beam.elements = elements;
    beam.section_y = {0.0, 1.0, 0.0};
    beam.section = {1e-4, 2e-10, 1e-10, 1.5e-10, infinite, infinite};
    beam.material = {young, 0.3, density, 0.0};
    beam.fixed_from = true;
    return beam;
}

void load_tip(MultibodySystem& system, const Vector3& force, const Vector3& torque) {
    LoadParameters load;
    load.name = "tip";
    load.body = system.body_count() - 1;
    load.point = system.body(load.body).pose.position;
    for (std::size_t i = 0; i < 3; ++i) {
        load.force[i] = Motion::linear(0.0, force[i]);
        load.torque[i] = Motion::linear(0.0, torque[i]);
    }
    system.add_load(load);
}

MatrixXd matrix_of(const MultibodySystem& system, auto&& add) {
    MatrixAssembler assembler;
    assembler.begin(system.n(), system.n());
    add(assembler);
    return dense(assembler.finish());
}

/// Rest under loads that grow with t from 0 to 1, by Newton's method with the exact tangent.
State rest(const MultibodySystem& system, int load_steps) {
    State state = system.initial_state();
    for (int step = 1; step <= load_steps; ++step) {
        state.t = static_cast<double>(step) / load_steps;
        double change = 1.0;
        for (int iteration = 0; iteration < 30 && change > 1e-11; ++iteration) {
            VectorXd force = VectorXd::Zero(system.n());
            system.add_force(state, 1.0, force.data());
            const MatrixXd K = matrix_of(system, [&](auto& H) { system.add_stiffness(state, 1.0, Tangent::Exact, H); });
            const VectorXd delta = K.partialPivLu().solve(force);
            change = delta.cwiseAbs().maxCoeff();
            system.increment(state.q.data(), delta.data(), state.q.data());
        }
        EXPECT_LE(change, 1e-11) << "Newton's method did not converge at the load " << state.t;
    }
    return state;
}

State rest_under(const ElasticBeamParameters& beam, const Vector3& force, const Vector3& torque, int load_steps,
                 Pose& tip) {
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    system.add_elastic_beam(beam);
    load_tip(system, force, torque);
    system.finish();
    State state = rest(system, load_steps);
    tip = system.pose(state, system.body_count() - 1);
    return state;
}

TEST(Beam, HasTheStiffnessAndDampingItClaims) {
    const auto tumbling = [](const std::string& name, const Vector3& position, const Quaternion& orientation) {
        BodyParameters body;
        body.name = name;
        body.mass = 2.0;
        body.inertia = {0.3, 0.4, 0.5, 0.02, -0.03, 0.01};
        body.pose = {position, orientation};
        body.velocity = {0.3, -0.2, 0.5};
        body.angular_velocity = {0.7, -1.1, 0.4};
        return body;
    };
    for (const double damping_time : {0.0, 0.1})
        for (const double amount : {0.0, 1e-3, 0.05, 0.3, 1.0}) {
            MultibodySystem system;
            BeamParameters beam;
            beam.first = system.add_body(tumbling("a", {0.0, 0.1, 0.2}, {0.8, 0.2, -0.4, 0.3}));
            beam.second = system.add_body(tumbling("b", {1.0, -0.3, 0.4}, {0.1, -0.5, 0.4, 0.7}));
            beam.first_point = {0.2, 0.2, 0.1};
            beam.second_point = {0.8, -0.4, 0.6};
            beam.section_y = {0.1, 1.0, 0.3};
            beam.section = {0.7, 0.3, 0.5, 0.6, 1.1, infinite};
            beam.material = {30.0, 0.3, 1000.0, damping_time};
            system.add_beam(beam);
            beam.first = world_body;
            system.add_beam(beam);
            system.finish();
            State state = system.initial_state();
            VectorXd delta(system.n());
            for (int i = 0; i < delta.size(); ++i) delta[i] = amount * std::sin(1.0 + 3.0 * i);
            system.increment(state.q.data(), delta.data(), state.q.data());
            tests::expect_derivatives(system, state, VectorXd());
        }
}

TEST(Beam, ForceIsTheDerivativeOfTheEnergy) {
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    auto beam = cantilever(3);
    beam.section = {1.0, 0.3, 0.5, 0.6, 2.0, 3.0};
    beam.material = {30.0, 0.3, 1.0, 0.0};
    system.add_elastic_beam(beam);
    system.finish();
    State state = system.initial_state();
    VectorXd delta(system.n()), force = VectorXd::Zero(system.n());
    for (int i = 0; i < delta.size(); ++i) delta[i] = 0.4 * std::sin(1.0 + 3.0 * i);
    system.increment(state.q.data(), delta.data(), state.q.data());
    system.add_force(state, 1.0, force.data());
    const auto energy = [&](const State& at) { return VectorXd::Constant(1, system.energy(at)); };
    tests::expect_near(force.transpose(), -tests::along_positions(system, state, energy), 1e-8, "−dV");
}

TEST(Beam, DoesNotFeelRigidMotion) {
    // Turned by 120° about (1, 1, 1), which takes (x, y, z) to (z, x, y), then moved; it spins about its end as before.
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    auto beam = cantilever(4);
    beam.fixed_from = false;
    beam.material.damping_time = 0.1;
    beam.angular_velocity = {0.3, -2.0, 1.0};
    system.add_elastic_beam(beam);
    system.finish();
    State state = system.initial_state();
    const Eigen::Quaterniond turn(0.5, 0.5, 0.5, 0.5);
    for (std::size_t k = 0; k < 5; ++k) {
        Eigen::Map<Eigen::Vector3d> x(state.q.data() + 7 * k), v(state.v.data() + 6 * k);
        x = (turn * x + Eigen::Vector3d(3.0, -5.0, 2.0)).eval();
        v = (turn * v).eval();
        const double* q = state.q.data() + 7 * k + 3;
        const Eigen::Quaterniond turned = turn * Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
        state.q[7 * k + 3] = turned.w();
        for (int i = 0; i < 3; ++i) state.q[7 * k + 4 + static_cast<std::size_t>(i)] = turned.vec()[i];
    }
    VectorXd force = VectorXd::Zero(system.n());
    system.add_force(state, 1.0, force.data());
    // Forces of a displacement by the rounding of a position, 1e-15 m.
    const double rounding = 1e-15 * young * beam.section.area * 4.0;
    for (std::size_t k = 0; k < 5; ++k) {
        EXPECT_LE(force.segment<3>(6 * static_cast<Eigen::Index>(k)).cwiseAbs().maxCoeff(), 10.0 * rounding);
    }
    EXPECT_NEAR(system.energy(state), system.kinetic_energy(state), 1e-9);
}

TEST(Beam, SmallDeflectionsOfTheTipAreExactWithAnyNumberOfElements) {
    for (const int elements : {1, 2, 7}) {
        auto beam = cantilever(elements);
        const double bending = young * beam.section.inertia_z, force = 1e-4 * bending;
        Pose tip;
        rest_under(beam, {0.0, force, 0.0}, {}, 1, tip);
        EXPECT_NEAR(tip.position[1] / (force / (3.0 * bending)), 1.0, 1e-7);
        // About y it is twice as stiff; turning is P L²/2EI.
        rest_under(beam, {0.0, 0.0, force}, {}, 1, tip);
        EXPECT_NEAR(tip.position[2] / (force / (6.0 * bending)), 1.0, 1e-7);
        EXPECT_NEAR(2.0 * tip.orientation[2], -force / (4.0 * bending), 1e-7 * force / bending);
        // With shear: P L/(G A_y) more.
        beam.section.shear_area_y = 1e-8;
        rest_under(beam, {0.0, force, 0.0}, {}, 1, tip);
        const double shear = young / 2.6 * beam.section.shear_area_y;
        EXPECT_NEAR(tip.position[1] / (force / (3.0 * bending) + force / shear), 1.0, 1e-7);
        // Stretching and twisting.
        rest_under(cantilever(elements), {100.0, 0.0, 0.0}, {0.1, 0.0, 0.0}, 1, tip);
        EXPECT_NEAR(tip.position[0] - 1.0, 100.0 / (young * 1e-4), 1e-12);
        EXPECT_NEAR(2.0 * std::asin(tip.orientation[1]), 0.1 / (young / 2.6 * 1.5e-10), 1e-12);
    }
}

TEST(Beam, IsTheElastica) {
    // Mattiasson (Numerical results from large deflection beam and frame problems analysed by means of elliptic
    // integrals, Int. J. Numer. Meth. Engng 17, 1981): the tip of a cantilever under a dead load P across it. w and u
    // are its displacements across and towards the clamp, by L. The error falls with the square of the elements' size.
    struct Case {
        double load, w, u;  // P L²/(E I)
    };
    for (const Case& known : {Case{1.0, 0.30172, 0.05643}, Case{10.0, 0.81061, 0.55500}}) {
        const double load = known.load;
        const auto error = [&](int elements) {
            auto beam = cantilever(elements);
            beam.section.area = 1e-2;  // hardly stretches
            Pose tip;
            rest_under(beam, {0.0, load * young * beam.section.inertia_z, 0.0}, {}, 4, tip);
            return std::hypot(tip.position[1] - known.w, 1.0 - tip.position[0] - known.u);
        };
        const double coarse = error(6), fine = error(18);
        RecordProperty("load_" + std::to_string(static_cast<int>(load)),
                       std::to_string(coarse) + " with 6, " + std::to_string(fine) + " with 18 elements");
        EXPECT_LE(coarse, 4e-3) << load;
        EXPECT_LE(fine, 4e-4) << load;
        EXPECT_LE(fine, coarse / 6.0 + 1e-5) << load;
    }
}

TEST(Beam, RollsUpToACircleUnderAnEndMoment) {
    for (const int elements : {6, 20}) {
        const auto beam = cantilever(elements);
        Pose tip;
        rest_under(beam, {}, {0.0, 0.0, 2.0 * M_PI * young * beam.section.inertia_z}, 10, tip);
        for (const double x : tip.position) EXPECT_NEAR(x, 0.0, 1e-9) << elements;
        EXPECT_NEAR(std::abs(tip.orientation[0]), 1.0, 1e-9);
    }
}

/// Eigenvalues of K x = ω² M x by their square roots, ascending, 1/s.
VectorXd frequencies(const ElasticBeamParameters& beam) {
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    system.add_elastic_beam(beam);
    system.finish();
    const State state = system.initial_state();
    const MatrixXd K = matrix_of(system, [&](auto& H) { system.add_stiffness(state, 1.0, Tangent::Exact, H); });
    const MatrixXd M = matrix_of(system, [&](auto& H) { system.add_mass(state, 1.0, H); });
    tests::expect_near(K, K.transpose(), 1e-9, "K at rest is symmetric");
    return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(K, M, Eigen::EigenvaluesOnly)
        .eigenvalues()
        .cwiseMax(0.0)
        .cwiseSqrt();
}

TEST(Beam, SwingsWithTheFrequenciesOfACantilever) {
    // ω = β² √(E I/(ρ A L⁴)), cos β cosh β = −1, about z, and √2 times that about y. A slender section, so that its own
    // inertia does not matter; the lumped mass lowers ω by β/3 over the square of the number of elements.
    constexpr int elements = 30;
    auto beam = cantilever(elements);
    beam.section = {1e-4, 2e-12, 1e-12, 1e-9, infinite, infinite};
    const double unit = std::sqrt(young * beam.section.inertia_z / (density * beam.section.area));
    const VectorXd found = frequencies(beam);
    Eigen::Index k = 0;
    for (const double beta : {1.875104, 4.694091, 7.854757})
        for (const double axis : {1.0, std::sqrt(2.0)}) {
            const double ratio = found[k] / (axis * beta * beta * unit);
            RecordProperty("mode_" + std::to_string(k), std::to_string(ratio));
            EXPECT_NEAR(ratio, 1.0, 0.4 * beta / (elements * elements)) << k;
            ++k;
        }
}

TEST(Beam, TwistsAndStretchesWithTheFrequenciesOfARod) {
    // Clamped and free: ω = (π/2) c/L with c² = G J/(ρ (I_y + I_z)) or E/ρ; bending far above.
    auto beam = cantilever(20);
    beam.section = {1e-4, 1e-4, 1e-4, 1e-6, infinite, infinite};
    const VectorXd found = frequencies(beam);
    EXPECT_NEAR(found[0] / (0.5 * M_PI * std::sqrt(young / 2.6 * 1e-6 / (density * 2e-4))), 1.0, 1e-3);
    beam.section.torsion = 1.0;
    const double stretch = 0.5 * M_PI * std::sqrt(young / density);
    const VectorXd stiff = frequencies(beam);
    EXPECT_LE((stiff.array() / stretch - 1.0).abs().minCoeff(), 1e-3);
}

TEST(Beam, SectionsHaveTheirMoments) {
    const auto square = BeamSection::rectangle(0.02, 0.02);
    EXPECT_NEAR(square.area, 4e-4, 1e-18);
    EXPECT_NEAR(square.inertia_y, 0.02 * 8e-6 / 12.0, 1e-20);
    EXPECT_NEAR(square.torsion / (0.140577 * std::pow(0.02, 4)), 1.0, 5e-3);
    const auto flat = BeamSection::rectangle(0.1, 0.001);
    EXPECT_NEAR(flat.torsion / (0.1 * 1e-9 / 3.0), 1.0, 7e-3) << "a thin strip: a b³/3 (1 − 0.63 b/a)";
    EXPECT_LT(flat.inertia_y, flat.inertia_z) << "height is along z";
    const auto round = BeamSection::circle(0.01);
    EXPECT_NEAR(round.torsion, 0.5 * M_PI * 1e-8, 1e-20);
}

void expect_refused(const std::string& words, const ElasticBeamParameters& beam) {
    MultibodySystem system;
    try {
        system.add_elastic_beam(beam);
        ADD_FAILURE() << "accepted what should be refused with: " << words;
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
}

TEST(Beam, RefusesWhatIsNoBeam) {
    auto beam = cantilever(2);
    beam.to = beam.from;
    expect_refused("the ends of the beam \"beam\" coincide", beam);
    beam = cantilever(0);
    expect_refused("has 0 elements", beam);
    beam = cantilever(2);
    beam.section_y = {2.0, 0.0, 0.0};
    expect_refused("runs along the beam", beam);
    beam = cantilever(2);
    beam.section.torsion = 0.0;
    expect_refused("must be positive and finite", beam);
    beam = cantilever(2);
    beam.section.shear_area_z = -1.0;
    expect_refused("the shear areas", beam);
    beam = cantilever(2);
    beam.material.poisson = 0.5;
    expect_refused("Poisson's ratio is 0.5", beam);
}

}  // namespace
}  // namespace delassus::beam_test
