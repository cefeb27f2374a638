// SPDX-License-Identifier: BSD-3-Clause
// What a step's problem costs: parts that nothing touches reach no plugin, separate parts are solved apart.
#include "delassus/step_solver.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/timestepper.hpp"
#include "support/small_problems.hpp"

namespace delassus::step_solver_test {
namespace {

/// Two problems beside each other, the second's columns and rows after the first's.
Problem beside(const Problem& first, const Problem& second) {
    Problem both = first;
    const auto n = first.n() + second.n();
    for (auto [to, from] : {std::pair{&both.H, &second.H}, {&both.D, &second.D}}) {
        SparseMatrix result = *to;
        const auto entries = result.entries();
        for (std::int32_t i = 0; i < from->rows; ++i)
            result.row_start.push_back(entries + from->row_start[static_cast<std::size_t>(i) + 1]);
        for (const auto column : from->column) result.column.push_back(column + first.n());
        result.value.insert(result.value.end(), from->value.begin(), from->value.end());
        result.rows += from->rows;
        result.columns = n;
        *to = result;
    }
    both.a.insert(both.a.end(), second.a.begin(), second.a.end());
    both.b.insert(both.b.end(), second.b.begin(), second.b.end());
    both.cones.insert(both.cones.end(), second.cones.begin(), second.cones.end());
    return both;
}

/// Tridiagonal and not symmetric: 4 on the diagonal, 1 above, −1 below.
Problem circulating(std::int32_t n, double diagonal) {
    std::vector<Triplet> entries;
    for (std::int32_t i = 0; i < n; ++i) {
        entries.push_back({i, i, diagonal});
        if (i + 1 < n) entries.push_back({i, i + 1, 1.0});
        if (i > 0) entries.push_back({i, i - 1, -1.0});
    }
    Problem problem;
    problem.H = SparseMatrix::from_triplets(n, n, std::move(entries));
    for (std::int32_t i = 0; i < n; ++i) problem.a.push_back(std::sin(1.0 + i));
    return problem;
}

class StepSolverTest : public testing::Test {
protected:
    SolverConfig config(const std::string& name) const {
        SolverConfig chosen;
        chosen.name = name;
        chosen.tolerance = 1e-10;
        chosen.law = Law::Associated;
        return chosen;
    }
    Registry registry;
};

TEST_F(StepSolverTest, SolvesUnsymmetricProblemsWithoutRowsOfAnySize) {
    StepSolver solver(registry, {});
    for (const std::int32_t n : {3, 200, 800}) {
        for (const double diagonal : {4.0, 5.0}) {
            const Problem problem = circulating(n, diagonal);
            Solution solution;
            EXPECT_TRUE(solver.solve(problem, solution).solved);
            std::vector<double> left = problem.a;
            problem.H.multiply_add(-1.0, solution.x.data(), left.data());
            for (const double value : left) ASSERT_NEAR(value, 0.0, 1e-14) << n;
        }
    }
}

// Two bodies that a damper couples and a joint holds together fall freely. The joint holds at the speeds of the step
// before as well, which are the start: they are no answer, for they do not balance.
TEST_F(StepSolverTest, LetsAMechanismFall) {
    constexpr double h = 0.004, g = 9.81;
    Problem problem;
    problem.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 2.1}, {0, 1, -0.1}, {1, 0, -0.1}, {1, 1, 3.1}});
    problem.a = {2.0 * -h * g, 3.0 * -h * g};
    for (const bool contact : {false, true}) {
        problem.D = SparseMatrix::from_triplets(1, 2, {{0, 0, -1.0}, {0, 1, 1.0}});
        problem.b = {0.0};
        problem.cones = {contact ? Cone::nonnegative(1) : Cone::free(1)};
        for (const double rounding : {0.0, 1e-17, -1e-17}) {
            problem.b = {rounding};
            StepSolver solver(registry, {});
            Solution solution{{0.0, 0.0}, {0.0}};
            EXPECT_TRUE(solver.solve(problem, solution, {.warm_start = true}).solved);
            EXPECT_NEAR(solution.x[0], -h * g, 1e-15);
            EXPECT_NEAR(solution.x[1], -h * g, 1e-15);
            EXPECT_NEAR(solution.lambda[0], 0.0, 1e-15);
        }
    }
}

