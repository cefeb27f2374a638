// SPDX-License-Identifier: BSD-3-Clause
// Solving in parts, in one process and, started by mpirun, in several.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/prepared_part.hpp"
#include "delassus/solver_config.hpp"
#include "support/places.hpp"
#include "support/small_problems.hpp"

#ifdef DELASSUS_HAS_MPI

namespace delassus::solve_in_parts_test {
namespace {

class SolveInParts : public testing::Test {
protected:
    [[nodiscard]] Solver solver(std::shared_ptr<const Communicator> communicator) const {
        SolverConfig config;
        config.name = "parts_gradient";
        return make_solver(registry, config, *communicator);
    }

    std::shared_ptr<const Communicator> run = communicator_of_run();
    Registry registry{{tests::places::plugins}};
};

// Every process solves the problem by itself as well, as the only one of a run of one.
TEST_F(SolveInParts, TakesTheStepsOfOneProcess) {
    for (const char* family : {"box_stack", "sphere_pile"})
        for (const Law law : {Law::Associated, Law::Coulomb}) {
            SCOPED_TRACE(family);
            Problem whole = generate(family, {});
            whole.law = law;
            const auto alone = single_process();
            SolveSettings settings;
            settings.tolerance = 1e-12;  // the same iterates, whether they get there or not
            settings.max_iterations = 50;
            const PreparedPart at_once(alone, part_of(*alone, whole));
            Solution expected;
            const SolveReport serial = solver(alone).solve(at_once, expected, settings);
            ASSERT_EQ(serial.status, Status::IterationLimit) << serial.message;

            const PreparedPart part(run, part_of(*run, whole));
            Solution own;
            const SolveReport report = solver(run).solve(part, own, settings);
            ASSERT_EQ(report.status, Status::IterationLimit) << report.message;
            EXPECT_NEAR(report.error.natural, serial.error.natural, 1e-8 * serial.error.natural);
            const auto first = part.problem().column_start[static_cast<std::size_t>(run->rank())];
            double difference = 0.0;  // m/s
            for (std::size_t i = 0; i < own.x.size(); ++i)
                difference = std::max(difference, std::abs(own.x[i] - expected.x[static_cast<std::size_t>(first) + i]));
            EXPECT_LE(difference, 1e-8);
        }
}

// A claim without a proof is found out; the answer of ipm_petsc is a proof (Proves in solvers_test.cpp).
TEST_F(SolveInParts, AClaimThatThereIsNoSolutionNeedsAProof) {
    SolverConfig config;
    config.name = "parts_gradient";
    config.options = {{"fault", "claim"}};
    Solver liar = make_solver(registry, config, *run);
    const PreparedPart part(run, part_of(*run, generate("box_stack", {})));
    Solution own;
    SolveSettings settings;
    settings.tolerance = 1e-12;
    const SolveReport report = liar.solve(part, own, settings);
    EXPECT_EQ(report.status, Status::FalseClaim);
    EXPECT_NE(report.message.find("claimed that there is no solution"), std::string::npos) << report.message;
}

TEST_F(SolveInParts, StartsFromWhatItIsGiven) {
    const PreparedPart part(run, part_of(*run, generate("box_stack", {})));
    Solver gradient = solver(run);
    SolveSettings settings;
    Solution own;
    ASSERT_EQ(gradient.solve(part, own, settings).status, Status::Solved);
    settings.warm_start = true;
    EXPECT_EQ(gradient.solve(part, own, settings).iterations, 0);
    if (run->rank() == run->size() - 1) own.x.push_back(0.0);
    EXPECT_THROW(gradient.solve(part, own, settings), InputError);
}

TEST_F(SolveInParts, LimitsEndIt) {
    const PreparedPart part(run, part_of(*run, generate("box_stack", {})));
    Solver gradient = solver(run);
    SolveSettings settings;
    settings.tolerance = 1e-13;
    settings.max_iterations = 3;
    Solution own;
    SolveReport report = gradient.solve(part, own, settings);
    EXPECT_EQ(report.status, Status::IterationLimit);
    EXPECT_EQ(report.iterations, 3);
    EXPECT_GT(report.error.natural, 1e-13);
    settings.max_iterations = 100000000;
    settings.tolerance = 1e-300;
    settings.time_limit = 0.2;
    EXPECT_EQ(gradient.solve(part, own, settings).status, Status::TimeLimit);
}

// One process is asked to stop: all do.
TEST_F(SolveInParts, ACancelledProcessStopsAll) {
    const PreparedPart part(run, part_of(*run, generate("box_stack", {})));
    SolveSettings settings;
    settings.tolerance = 1e-300;
    settings.max_iterations = 100000000;
    if (run->rank() == run->size() - 1) settings.cancelled = [] { return true; };
    Solution own;
    EXPECT_EQ(solver(run).solve(part, own, settings).status, Status::Cancelled);
}

TEST_F(SolveInParts, TheCurveIsOfTheWhole) {
    const PreparedPart part(run, part_of(*run, generate("box_stack", {})));
    SolveSettings settings;
    settings.record_curve = true;
    Solution own;
    const SolveReport report = solver(run).solve(part, own, settings);
    ASSERT_GE(report.curve.size(), 2U);
    EXPECT_EQ(report.curve.front().iteration, 0);
    EXPECT_GT(report.curve.front().natural, report.curve.back().natural);
    EXPECT_EQ(report.curve.back().natural, report.error.natural);
}

TEST_F(SolveInParts, WhatItCannotTakeIsRefused) {
    Problem unsymmetric = tests::tied_masses();
    unsymmetric.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 1.0}, {0, 1, 0.5}, {1, 1, 3.0}});
    const PreparedPart part(run, part_of(*run, unsymmetric));
    EXPECT_EQ(part.structure(), Structure::Unsymmetric);
    Solution own;
    try {
        solver(run).solve(part, own, {});
        FAIL() << "it was taken";
    } catch (const Unsupported& refusal) {
        EXPECT_EQ(std::string(refusal.what()),
                  "parts_gradient cannot solve \"tied masses\": an unsymmetric H. No installed solver can.");
    }
    SolveSettings wrong;
    wrong.tolerance = -1.0;
    EXPECT_THROW(solver(run).solve(part, own, wrong), InputError);
    SolverConfig config;
    config.name = "pgs";
    if (registry.capable(0).size() > 1) {
        Solver serial = make_solver(registry, config, *run);
        EXPECT_THROW(serial.solve(part, own, {}), Unsupported);
    }
}

TEST_F(SolveInParts, AutoChoosesWhatCan) {
    const PreparedPart part(run, part_of(*run, generate("box_stack", {})));
    SolverConfig config;
    config.name = "auto";
    Solver chooser = make_solver(registry, config, *run);
    Solution own;
    const SolveReport report = chooser.solve(part, own, {});
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    ASSERT_FALSE(report.stages.empty());
    EXPECT_LE(report.error.natural, 1.001e-8);
}

TEST_F(SolveInParts, ProcessesReport) {
    const PreparedPart part(run, part_of(*run, generate("box_stack", {})));
    const auto reports = process_reports(part, {});
    ASSERT_EQ(reports.size(), static_cast<std::size_t>(run->size()));
    std::int64_t columns = 0, rows = 0;
    for (const auto& one : reports) {
        columns += one.n;
        rows += one.m;
        EXPECT_GT(one.peak_memory, 1 << 20);
    }
    EXPECT_EQ(columns, part.raw().n_all);
    EXPECT_EQ(rows, part.raw().m_all);
}

}  // namespace
}  // namespace delassus::solve_in_parts_test

#endif
