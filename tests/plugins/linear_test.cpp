// SPDX-License-Identifier: BSD-3-Clause
// The linear solvers cholmod and minres, on problems with free rows only.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "support/dense.hpp"
#include "support/small_problems.hpp"
#include "support/solving.hpp"

namespace delassus::linear_test {
namespace {

using tests::dense;

using tests::is_built;
using tests::solve_with;
using tests::Solved;
using tests::to;

/// x and λ of [H −Dᵀ; D E]{x; λ} = {a; −b} by dense LU with full pivoting.
Eigen::VectorXd dense_solution(const Problem& problem) {
    const Eigen::Index n = problem.n(), m = problem.m();
    Eigen::MatrixXd A(n + m, n + m);
    const Eigen::MatrixXd D = dense(problem.D, m, n);
    A << dense(problem.H, n, n), -D.transpose(), D, dense(problem.E, m, m);
    Eigen::VectorXd right(n + m);
    for (Eigen::Index i = 0; i < n; ++i) right[i] = problem.a[static_cast<std::size_t>(i)];
    for (Eigen::Index i = 0; i < m; ++i) right[n + i] = -problem.b[static_cast<std::size_t>(i)];
    return A.fullPivLu().solve(right);
}

void expect_equal(const Solved& answer, const Eigen::VectorXd& expected, double tolerance) {
    const auto& [x, lambda] = answer.solution;
    ASSERT_EQ(static_cast<Eigen::Index>(x.size() + lambda.size()), expected.size());
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(x[i], expected[static_cast<Eigen::Index>(i)], tolerance);
    for (std::size_t i = 0; i < lambda.size(); ++i)
        EXPECT_NEAR(lambda[i], expected[static_cast<Eigen::Index>(x.size() + i)], tolerance);
}

/// H tridiagonal (not block-diagonal) with the given diagonal and couplings −1; rows of D with three entries.
Problem tridiagonal(std::int32_t n, std::int32_t m, double diagonal) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Problem problem;
    problem.name = "tridiagonal";
    std::vector<Triplet> H, D;
    for (std::int32_t i = 0; i < n; ++i) {
        H.push_back({i, i, diagonal});
        if (i + 1 < n) {
            H.push_back({i, i + 1, -1.0});
            H.push_back({i + 1, i, -1.0});
        }
        problem.a.push_back(uniform(random));
    }
    for (std::int32_t i = 0; i < m; ++i) {
        for (std::int32_t k = 0; k < 3; ++k)
            D.push_back({i, (i * n / m + 5 * k) % n, uniform(random) + 2.0 * (k == 0)});
        problem.b.push_back(uniform(random));
        problem.cones.push_back(Cone::free(1));
    }
    problem.H = SparseMatrix::from_triplets(n, n, H);
    problem.D = SparseMatrix::from_triplets(m, n, D);
    return problem;
}

/// x = 0 and x = 1 at once.
Problem contradiction() {
    Problem problem;
    problem.name = "contradiction";
    problem.H = tests::identity(1);
    problem.D = SparseMatrix::from_triplets(2, 1, {{0, 0, 1.0}, {1, 0, 1.0}});
    problem.a = {0.0};
    problem.b = {0.0, -1.0};
    problem.cones = {Cone::free(1), Cone::free(1)};
    return problem;
}

class Linear : public testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        if (!is_built(name())) GTEST_SKIP() << name() << " is not built";
    }
    static std::string name() { return GetParam(); }
};

TEST_P(Linear, TiedMassesShareTheirMomentum) {
    const auto answer = solve_with(name(), tests::tied_masses(), to(1e-12));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
    expect_equal(answer, Eigen::Vector3d(1.0, 1.0, -3.0), 1e-11);
}

TEST_P(Linear, WithoutConstraintsXIsHInverseA) {
    Problem problem = tridiagonal(30, 1, 3.0);
    problem.D = SparseMatrix::zero(0, 30);
    problem.b.clear();
    problem.cones.clear();
    const auto expected = dense_solution(problem);
    const auto answer = solve_with(name(), problem, to(1e-10));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
    expect_equal(answer, expected, 1e-10);
}