TEST_F(StepSolverTest, CallsNoPluginWithoutRows) {
    StepSolver solver(registry, {});
    Problem problem;
    problem.H = tests::diagonal_matrix({2.0, 4.0});
    problem.a = {2.0, 8.0};
    Solution solution;
    EXPECT_TRUE(solver.solve(problem, solution).solved);
    EXPECT_EQ(solution.x, (std::vector<double>{1.0, 2.0}));
    // An unsymmetric H without rows as well.
    problem.H = SparseMatrix::from_triplets(2, 2, {{0, 0, 2.0}, {0, 1, 1.0}, {1, 0, -1.0}, {1, 1, 4.0}});
    problem.a = {3.0, 3.0};
    EXPECT_TRUE(solver.solve(problem, solution).solved);
    EXPECT_NEAR(solution.x[0], 1.0, 1e-15);
    EXPECT_NEAR(solution.x[1], 1.0, 1e-15);
    problem.a = {5.0, 2.0};  // by the factors of before
    EXPECT_TRUE(solver.solve(problem, solution).solved);
    EXPECT_NEAR(2.0 * solution.x[0] + solution.x[1], 5.0, 1e-14);
    EXPECT_NEAR(-solution.x[0] + 4.0 * solution.x[1], 2.0, 1e-14);
    problem.H.value = {2.0, 1.0, 4.0, 2.0};
    EXPECT_THROW(static_cast<void>(solver.solve(problem, solution)), InputError);
    problem.H.value = {2.0, 1.0, -2.0, 4.0};
    EXPECT_TRUE(solver.solve(problem, solution).solved);
    EXPECT_NEAR(-2.0 * solution.x[0] + 4.0 * solution.x[1], 2.0, 1e-14);
    EXPECT_EQ(solver.effort().solves, 5);
    EXPECT_EQ(solver.effort().plugin_solves, 0);
    EXPECT_TRUE(solver.loaded().empty());
}

TEST_F(StepSolverTest, LeavesNothingOutWhereThatIsAskedFor) {
    BoxStackParameters parameters;
    const Problem one = generate_box_stack(parameters);
    const Problem both = beside(one, one);
    StepSolver apart(registry, config("admm")), whole(registry, config("admm"));
    whole.leave_nothing_out();
    const auto parts = whole.parts(both);
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_EQ(parts[0].structure, Structure::Definite);
    EXPECT_EQ(apart.parts(both).size(), 2U);
    Solution expected, solution;
    ASSERT_TRUE(apart.solve(both, expected).solved);
    ASSERT_TRUE(whole.solve(both, solution).solved);
    EXPECT_EQ(whole.effort().plugin_solves, 1);
    for (std::size_t i = 0; i < expected.x.size(); ++i) EXPECT_NEAR(solution.x[i], expected.x[i], 1e-8);

    // auto takes a solver for cones, also where there is no row.
    StepSolver general(registry, {});
    general.leave_nothing_out();
    Problem free;
    free.H = tests::diagonal_matrix({2.0, 4.0});
    free.a = {2.0, 8.0};
    ASSERT_TRUE(general.solve(free, solution).solved);
    EXPECT_NEAR(solution.x[0], 1.0, 1e-12);
    EXPECT_NEAR(solution.x[1], 2.0, 1e-12);
    EXPECT_EQ(general.effort().plugin_solves, 1);
    EXPECT_NE(general.parts(free)[0].needs & DELASSUS_CAN_FRICTION, 0U);
}

