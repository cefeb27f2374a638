// SPDX-License-Identifier: BSD-3-Clause
// A cantilever of tetrahedra against the theory of beams.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <string>

#include "delassus/multibody.hpp"
#include "delassus/timestepper.hpp"
#include "support/statics.hpp"

namespace delassus::cantilever_test {
namespace {

constexpr double length = 1.0, depth = 0.1, young = 1e9, density = 1000.0;
constexpr double inertia = depth * depth * depth * depth / 12.0, area = depth * depth;

/// Clamped at x = 0; Poisson's ratio zero, so that the clamp is no more than the beam theory's.
void make_cantilever(MultibodySystem& system, int across, ElementModel model, double gravity,
                     ElementOrder order = ElementOrder::Linear) {
    system.set_gravity({0.0, 0.0, -gravity});
    ElasticBlock block;
    block.edges = {length, depth, depth};
    block.cells = {10 * across, across, across};
    block.material = {young, 0.0, density, 0.0};
    block.model = model;
    block.order = order;
    block.fixed_faces[0] = true;
    system.add_elastic_block(block);
    system.finish();
}

/// Deflection of the tip at rest. A linearised implicit Euler step with h → ∞ is a step of Newton's method for f(q) =
/// 0.
double deflection(int across, ElementModel model, double gravity) {
    MultibodySystem system;
    make_cantilever(system, across, model, gravity);
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper("euler_implicit_linearized", system, {{"linearization_limit", "inf"}});
    State state = system.initial_state();
    for (int step = 0; step < 4; ++step) {
        stepper->step(state, 1e4, solver);
        std::fill(state.v.begin(), state.v.end(), 0.0);
    }
    EXPECT_EQ(solver.effort().plugin_solves, 0) << "no constraints, no solver";
    std::vector<double> force(state.v.size(), 0.0);
    system.add_force(state, 1.0, force.data());
    for (const double value : force) EXPECT_NEAR(value, 0.0, 1e-6 * density * gravity * area * length);
    return -system.node_position(state, system.node_count() - 1)[2] + depth;
}

/// The error of linear elements is of second order in their size: h and h/2 extrapolate.
double extrapolated(double coarse, double fine) {
    return (4.0 * fine - coarse) / 3.0;
}

TEST(Cantilever, BendsAsABeamUnderItsWeight) {
    const double gravity = 1.0;
    // Bending and shear (Timoshenko, κ = 5/6, G = E/2): w = q L⁴/(8 E I) + q L²/(2 κ G A).
    const double load = density * area * gravity;
    const double expected = load * std::pow(length, 4) / (8.0 * young * inertia) +
                            load * length * length / (2.0 * (5.0 / 6.0) * 0.5 * young * area);
    for (const ElementModel model : {ElementModel::Corotational, ElementModel::StVenantKirchhoff}) {
        const double coarse = deflection(3, model, gravity), fine = deflection(6, model, gravity);
        EXPECT_LT(coarse, fine) << "linear elements are too stiff";
        EXPECT_LT(fine, expected);
        EXPECT_NEAR(extrapolated(coarse, fine) / expected, 1.0, 0.03);
    }
}

/// The lowest angular frequencies (1/s) of the modes that move the mass centre across x, that is of bending, by
/// subspace iteration on K x = ω² M x.
Eigen::VectorXd bending_frequencies(const MultibodySystem& system, int freedoms, int count) {
    const State state = system.initial_state();
    const auto n = system.n();
    const tests::Sparse K = tests::stiffness_of(system, state);
    const tests::Sparse M = tests::sparse_matrix(n, [&](auto& H) { system.add_mass(state, 1.0, H); });
    const Eigen::SimplicialLDLT<tests::Sparse> factor(K);
    Eigen::MatrixXd X = Eigen::MatrixXd::Random(n, count + 10);
    Eigen::VectorXd values;
    for (int iteration = 0; iteration < 30; ++iteration) {
        X = factor.solve(M * X).eval();
        const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> small(X.transpose() * (K * X),
                                                                              X.transpose() * (M * X));
        X = (X * small.eigenvectors()).eval();  // Xᵀ M X = 1
        values = small.eigenvalues();
    }
    Eigen::MatrixXd across = Eigen::MatrixXd::Zero(n, 2);
    for (Eigen::Index k = 0; k < n; k += freedoms) across(k + 1, 0) = across(k + 2, 1) = 1.0;
    const Eigen::MatrixXd momentum = across.transpose() * (M * X);
    const double mass = across.col(0).dot(M * across.col(0));
    Eigen::VectorXd result(count);
    Eigen::Index found = 0;
    for (Eigen::Index k = 0; k < values.size() && found < count; ++k)
        if (momentum.col(k).squaredNorm() > 1e-2 * mass) result[found++] = std::sqrt(values[k]);
    EXPECT_EQ(found, count);
    return result;
}

Eigen::VectorXd of_tetrahedra(int across, ElementOrder order) {
    MultibodySystem system;
    make_cantilever(system, across, ElementModel::Corotational, 0.0, order);
    return bending_frequencies(system, 3, 6);
}

Eigen::VectorXd of_beams(int elements) {
    MultibodySystem system;
    ElasticBeamParameters beam;
    beam.to = {length, 0.0, 0.0};
    beam.elements = elements;
    beam.section = BeamSection::rectangle(depth, depth);
    beam.material = {young, 0.0, density, 0.0};
    beam.fixed_from = true;
    system.add_elastic_beam(beam);
    system.finish();
    return bending_frequencies(system, 6, 6);
}

TEST(Cantilever, SwingsWithTheFrequenciesOfABeam) {
    // Euler and Bernoulli: ω = (βL)² √(E I/(ρ A L⁴)), βL = 1.8751, 4.6941, 7.8548, which shear and the sections'
    // turning lower: Timoshenko's theory, by beam elements. The square section bends in two planes, so that frequencies
    // come in pairs.
    const double unit = std::sqrt(young * inertia / (density * area * std::pow(length, 4)));
    const Eigen::VectorXd beam = (4.0 * of_beams(40) - of_beams(20)) / 3.0;
    const Eigen::VectorXd values =
        (4.0 * of_tetrahedra(4, ElementOrder::Linear) - of_tetrahedra(2, ElementOrder::Linear)) / 3.0;
    const Eigen::VectorXd quadratic = of_tetrahedra(1, ElementOrder::Quadratic);
    Eigen::Index k = 0;
    for (const double beta : {1.8751, 4.6941, 7.8548})
        for (int plane = 0; plane < 2; ++plane, ++k) {
            const double slender = beta * beta * unit;
            RecordProperty("mode_" + std::to_string(k), std::to_string(values[k] / beam[k]) + " of Timoshenko, " +
                                                            std::to_string(values[k] / slender) + " of Euler");
            EXPECT_LT(beam[k] / slender, 1.0);
            EXPECT_NEAR(beam[k] / slender, 1.0, 0.0025 * beta * beta) << "shear matters as (β depth)²";
            EXPECT_NEAR(values[k] / beam[k], 1.0, 0.05) << k;
            RecordProperty("quadratic_" + std::to_string(k), std::to_string(quadratic[k] / beam[k]));
            EXPECT_NEAR(quadratic[k] / beam[k], 1.0, 0.02) << k << ": one cell over the depth";
        }
}

}  // namespace
}  // namespace delassus::cantilever_test
