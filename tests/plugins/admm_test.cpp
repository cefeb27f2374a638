// SPDX-License-Identifier: BSD-3-Clause
// admm: the contact law against its conditions, known answers for every cone and law, equality of all forms of the
// linear system, compliance, singular H, mass ratios, reuse of factors, honest claims on the shared problems.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cctype>
#include <cmath>
#include <limits>
#include <random>

#include "../../plugins/admm/contact_law.hpp"
#include "delassus/errors.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/solver.hpp"
#include "support/dense.hpp"
#include "support/shared_problems.hpp"
#include "support/small_problems.hpp"
#include "support/solving.hpp"

namespace delassus::admm_test {
namespace {

using tests::dense;
using tests::diagonal_matrix;
using tests::identity;
using tests::infinity;
using tests::one_row;
using tests::point_on_plane;
using tests::to;

using Result = tests::Solved;

Result solve(const Problem& problem, const SolveSettings& settings, const OptionTexts& options = {}) {
    return tests::solve_with("admm", problem, settings, options);
}

void expect_answer(const Problem& problem, const std::vector<double>& x, const std::vector<double>& lambda) {
    for (const char* acceleration : {"none", "nesterov", "anderson"}) {
        tests::expect_solution(solve(problem, to(1e-11, 100'000), {{"acceleration", acceleration}}), x, lambda, 1e-9,
                               acceleration);
    }
}

// ---- The contact law -----------------------------------------------------------------------------------------------

/// Whether (λ, u) obey the exact Coulomb law, by its words: no pull; closed or no force; friction within μ λ_n, and
/// where it slides, of that size against the motion.
void expect_coulomb(double mu, const Eigen::VectorXd& lambda, const Eigen::VectorXd& u) {
    const Eigen::VectorXd lambda_t = lambda.tail(lambda.size() - 1), u_t = u.tail(u.size() - 1);
    EXPECT_GE(lambda[0], 0.0);
    EXPECT_GE(u[0], -1e-14);
    EXPECT_NEAR(lambda[0] * u[0], 0.0, 1e-12);
    EXPECT_LE(lambda_t.norm(), mu * lambda[0] + 1e-12);
    EXPECT_NEAR((u_t.norm() * lambda_t + mu * lambda[0] * u_t).norm(), 0.0, 1e-11);
}

TEST(AdmmContactLaw, GivesThePairThatObeysCoulomb) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    int opened = 0, stuck = 0, slid = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const std::int32_t rows = trial % 2 == 0 ? 3 : 2;
        const double mu = trial % 7 == 0 ? 0.0 : std::abs(normal(random));
        const Problem problem = [&] {
            Problem p;
            p.H = identity(rows);
            p.D = identity(rows);
            p.a.assign(static_cast<std::size_t>(rows), 0.0);
            p.b = p.a;
            p.cones = {Cone::friction(mu, rows)};
            p.law = Law::Coulomb;
            return p;
        }();
        const PreparedProblem prepared(problem);
        admm::ContactLaw law;
        law.load(sdk::ProblemView(prepared.raw()), Eigen::VectorXd::Ones(rows));
        const Eigen::VectorXd y = Eigen::VectorXd::NullaryExpr(rows, [&] { return normal(random); });
        Eigen::VectorXd lambda;
        law.apply(y, lambda);
        expect_coulomb(mu, lambda, lambda - y);  // ρ = 1
        if (lambda[0] == 0.0) {
            ++opened;
        } else if ((lambda - y).norm() == 0.0) {
            ++stuck;
        } else {
            ++slid;
        }
    }
    EXPECT_GT(opened, 500);
    EXPECT_GT(stuck, 300);
    EXPECT_GT(slid, 500);
}

// ---- Known answers -------------------------------------------------------------------------------------------------

TEST(Admm, KnowsFreeNonnegativeAndBoxRows) {
    for (const auto& [problem, x, lambda] : tests::known_answers_of_rows()) expect_answer(problem, x, lambda);
}

TEST(Admm, SticksSlidesAndOpensByTheAssociatedLaw) {
    for (const auto& [problem, x, lambda] : tests::known_answers_of_associated_friction())
        expect_answer(problem, x, lambda);
}

TEST(Admm, SticksSlidesAndOpensByTheCoulombLaw) {
    expect_answer(point_on_plane(2.0, 6.0, 2.0, 0.5, Law::Coulomb), {0.0, 0.0, 0.0}, {6.0, -2.0, 0.0});
    expect_answer(point_on_plane(2.0, 6.0, 5.0, 0.5, Law::Coulomb), {0.0, 1.0, 0.0}, {6.0, -3.0, 0.0});
    expect_answer(point_on_plane(2.0, -6.0, 1.0, 0.5, Law::Coulomb), {3.0, 0.5, 0.0}, {0.0, 0.0, 0.0});
    expect_answer(point_on_plane(2.0, 6.0, 5.0, 0.0, Law::Coulomb), {0.0, 2.5, 0.0}, {6.0, 0.0, 0.0});
}

TEST(Admm, SharesTheLoadOfRedundantRows) {
    Problem problem = one_row(2.0, -6.0, Cone::nonnegative(3));
    problem.D = SparseMatrix::from_triplets(3, 1, {{0, 0, 1.0}, {1, 0, 1.0}, {2, 0, 1.0}});
    problem.b = {0.0, 0.0, 0.0};
    const auto [solution, report] = solve(problem, to(1e-11, 100'000));
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_NEAR(solution.x[0], 0.0, 1e-9);
    EXPECT_NEAR(solution.lambda[0] + solution.lambda[1] + solution.lambda[2], 6.0, 1e-9);
}

TEST(Admm, WithoutRowsGivesTheFreeVelocity) {
    Problem problem;
    problem.H = diagonal_matrix({2.0, 4.0});
    problem.D = SparseMatrix::zero(0, 2);
    problem.a = {1.0, 2.0};
    const auto [solution, report] = solve(problem, to(1e-10, 100'000));
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_EQ(solution.x, (std::vector<double>{0.5, 0.5}));
}

// A massless platform under a mass: H is singular, and the contact rows hold what it leaves free.
TEST(Admm, TakesASingularHThatTheRowsHold) {
    Problem problem;
    problem.H = diagonal_matrix({0.0, 2.0});
    problem.D = SparseMatrix::from_triplets(2, 2, {{0, 0, 1.0}, {1, 0, -1.0}, {1, 1, 1.0}});
    problem.a = {0.0, -6.0};
    problem.b = {0.0, 0.0};
    problem.cones = {Cone::nonnegative(1), Cone::nonnegative(1)};
    expect_answer(problem, {0.0, 0.0}, {6.0, 6.0});
}

TEST(Admm, SaysThatNoRowHoldsASingularDirection) {
    Problem problem = one_row(1.0, 1.0, Cone::nonnegative(1));
    problem.H = diagonal_matrix({1.0, 0.0});
    problem.D = SparseMatrix::from_triplets(1, 2, {{0, 0, 1.0}});
    problem.a = {1.0, 0.0};
    const auto report = solve(problem, to(1e-8, 100'000)).report;
    EXPECT_EQ(report.status, Status::NumericalFailure);
    EXPECT_NE(report.message.find("no row of D holds"), std::string::npos) << report.message;
}

// ---- Forms of the linear system
// --------------------------------------------------------------------------------------

enum class Compliance { None, Diagonal, Full };

/// A deterministic number in (−1, 1).
double noise(int i) {
    return std::sin(12.9898 * i + 0.5) * std::cos(78.233 * i);
}

/// All kinds of cones on an elastic bar of 30 freedoms, with independent rows.
Problem mixed(Compliance compliance) {
    constexpr std::int32_t n = 30;
    Problem problem;
    std::vector<Triplet> H, D, E;
    for (std::int32_t i = 0; i < n; ++i) {
        H.push_back({i, i, 4.0 + noise(i)});
        if (i > 0) {
            H.push_back({i, i - 1, -1.5});
            H.push_back({i - 1, i, -1.5});
        }
        problem.a.push_back(3.0 * noise(100 + i));
    }
    problem.cones = {Cone::free(2),          Cone::nonnegative(3),
                     Cone::friction(0.6),    Cone::box({-0.2, -infinity, 0.1}, {0.1, 0.3, infinity}),
                     Cone::friction(0.3, 2), Cone::friction(0.0)};
    std::int32_t m = 0;
    for (const Cone& cone : problem.cones) m += cone.rows;
    for (std::int32_t i = 0; i < m; ++i) {
        for (std::int32_t k = 0; k < 4; ++k) D.push_back({i, (7 * i + 5 * k * k) % n, noise(1000 + 10 * i + k)});
        if (compliance != Compliance::None) E.push_back({i, i, 0.05});
        if (compliance == Compliance::Full && i > 0) {
            E.push_back({i, i - 1, -0.02});
            E.push_back({i - 1, i, -0.02});
        }
        problem.b.push_back(0.5 * noise(500 + i) - (i % 3 == 2 ? 0.4 : 0.0));
    }
    problem.H = SparseMatrix::from_triplets(n, n, H);
    problem.D = SparseMatrix::from_triplets(m, n, D);
    problem.E = SparseMatrix::from_triplets(m, m, E);
    return problem;
}

Problem reduced(const Problem& problem) {
    const Eigen::MatrixXd D = dense(problem.D), Z = dense(problem.H).inverse();
    Eigen::MatrixXd N = D * Z * D.transpose();
    if (problem.E.rows > 0) N += dense(problem.E);
    const Eigen::VectorXd r = D * Z * dense(problem.a) + dense(problem.b);
    Problem small;
    std::vector<Triplet> E;
    for (std::int32_t i = 0; i < N.rows(); ++i)
        for (std::int32_t j = 0; j < N.cols(); ++j) E.push_back({i, j, 0.5 * (N(i, j) + N(j, i))});
    small.E = SparseMatrix::from_triplets(problem.m(), problem.m(), E);
    small.b.assign(r.begin(), r.end());
    small.cones = problem.cones;
    small.law = problem.law;
    return small;
}

class AdmmForms : public testing::TestWithParam<std::tuple<Compliance, Law>> {};

TEST_P(AdmmForms, AgreeWithTheReducedProblem) {
    Problem problem = mixed(std::get<0>(GetParam()));
    problem.law = std::get<1>(GetParam());
    const auto small = solve(reduced(problem), to(1e-11, 100'000));
    ASSERT_EQ(small.report.status, Status::Solved) << small.report.message;
    for (const char* form : {"primal", "dual", "auto"}) {
        const auto [solution, report] = solve(problem, to(1e-11, 100'000), {{"form", form}});
        EXPECT_EQ(report.status, Status::Solved) << form << ' ' << report.message;
        for (std::size_t i = 0; i < solution.lambda.size(); ++i)
            EXPECT_NEAR(solution.lambda[i], small.solution.lambda[i], 1e-8) << form << ' ' << i;
    }
}

INSTANTIATE_TEST_SUITE_P(All, AdmmForms,
                         testing::Combine(testing::Values(Compliance::None, Compliance::Diagonal, Compliance::Full),
                                          testing::Values(Law::Associated, Law::Coulomb)));

// ---- Mass ratios
// -----------------------------------------------------------------------------------------------------

/// Bodies on top of one another under their weight, the uppermost `ratio` times as heavy as the others: nothing moves,
/// and each contact carries what is above it. The light bodies' velocities are differences of impulses `ratio` times
/// larger, which leaves 7e-16 ratio of the natural error to rounding: the tolerances are near the last digit there is.
TEST(Admm, CarriesAHeavyBodyOnLightOnes) {
    constexpr std::int32_t bodies = 20;
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        for (const auto& [ratio, tolerance] : {std::pair{1e6, 1e-8}, {1e9, 1e-6}}) {
            Problem problem;
            std::vector<double> masses, weights;
            std::vector<Triplet> D;
            for (std::int32_t k = 0; k < bodies; ++k) {
                const double mass = k + 1 == bodies ? ratio : 1.0;
                for (std::int32_t i = 0; i < 3; ++i) {
                    masses.push_back(mass);
                    problem.a.push_back(i == 0 ? -mass : 0.1 * mass * (i - 1));
                    D.push_back({3 * k + i, 3 * k + i, 1.0});
                    if (k > 0) D.push_back({3 * k + i, 3 * k + i - 3, -1.0});
                }
                problem.cones.push_back(Cone::friction(0.5));
            }
            problem.H = diagonal_matrix(masses);
            problem.D = SparseMatrix::from_triplets(3 * bodies, 3 * bodies, D);
            problem.b.assign(3 * bodies, 0.0);
            problem.law = law;
            const auto [solution, report] = solve(problem, to(tolerance, 300));
            EXPECT_EQ(report.status, Status::Solved) << ratio << ' ' << report.message;
            for (std::int32_t k = 0; k < bodies; ++k) {
                const double above = ratio + bodies - 1 - k;
                EXPECT_NEAR(solution.lambda[static_cast<std::size_t>(3 * k)] / above, 1.0, 10.0 * tolerance)
                    << ratio << ' ' << k;
            }
            for (const double v : solution.x) EXPECT_NEAR(v, 0.0, 100.0 * tolerance) << ratio;
        }
    }
}

// ---- Reuse
// -----------------------------------------------------------------------------------------------------------

TEST(Admm, KeepsItsFactorForNewRightHandSides) {
    const Registry registry;
    Problem problem = mixed(Compliance::Diagonal);
    PreparedProblem prepared(problem);
    Solver solver(registry.load("admm"), {{"adaptive_rho", "false"}}, &registry);
    for (int k = 0; k < 5; ++k) {
        for (double& value : problem.a) value += 0.1;
        prepared.set_right_hand_side(problem.a, problem.b);
        Solution solution;
        const auto report = solver.solve(prepared, solution, to(1e-6, 100'000));
        EXPECT_EQ(report.status, Status::Solved);
        EXPECT_EQ(report.analyses, 1);
        EXPECT_EQ(report.factorizations, 1);
    }
    for (double& value : problem.H.value) value *= 2.0;
    Solution solution;
    const auto report = solver.solve(PreparedProblem(problem), solution, to(1e-6, 100'000));
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_EQ(report.analyses, 1);
    EXPECT_EQ(report.factorizations, 2);
}

TEST(Admm, AnalysesOnceHoweverOftenThePenaltyChanges) {
    const auto report = solve(mixed(Compliance::Full), to(1e-9, 100'000), {{"rho", "1e4"}}).report;
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_EQ(report.analyses, 1);
    EXPECT_GT(report.factorizations, 1);
}

TEST(Admm, StopsAtOnceFromTheSolution) {
    const Registry registry;
    const PreparedProblem prepared(mixed(Compliance::Diagonal));
    Solver solver(registry.load("admm"), {}, &registry);
    Solution solution;
    ASSERT_EQ(solver.solve(prepared, solution, to(1e-10, 100'000)).status, Status::Solved);
    SolveSettings settings = to(1e-9, 100'000);
    settings.warm_start = true;
    const auto report = solver.solve(prepared, solution, settings);
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_EQ(report.iterations, 0);
}

TEST(Admm, GivesUpWhereRowsContradict) {
    Problem problem = one_row(1.0, 0.0, Cone::free(2));
    problem.D = SparseMatrix::from_triplets(2, 1, {{0, 0, 1.0}, {1, 0, 1.0}});
    problem.b = {0.0, 1.0};
    const auto report = solve(problem, to(1e-8, 100'000), {{"stall_iterations", "200"}}).report;
    EXPECT_EQ(report.status, Status::Stalled);
    EXPECT_GT(report.error.natural, 1e-3);
}

// ---- The shared contact problems
// ---------------------------------------------------------------------------------------

class AdmmShared : public testing::TestWithParam<std::filesystem::path> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(AdmmShared);

TEST_P(AdmmShared, ClaimsOnlyWhatHolds) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        Problem problem = read_problem(GetParam());
        problem.law = law;
        for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
            const auto report = solve(problem, to(tolerance, 250)).report;
            if (report.status == Status::Solved) {
                EXPECT_LE(report.error.natural, 1.001 * tolerance) << name_of(law);
                continue;
            }
            EXPECT_TRUE(report.status == Status::IterationLimit || report.status == Status::Stalled)
                << name_of(report.status) << ' ' << report.message;
            // A finer tolerance asks for more of the same iteration.
            EXPECT_GT(report.error.natural, 0.9 * tolerance) << name_of(law);
            break;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, AdmmShared, testing::ValuesIn(tests::shared_problem_folders()), [](const auto& test) {
    std::string text = test.param.filename().string();
    for (char& c : text)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return text;
});

}  // namespace
}  // namespace delassus::admm_test
