// SPDX-License-Identifier: BSD-3-Clause
// Finite elements with frictional contact: H is sparse and not diagonal, and the cone solvers take it all the same.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "delassus/multibody.hpp"
#include "delassus/timestepper.hpp"

namespace delassus::elastic_contact_test {
namespace {

TEST(ElasticBlock, SlidesWithTheFrictionOfItsWeight) {
#ifndef DELASSUS_HAS_FCL
    GTEST_SKIP() << "this build has no collision";
#endif
    const double mu = 0.3, radius = 0.01, speed = 5.0, h = 1e-3, density = 1000.0;
    for (const double young : {1e6, 1e9, 2e11}) {
        MultibodySystem system;
        Shape plane;
        plane.kind = ShapeKind::Plane;
        const auto material = system.add_material({mu, 0.0});
        system.add_shape(plane, material);
        // Strong damping, so that it soon slides steadily.
        ElasticBlock block;
        block.corner = {0.0, 0.0, radius};
        block.edges = {0.4, 0.2, 0.2};
        block.cells = {4, 2, 2};
        block.order = ElementOrder::Linear;
        block.material = {young, 0.3, density, 1e3 / young};
        block.velocity = {speed, 0.0, 0.0};
        block.contact_radius = radius;
        block.contact_material = material;
        system.add_elastic_block(block);
        system.finish();
        ASSERT_TRUE(system.has_unilateral());

        const Registry registry;
        SolverConfig config;
        config.name = "pgs";
        config.tolerance = 1e-10;
        config.law = Law::Coulomb;
        StepSolver solver(registry, config);
        Problem problem;
        solver.watch([&](const Problem& seen) { problem = seen; });
        const auto stepper = make_timestepper("euler_implicit_linearized", system);
        State state = system.initial_state();
        const int steps = 300;
        double momentum_before = 0.0;
        for (int step = 0; step < steps; ++step) {
            momentum_before = system.momentum(state)[0][0];
            const auto report = stepper->step(state, h, solver);
            ASSERT_TRUE(report.solved) << report.message;
        }
        ASSERT_EQ(problem.cones.size(), 15U) << "every node of the lower face";
        EXPECT_EQ(PreparedProblem(problem).structure(), Structure::Definite);
        const double weight = 9.81 * density * 0.4 * 0.2 * 0.2;
        // Each contact by itself: it slides, so that its friction is μ λ_n.
        Solution solution;
        Solver pgs = make_solver(registry, config);
        SolveSettings settings;
        settings.tolerance = 1e-11;
        pgs.solve(PreparedProblem(problem), solution, settings);
        double normal = 0.0;
        for (std::size_t c = 0; c < problem.cones.size(); ++c) {
            const double* lambda = solution.lambda.data() + 3 * c;
            EXPECT_NEAR(std::hypot(lambda[1], lambda[2]), mu * lambda[0], 1e-8 * weight * h);
            normal += lambda[0] / h;
        }
        const auto momentum = system.momentum(state)[0];
        EXPECT_NEAR((momentum_before - momentum[0]) / h, mu * normal, 1e-6 * weight) << "E = " << young;
        // The softest block still trembles a little.
        EXPECT_NEAR(normal, weight, 1e-4 * weight);
        EXPECT_NEAR(momentum[1], 0.0, 1e-5 * weight);
    }
}

// A soft block is thrown down and bounces: its nodes meet the ground and leave it one after another. D gains and loses
// rows, H has its entries in the same places: one symbolic factorisation has to serve all steps.
TEST(ElasticBlock, AnalysesItsMatrixOnceWhileContactsComeAndGo) {
#ifndef DELASSUS_HAS_FCL
    GTEST_SKIP() << "this build has no collision";
#endif
    MultibodySystem system;
    Shape plane;
    plane.kind = ShapeKind::Plane;
    const auto material = system.add_material({0.3, 0.0});
    system.add_shape(plane, material);
    ElasticBlock block;
    block.corner = {0.0, 0.0, 0.02};
    block.edges = {0.4, 0.2, 0.2};
    block.cells = {4, 2, 2};
    block.order = ElementOrder::Linear;
    block.material = {1e5, 0.3, 1000.0, 0.0};
    block.velocity = {0.5, 0.2, -1.0};
    block.contact_radius = 0.01;
    block.contact_material = material;
    system.add_elastic_block(block);
    system.set_envelope(0.002);
    system.finish();

    const Registry registry;
    SolverConfig config;
    config.name = "pgs";
    config.law = Law::Associated;
    config.tolerance = 1e-8;
    StepSolver solver(registry, config);
    std::vector<Problem> problems;
    solver.watch([&](const Problem& seen) { problems.push_back(seen); });
    const auto stepper = make_timestepper("euler_implicit_linearized", system);
    State state = system.initial_state();
    std::set<std::size_t> numbers;  // of contacts
    for (int step = 0; step < 100; ++step) {
        ASSERT_TRUE(stepper->step(state, 2e-3, solver).solved);
        numbers.insert(problems.back().cones.size());
    }
    EXPECT_EQ(*numbers.begin(), 0U) << "it flies before and after";
    EXPECT_GE(numbers.size(), 4U) << "contacts come and go one after another";
    std::erase_if(problems, [](const Problem& problem) { return problem.cones.empty(); });

    for (const char* name : {"pgs", "apgd", "spg", "ipm"}) {
        config.name = name;
        Solver plugin = make_solver(registry, config);
        SolveReport report;
        for (const Problem& problem : problems) {
            Solution solution;
            SolveSettings settings;
            settings.tolerance = 1e-8;
            report = plugin.solve(PreparedProblem(problem), solution, settings);
            ASSERT_EQ(report.status, Status::Solved) << name << ": " << report.message;
        }
        EXPECT_EQ(report.analyses, 1) << name;
        EXPECT_GE(report.factorizations, static_cast<std::int64_t>(problems.size())) << name;
    }
}

}  // namespace
}  // namespace delassus::elastic_contact_test