TEST_P(Linear, SparseMassThatIsNotDiagonal) {
    const Problem problem = tridiagonal(40, 8, 2.5);
    ASSERT_EQ(PreparedProblem(problem).structure(), Structure::Definite);
    const auto answer = solve_with(name(), problem, to(1e-11));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
    expect_equal(answer, dense_solution(problem), 1e-9);
}

TEST_P(Linear, ComplianceSoftensTheRows) {
    Problem problem = tridiagonal(20, 4, 2.5);
    problem.E = SparseMatrix::from_triplets(
        4, 4, {{0, 0, 2.0}, {0, 3, 1.0}, {3, 0, 1.0}, {3, 3, 1.0}, {1, 1, 1e-3}});  // row 2 stays rigid
    const auto answer = solve_with(name(), problem, to(1e-11));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
    expect_equal(answer, dense_solution(problem), 1e-9);
}

TEST_P(Linear, ReducedProblem) {
    Problem problem;
    problem.name = "reduced";
    problem.D = SparseMatrix::zero(3, 0);
    problem.E = SparseMatrix::from_triplets(3, 3, {{0, 0, 2.0}, {0, 1, 1.0}, {1, 0, 1.0}, {1, 1, 2.0}, {2, 2, 4.0}});
    problem.b = {-3.0, -3.0, 2.0};
    problem.cones = {Cone::free(3)};
    const auto answer = solve_with(name(), problem, to(1e-12));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
    expect_equal(answer, Eigen::Vector3d(1.0, 1.0, -0.5), 1e-11);

    problem.E = SparseMatrix::from_triplets(3, 3, {{0, 0, 1.0}, {0, 1, 1.0}, {1, 0, 1.0}, {1, 1, 1.0}, {2, 2, 4.0}});
    const auto singular = solve_with(name(), problem, to(1e-12));
    EXPECT_EQ(singular.report.status, Status::Solved) << singular.report.message;
    EXPECT_NEAR(singular.solution.lambda[0] + singular.solution.lambda[1], 3.0, 1e-10);
}

TEST_P(Linear, SemidefiniteMassHeldByTheRows) {
    // A free chain of springs: H 1 = 0, and one row holds its first node.
    Problem problem = tridiagonal(12, 1, 2.0);
    problem.H.value.front() = 1.0;
    problem.H.value.back() = 1.0;
    problem.D = SparseMatrix::from_triplets(1, 12, {{0, 0, 1.0}});
    ASSERT_EQ(PreparedProblem(problem).structure(), Structure::Semidefinite);
    const auto answer = solve_with(name(), problem, to(1e-10));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
    expect_equal(answer, dense_solution(problem), 1e-7);
}

TEST_P(Linear, RepeatedJointsAndHeavyEnds) {
    const double limit = name() == "cholmod" ? 1e-10 : 1e-8;
    for (const double bodies : {10.0, 300.0}) {
        for (const double ratio : {1.0, 1e9, 1e-9}) {
            for (const double heavy_end : {0.0, 1.0}) {
                for (const double speed : {0.0, 1.0}) {
                    const auto answer = solve_with(name(),
                                                   generate("chain", {{"bodies", bodies},
                                                                      {"mass_ratio", ratio},
                                                                      {"heavy_end", heavy_end},
                                                                      {"speed", speed},
                                                                      {"repeated", 3.0}}),
                                                   to(limit));
                    EXPECT_EQ(answer.report.status, Status::Solved)
                        << bodies << " bodies, ratio " << ratio << ": " << answer.report.message;
                    EXPECT_LE(answer.report.error.natural, limit);
                    EXPECT_LE(answer.report.error.balance, limit);
                }
            }
        }
    }
}

TEST_P(Linear, ClosedLoopWithRedundantHinges) {
    const auto answer = solve_with(
        name(), generate("chain", {{"bodies", 50}, {"revolute", 1}, {"planar", 1}, {"closed", 1}}), to(1e-8));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
}