TEST_F(StepSolverTest, SolvesSeparateStacksApart) {
    BoxStackParameters parameters;
    const Problem one = generate_box_stack(parameters);
    const Problem both = beside(one, one);
    StepSolver apart(registry, config("apgd"));
    Solution solution, whole;
    ASSERT_TRUE(apart.solve(both, solution).solved);
    const auto stacks = apart.effort().plugin_solves;
    StepSolver alone(registry, config("apgd"));
    ASSERT_TRUE(alone.solve(one, whole).solved);
    EXPECT_EQ(stacks, 2 * alone.effort().plugin_solves);
    // Each part sees the same problem and gives the same bits.
    for (std::size_t i = 0; i < whole.x.size(); ++i) {
        EXPECT_EQ(solution.x[i], whole.x[i]);
        EXPECT_EQ(solution.x[whole.x.size() + i], whole.x[i]);
    }
    for (std::size_t i = 0; i < whole.lambda.size(); ++i)
        EXPECT_EQ(solution.lambda[whole.lambda.size() + i], whole.lambda[i]);
    const PreparedProblem prepared(both);
    EXPECT_LE(ErrorMeter(prepared).measure(solution.x, solution.lambda).natural, 2e-10);
}

TEST_F(StepSolverTest, LeavesOutRowsBetweenFixedBodies) {
    Problem problem = tests::point_on_plane(2.0, 6.0, 5.0, 0.5, Law::Associated);
    problem.b.push_back(1.0);
    problem.cones.push_back(Cone::nonnegative(1));
    problem.D.row_start.push_back(problem.D.entries());
    ++problem.D.rows;
    StepSolver solver(registry, config("apgd"));
    std::int32_t shown = 0;
    solver.watch([&](const Problem& seen) { shown = seen.m(); });
    Solution solution;
    ASSERT_TRUE(solver.solve(problem, solution).solved);
    EXPECT_EQ(shown, 4) << "who asks for the step's problem sees all of it";
    ASSERT_EQ(solution.lambda.size(), 4U);
    EXPECT_EQ(solution.lambda[3], 0.0);
    EXPECT_GT(solution.lambda[0], 0.0);
}

TEST_F(StepSolverTest, ChoosesBySolversThatCan) {
    StepSolver solver(registry, {});
    Solution solution;
    ASSERT_TRUE(solver.solve(generate_chain({}), solution).solved);
    EXPECT_EQ(solver.loaded(), (std::vector<std::string>{"cholmod"}));
    ASSERT_TRUE(solver.solve(generate_box_stack({}), solution).solved);
    EXPECT_EQ(solver.loaded(), (std::vector<std::string>{"cholmod", "pgs", "ssn"}));
    StepSolver wrong(registry, config("cholmod"));
    EXPECT_THROW(static_cast<void>(wrong.solve(generate_box_stack({}), solution)), Unsupported);
}

TEST_F(StepSolverTest, SaysWhatItDidNotSolve) {
    auto chosen = config("auto");
    chosen.max_iterations = 2;
    StepSolver solver(registry, chosen);
    Solution solution;
    EXPECT_FALSE(solver.solve(generate_box_stack({}), solution).solved);
    EXPECT_NE(solver.effort().unsolved.find("iteration_limit"), std::string::npos) << solver.effort().unsolved;
    solver.reset_effort();
    EXPECT_TRUE(solver.effort().unsolved.empty());
}

// A trial may lead to where masses or constraints are no numbers: a failure of the step, which a shorter one may pass.
TEST_F(StepSolverTest, WhatIsNotFiniteIsAFailureOfTheStep) {
    StepSolver solver(registry, config("auto"));
    Solution solution;
    Problem good = circulating(3, 4.0), bad = good;
    bad.H.value[1] = std::nan("");
    for (int twice = 0; twice < 2; ++twice) {
        try {
            (void)solver.solve(bad, solution);
            ADD_FAILURE() << "an entry is no number";
        } catch (const StepFailure& error) {
            EXPECT_NE(std::string(error.what()).find("H(0, 1)"), std::string::npos) << error.what();
        }
        EXPECT_TRUE(solver.solve(good, solution).solved);
    }
}

}  // namespace
}  // namespace delassus::step_solver_test
