// SPDX-License-Identifier: BSD-3-Clause
// The projected gradient solvers spg and apgd: known answers for every cone, equality of the problem's forms, units,
// warm start, honest claims, and the shared contact problems.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "delassus/errors.hpp"
#include "delassus/generate.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/solver.hpp"
#include "support/dense.hpp"
#include "support/places.hpp"
#include "support/small_problems.hpp"
#include "support/solving.hpp"

namespace delassus::gradient_test {
namespace {

using tests::dense;
using tests::diagonal_matrix;
using tests::infinity;
using tests::one_row;
using tests::point_on_line;
using tests::point_on_plane;
using tests::to;

using Result = tests::Solved;

Result solve(const std::string& name, const Problem& problem, const SolveSettings& settings, Solution start = {}) {
    return tests::solve_with(name, problem, settings, {}, std::move(start));
}

class Gradient : public testing::TestWithParam<std::string> {
protected:
    void expect_answer(const Problem& problem, const std::vector<double>& x, const std::vector<double>& lambda) const {
        tests::expect_solution(solve(GetParam(), problem, to(1e-11)), x, lambda);
    }
};

TEST_P(Gradient, KnowsFreeNonnegativeAndBoxRows) {
    for (const auto& [problem, x, lambda] : tests::known_answers_of_rows()) expect_answer(problem, x, lambda);
}

TEST_P(Gradient, SticksSlidesAndOpens) {
    for (const auto& [problem, x, lambda] : tests::known_answers_of_associated_friction())
        expect_answer(problem, x, lambda);
}

TEST_P(Gradient, SlidesInThePlane) {
    const double mu = 0.5, s = (6.0 + 5.0 * mu) / (1.0 + mu * mu);
    expect_answer(point_on_line(mu, Law::Associated), {(s - 6.0) / 2.0, (5.0 - mu * s) / 2.0}, {s, -mu * s});
}

TEST_P(Gradient, SharesTheLoadOfRedundantRows) {
    // The same row three times: any split is a solution; x is unique.
    Problem problem = one_row(2.0, -6.0, Cone::nonnegative(3));
    problem.D = SparseMatrix::from_triplets(3, 1, {{0, 0, 1.0}, {1, 0, 1.0}, {2, 0, 1.0}});
    problem.b = {0.0, 0.0, 0.0};
    const auto [solution, report] = solve(GetParam(), problem, to(1e-11));
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_NEAR(solution.x[0], 0.0, 1e-9);
    EXPECT_NEAR(solution.lambda[0] + solution.lambda[1] + solution.lambda[2], 6.0, 1e-9);
}

TEST_P(Gradient, WithoutRowsGivesTheFreeVelocity) {
    Problem problem;
    problem.H = diagonal_matrix({2.0, 4.0});
    problem.D = SparseMatrix::zero(0, 2);
    problem.a = {1.0, 2.0};
    const auto [solution, report] = solve(GetParam(), problem, to(1e-10));
    EXPECT_EQ(report.status, Status::Solved);
    EXPECT_DOUBLE_EQ(solution.x[0], 0.5);
    EXPECT_DOUBLE_EQ(solution.x[1], 0.5);
}

// A deterministic number in (−1, 1).
double noise(int i) {
    return std::sin(12.9898 * i + 0.5) * std::cos(78.233 * i);
}

/// All kinds of cones and a compliance on a chain of n freedoms; H is tridiagonal like that of an elastic bar, or
/// diagonal. The compliance makes N definite, hence λ unique.
Problem mixed(bool tridiagonal) {
    constexpr std::int32_t n = 30;
    Problem problem;
    std::vector<Triplet> H, D, E;
    for (std::int32_t i = 0; i < n; ++i) {
        H.push_back({i, i, 4.0 + noise(i)});
        if (tridiagonal && i > 0) {
            H.push_back({i, i - 1, -1.5});
            H.push_back({i - 1, i, -1.5});
        }
        problem.a.push_back(3.0 * noise(100 + i));
    }
    problem.cones = {Cone::free(2),          Cone::nonnegative(3),
                     Cone::friction(0.6),    Cone::box({-0.2, -infinity, 0.1}, {0.1, 0.3, infinity}),
                     Cone::friction(0.3, 2), Cone::friction(0.8),
                     Cone::friction(0.0)};
    std::int32_t m = 0;
    for (const Cone& cone : problem.cones) m += cone.rows;
    for (std::int32_t i = 0; i < m; ++i) {
        for (std::int32_t k = 0; k < 4; ++k) D.push_back({i, (7 * i + 5 * k * k) % n, noise(1000 + 10 * i + k)});
        E.push_back({i, i, 0.05});
        problem.b.push_back(0.5 * noise(500 + i) - (i % 3 == 2 ? 0.4 : 0.0));
    }
    problem.H = SparseMatrix::from_triplets(n, n, H);
    problem.D = SparseMatrix::from_triplets(m, n, D);
    problem.E = SparseMatrix::from_triplets(m, m, E);
    return problem;
}

struct Reduced {
    Eigen::MatrixXd N;
    Eigen::VectorXd r;
};

Reduced reduced(const Problem& problem) {
    const Eigen::MatrixXd D = dense(problem.D), Z = dense(problem.H).inverse();
    return {D * Z * D.transpose() + dense(problem.E), D * Z * dense(problem.a) + dense(problem.b)};
}

/// The natural error by its definition, from dense matrices and a projection written anew.
double natural_by_hand(const Problem& problem, const std::vector<double>& solution) {
    const auto [N, r] = reduced(problem);
    const Eigen::VectorXd lambda = dense(solution), u = N * lambda + r;
    double sum = 0.0, reference = 0.0;
    Eigen::Index first = 0;
    for (const Cone& cone : problem.cones) {
        const Eigen::Index rows = cone.rows;
        const double s2 = static_cast<double>(rows) / N.block(first, first, rows, rows).trace();
        const Eigen::VectorXd l = lambda.segment(first, rows);
        const Eigen::VectorXd z = l - s2 * u.segment(first, rows);
        Eigen::VectorXd p = z;
        const Eigen::VectorXd t = z.tail(rows - 1);
        switch (cone.kind) {
            case ConeKind::Free:
                break;
            case ConeKind::Nonnegative:
                p = z.cwiseMax(0.0);
                break;
            case ConeKind::Box:
                p = z.cwiseMax(dense(cone.lo)).cwiseMin(dense(cone.hi));
                break;
            case ConeKind::Friction:
                if (t.norm() > cone.parameters[0] * z[0]) {
                    // the nearest point of the ray (1, μ t/‖t‖), or the apex
                    Eigen::VectorXd ray(rows);
                    ray << 1.0, cone.parameters[0] * t.normalized();
                    p = std::max(0.0, ray.dot(z)) / ray.squaredNorm() * ray;
                }
                break;
        }
        sum += (l - p).squaredNorm() / s2;
        reference += s2 * r.segment(first, rows).squaredNorm();
        first += rows;
    }
    return std::sqrt(sum / reference);
}

TEST_P(Gradient, ClaimsHoldByAnIndependentMeasure) {
    for (const bool tridiagonal : {false, true}) {
        const Problem problem = mixed(tridiagonal);
        for (const double tolerance : {1e-4, 1e-7, 1e-11}) {
            const auto [solution, report] = solve(GetParam(), problem, to(tolerance));
            EXPECT_EQ(report.status, Status::Solved) << report.message;
            const double by_hand = natural_by_hand(problem, solution.lambda);
            EXPECT_LE(by_hand, tolerance);
            EXPECT_NEAR(report.claimed_residual, by_hand, 1e-3 * tolerance + 1e-14);
        }
    }
}

TEST_P(Gradient, AgreesWithTheReducedForm) {
    for (const bool tridiagonal : {false, true}) {
        const Problem problem = mixed(tridiagonal);
        const auto [N, r] = reduced(problem);
        Problem small;
        std::vector<Triplet> E;
        for (std::int32_t i = 0; i < N.rows(); ++i)
            for (std::int32_t j = 0; j < N.cols(); ++j) E.push_back({i, j, 0.5 * (N(i, j) + N(j, i))});
        small.E = SparseMatrix::from_triplets(problem.m(), problem.m(), E);
        small.b.assign(r.begin(), r.end());
        small.cones = problem.cones;
        const auto [full_solution, full_report] = solve(GetParam(), problem, to(1e-11));
        const auto [small_solution, small_report] = solve(GetParam(), small, to(1e-11));
        EXPECT_EQ(full_report.status, Status::Solved);
        EXPECT_EQ(small_report.status, Status::Solved);
        for (std::size_t i = 0; i < full_solution.lambda.size(); ++i)
            EXPECT_NEAR(full_solution.lambda[i], small_solution.lambda[i], 1e-8) << i;
    }
}

/// The same problem in other units: velocities times `length`, masses times `mass`.
Problem in_units(Problem problem, double length, double mass) {
    for (double& v : problem.H.value) v *= mass;
    for (double& v : problem.E.value) v /= mass;
    for (double& v : problem.a) v *= mass * length;
    for (double& v : problem.b) v *= length;
    for (Cone& cone : problem.cones) {
        for (double& v : cone.lo) v *= mass * length;
        for (double& v : cone.hi) v *= mass * length;
    }
    return problem;
}

TEST_P(Gradient, DoesNotDependOnUnits) {
    for (const bool tridiagonal : {false, true}) {
        const Problem problem = mixed(tridiagonal);
        const auto [solution, report] = solve(GetParam(), problem, to(1e-8));
        ASSERT_EQ(report.status, Status::Solved);
        // Even powers of two change no digit of any number: all decisions are the same.
        constexpr double million = 1048576.0;
        for (const auto& [length, mass] : {std::pair{million, 1.0}, {1.0, million}, {1.0 / million, million}}) {
            const auto [scaled, scaled_report] = solve(GetParam(), in_units(problem, length, mass), to(1e-8));
            EXPECT_EQ(scaled_report.status, Status::Solved);
            EXPECT_EQ(scaled_report.iterations, report.iterations) << length << ' ' << mass;
            for (std::size_t i = 0; i < solution.lambda.size(); ++i)
                EXPECT_DOUBLE_EQ(scaled.lambda[i] / (mass * length), solution.lambda[i]);
        }
        const auto decimal = solve(GetParam(), in_units(problem, 1e-6, 1e6), to(1e-8)).report;
        EXPECT_EQ(decimal.status, Status::Solved);
        EXPECT_NEAR(static_cast<double>(decimal.iterations), static_cast<double>(report.iterations),
                    0.05 * static_cast<double>(report.iterations) + 1.0);
    }
}

TEST_P(Gradient, StopsAtOnceFromTheSolution) {
    const Problem problem = mixed(true);
    auto [solution, report] = solve(GetParam(), problem, to(1e-10));
    ASSERT_EQ(report.status, Status::Solved);
    EXPECT_GT(report.iterations, 0);
    SolveSettings settings = to(1e-9);
    settings.warm_start = true;
    const auto again = solve(GetParam(), problem, settings, solution);
    EXPECT_EQ(again.report.status, Status::Solved);
    EXPECT_EQ(again.report.iterations, 0);
    settings.max_iterations = 0;
    EXPECT_EQ(solve(GetParam(), problem, settings, solution).report.status, Status::Solved);
}

TEST_P(Gradient, WithoutIterationsReturnsTheProjectedStart) {
    Problem problem = point_on_plane(2.0, 6.0, 5.0, 0.5, Law::Associated);
    SolveSettings settings = to(1e-8);
    settings.max_iterations = 0;
    settings.warm_start = true;
    const auto [solution, report] = solve(GetParam(), problem, settings, {{0.0, 0.0, 0.0}, {-1.0, 0.1, 0.0}});
    EXPECT_EQ(report.status, Status::IterationLimit);
    EXPECT_EQ(solution.lambda, (std::vector<double>{0.0, 0.0, 0.0}));
}

TEST_P(Gradient, ObeysCancellation) {
    SolveSettings settings = to(1e-12);
    int calls = 0;
    settings.cancelled = [&calls] { return ++calls > 3; };
    const auto [solution, report] = solve(GetParam(), mixed(true), settings);
    EXPECT_EQ(report.status, Status::Cancelled);
    EXPECT_LE(report.iterations, 4);
    for (const double v : solution.lambda) EXPECT_TRUE(std::isfinite(v));
}

TEST_P(Gradient, DoesNotClaimWhatRoundingForbids) {
    SolveSettings settings = to(1e-300);
    settings.max_iterations = 3000;
    const auto [solution, report] = solve(GetParam(), mixed(true), settings);
    EXPECT_NE(report.status, Status::FalseClaim);
    EXPECT_NE(report.status, Status::NumericalFailure) << report.message;
    EXPECT_LE(report.error.natural, 1e-13);
}

TEST_P(Gradient, RefusesExactCoulomb) {
    EXPECT_THROW(solve(GetParam(), point_on_plane(1.0, 1.0, 1.0, 0.5, Law::Coulomb), to(1e-8)), std::exception);
}

INSTANTIATE_TEST_SUITE_P(Solvers, Gradient, testing::Values("spg", "apgd"),
                         [](const auto& test) { return test.param; });

// ---- The shared contact problems -----------------------------------------------------------------------------------

std::filesystem::path shared_problems() {
    const char* folder = std::getenv("DELASSUS_SHARED_PROBLEMS");
    return folder ? folder : tests::places::shared_problems;
}

std::vector<std::string> shared_names() {
    std::vector<std::string> names;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(shared_problems(), error))
        if (std::filesystem::exists(entry.path() / "problem.json")) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

class GradientShared : public testing::TestWithParam<std::tuple<std::string, std::string>> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(GradientShared);

TEST_P(GradientShared, ReachesAMillionthWithinAMinute) {
    const auto& [solver, name] = GetParam();
    Problem problem = read_problem(shared_problems() / name);
    problem.law = Law::Associated;
    const bool reported_only = name == "heavytop-40-nc40";
    SolveSettings settings = to(1e-6);
    settings.max_iterations = 100'000'000;
    settings.time_limit = reported_only ? 3.0 : 60.0;
#if defined(__SANITIZE_ADDRESS__)
    if (name == "wall10-step0150-nc620") GTEST_SKIP() << "too slow under the sanitizers";
#endif
    const auto report = solve(solver, problem, settings).report;
    RecordProperty("iterations", static_cast<int>(report.iterations));
    RecordProperty("natural", std::to_string(report.error.natural));
    EXPECT_NE(report.status, Status::FalseClaim);
    if (reported_only) return;
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    EXPECT_LE(report.error.natural, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Solvers, GradientShared,
                         testing::Combine(testing::Values("spg", "apgd"), testing::ValuesIn(shared_names())),
                         [](const auto& test) {
                             std::string text = std::get<0>(test.param) + "_" + std::get<1>(test.param);
                             for (char& c : text)
                                 if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                             return text;
                         });

}  // namespace
}  // namespace delassus::gradient_test