TEST_P(Linear, ContradictionIsInfeasibleWithTheLeastSquaresResidual) {
    const auto answer = solve_with(name(), contradiction(), to(1e-8));
    EXPECT_EQ(answer.report.status, Status::Infeasible) << answer.report.message;
    EXPECT_NEAR(answer.solution.x[0], 0.5, 1e-8);  // u = (½, −½); r = (0, −1)
    EXPECT_NEAR(answer.report.error.natural, std::sqrt(0.5), 1e-8);
    EXPECT_NE(answer.report.message.find("contradict"), std::string::npos) << answer.report.message;
}

TEST_P(Linear, RepeatedJointThatDriftedApartIsInfeasible) {
    for (const double drift : {0.01, 1e-6}) {
        Problem problem = generate("chain", {{"bodies", 20}, {"repeated", 2}});
        problem.b[7] += drift;  // one copy only
        const auto answer = solve_with(name(), problem, to(1e-8));
        EXPECT_EQ(answer.report.status, Status::Infeasible) << answer.report.message;
        for (const double value : answer.solution.lambda) EXPECT_LT(std::abs(value), 1e6);
    }
}

TEST_P(Linear, HundredSolvesOneAnalysis) {
    Problem problem = tridiagonal(40, 8, 2.5);
    const Registry registry;
    Solver solver(registry.load(name()), {}, &registry);
    PreparedProblem prepared(problem);
    Solution solution;
    SolveReport report;
    for (int k = 0; k < 100; ++k) {
        if (k == 50) {  // new values, same pattern
            problem.H.value.front() += 0.25;
            prepared = PreparedProblem(problem);
        }
        problem.b[0] = 0.01 * k;
        prepared.set_right_hand_side(problem.a, problem.b);
        report = solver.solve(prepared, solution, to(1e-10));
        ASSERT_EQ(report.status, Status::Solved) << report.message;
    }
    EXPECT_EQ(report.analyses, 1);
    EXPECT_EQ(report.factorizations, 2);
    const auto expected = dense_solution(problem);
    for (std::size_t i = 0; i < solution.x.size(); ++i)
        EXPECT_NEAR(solution.x[i], expected[static_cast<Eigen::Index>(i)], 1e-8);

    prepared = PreparedProblem(tridiagonal(40, 9, 2.5));
    report = solver.solve(prepared, solution, to(1e-10));
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    EXPECT_EQ(report.analyses, 2);
}

TEST_P(Linear, WarmStartAtTheSolutionCostsNoIteration) {
    const Problem problem = generate("chain", {{"bodies", 100}, {"mass_ratio", 100.0}});
    const OptionTexts options = name() == "minres" ? OptionTexts{{"schur", "diagonal"}} : OptionTexts{};
    const auto cold = solve_with(name(), problem, to(1e-8), options);
    ASSERT_EQ(cold.report.status, Status::Solved) << cold.report.message;
    EXPECT_GT(cold.report.iterations, 0);
    SolveSettings settings = to(1e-6);
    settings.warm_start = true;
    settings.max_iterations = 0;
    const auto warm = solve_with(name(), problem, settings, options, cold.solution);
    EXPECT_EQ(warm.report.status, Status::Solved) << warm.report.message;
    EXPECT_EQ(warm.report.iterations, 0);
}

TEST_P(Linear, WithoutIterationsTheStartIsReturned) {
    SolveSettings settings = to(1e-8);
    settings.max_iterations = 0;
    const auto answer = solve_with(name(), tests::tied_masses(), settings);
    EXPECT_EQ(answer.report.status, Status::IterationLimit);
    EXPECT_EQ(answer.solution.x, std::vector<double>({0.0, 0.0}));
}

TEST_P(Linear, CancelStopsTheSolve) {
    SolveSettings settings = to(1e-8);
    settings.cancelled = [] { return true; };
    const auto answer = solve_with(name(), generate("chain", {{"bodies", 50}}), settings);
    EXPECT_EQ(answer.report.status, Status::Cancelled);
    for (const double value : answer.solution.x) EXPECT_TRUE(std::isfinite(value));
}

TEST_P(Linear, FrictionIsRefused) {
    EXPECT_THROW(solve_with(name(), tests::point_on_plane(1.0, 1.0, 0.5, 0.5, Law::Associated), to(1e-8)), Unsupported);
}

INSTANTIATE_TEST_SUITE_P(Solvers, Linear, testing::Values("cholmod", "minres"),
                         [](const auto& parameter) { return std::string(parameter.param); });

TEST(Cholmod, EveryFormOrderingAndMethodGivesTheSameVelocities) {
    if (!is_built("cholmod")) GTEST_SKIP() << "cholmod is not built";
    const Problem problem = generate("net", {{"rows", 12}, {"columns", 12}, {"diagonals", 2}, {"speed", 1.0}});
    const auto reference = solve_with("cholmod", problem, to(1e-10));
    ASSERT_EQ(reference.report.status, Status::Solved) << reference.report.message;
    for (const char* form : {"schur", "quasi_definite"}) {
        for (const char* ordering : {"amd", "metis", "best"}) {
            for (const char* method : {"simplicial", "supernodal"}) {
                const auto answer = solve_with("cholmod", problem, to(1e-10),
                                               {{"form", form}, {"ordering", ordering}, {"factorization", method}});
                EXPECT_EQ(answer.report.status, Status::Solved) << form << ": " << answer.report.message;
                for (std::size_t i = 0; i < answer.solution.x.size(); ++i)
                    ASSERT_NEAR(answer.solution.x[i], reference.solution.x[i], 1e-8) << form << ' ' << ordering;
            }
        }
    }
}

// H couples neighbours, as the stiffness of a chain's joints does: its inverse is dense, and so is the Schur
// complement.
TEST(Cholmod, TakesTheFormThatCostsLess) {
    if (!is_built("cholmod")) GTEST_SKIP() << "cholmod is not built";
    const std::int32_t n = 120;
    std::vector<Triplet> H, D;
    for (std::int32_t i = 0; i < n; ++i) {
        H.push_back({i, i, 2.1});
        if (i > 0) H.insert(H.end(), {{i, i - 1, -1.0}, {i - 1, i, -1.0}});
        if (i > 0) D.insert(D.end(), {{i - 1, i - 1, -1.0}, {i - 1, i, 1.0 + 0.01 * i}});
    }
    Problem problem;
    problem.H = SparseMatrix::from_triplets(n, n, std::move(H));
    problem.D = SparseMatrix::from_triplets(n - 1, n, std::move(D));
    problem.a.assign(static_cast<std::size_t>(n), 1.0);
    problem.b.assign(static_cast<std::size_t>(n) - 1, 0.1);
    for (std::int32_t i = 0; i + 1 < n; ++i) problem.cones.push_back(Cone::free(1));
    const auto coupled = solve_with("cholmod", problem, to(1e-10));
    EXPECT_EQ(coupled.report.status, Status::Solved) << coupled.report.message;
    EXPECT_EQ(coupled.report.message.rfind("quasi-definite form", 0), 0u) << coupled.report.message;
    const auto expected = dense_solution(problem);
    for (std::size_t i = 0; i < coupled.solution.x.size(); ++i)
        ASSERT_NEAR(coupled.solution.x[i], expected[static_cast<Eigen::Index>(i)], 1e-9);
    const auto chain = solve_with("cholmod", generate("chain", {{"bodies", 50}}), to(1e-10));
    EXPECT_EQ(chain.report.message.rfind("Schur complement", 0), 0u) << chain.report.message;
}

TEST(Cholmod, ElasticBlockWithSupernodalMass) {
    if (!is_built("cholmod")) GTEST_SKIP() << "cholmod is not built";
    const Problem problem = generate("elastic_block", {{"elements", 5}, {"glue", 1}, {"speed", 1.0}});
    const auto expected = dense_solution(problem);
    for (const char* form : {"auto", "schur", "quasi_definite"}) {
        const auto answer =
            solve_with("cholmod", problem, to(1e-10), {{"form", form}, {"factorization", "supernodal"}});
        EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
        EXPECT_LE(answer.report.error.balance, 1e-10);
        for (std::size_t i = 0; i < answer.solution.x.size(); ++i)
            ASSERT_NEAR(answer.solution.x[i], expected[static_cast<Eigen::Index>(i)], 1e-8) << form;
    }
}

TEST(Cholmod, ForceOnAnUnheldMasslessFreedomIsInfeasible) {
    if (!is_built("cholmod")) GTEST_SKIP() << "cholmod is not built";
    Problem problem = tests::tied_masses();
    problem.H = SparseMatrix::from_triplets(3, 3, {{0, 0, 1.0}, {1, 1, 3.0}});
    problem.D = SparseMatrix::from_triplets(1, 3, {{0, 0, 1.0}, {0, 1, -1.0}});
    problem.a = {4.0, 0.0, 1.0};
    EXPECT_EQ(solve_with("cholmod", problem, to(1e-8)).report.status, Status::Infeasible);
    problem.a[2] = 0.0;
    const auto answer = solve_with("cholmod", problem, to(1e-10));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
    EXPECT_NEAR(answer.solution.x[0], 1.0, 1e-9);
}

TEST(Minres, IndefiniteMass) {
    if (!is_built("minres")) GTEST_SKIP() << "minres is not built";
    const Problem problem = tridiagonal(30, 6, 0.5);
    ASSERT_EQ(PreparedProblem(problem).structure(), Structure::Indefinite);
    const auto answer = solve_with("minres", problem, to(1e-11));
    EXPECT_EQ(answer.report.status, Status::Solved) << answer.report.message;
    expect_equal(answer, dense_solution(problem), 1e-8);
}

TEST(Minres, EveryPreconditionerReachesTheSameAnswer) {
    if (!is_built("minres")) GTEST_SKIP() << "minres is not built";
    const Problem problem = tridiagonal(60, 12, 2.5);
    const auto expected = dense_solution(problem);
    for (const char* schur : {"auto", "diagonal", "blocks", "incomplete_cholesky", "identity"}) {
        const auto answer = solve_with("minres", problem, to(1e-11), {{"schur", schur}});
        EXPECT_EQ(answer.report.status, Status::Solved) << schur << ": " << answer.report.message;
        expect_equal(answer, expected, 1e-9);
    }
}

TEST(Minres, CloserStartTakesFewerIterations) {
    if (!is_built("minres")) GTEST_SKIP() << "minres is not built";
    Problem problem = generate("chain", {{"bodies", 200}, {"mass_ratio", 100.0}, {"speed", 1.0}});
    const OptionTexts options{{"schur", "diagonal"}};
    const auto cold = solve_with("minres", problem, to(1e-8), options);
    ASSERT_EQ(cold.report.status, Status::Solved) << cold.report.message;
    for (double& value : problem.a) value *= 1.0 + 1e-6;
    SolveSettings settings = to(1e-8);
    settings.warm_start = true;
    const auto warm = solve_with("minres", problem, settings, options, cold.solution);
    EXPECT_EQ(warm.report.status, Status::Solved) << warm.report.message;
    EXPECT_LT(warm.report.iterations, cold.report.iterations);
}

TEST(Minres, WhatItCannotReachIsStalledAndNotSolved) {
    if (!is_built("minres")) GTEST_SKIP() << "minres is not built";
    SolveSettings settings = to(1e-15);  // below rounding
    const auto answer = solve_with("minres", generate("chain", {{"bodies", 200}, {"mass_ratio", 1e9}}), settings);
    EXPECT_EQ(answer.report.status, Status::Stalled) << answer.report.message;
    EXPECT_LT(answer.report.error.natural, 1e-9);
}

}  // namespace
}  // namespace delassus::linear_test
