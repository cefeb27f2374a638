// SPDX-License-Identifier: BSD-3-Clause
// Newton's method on the velocities: closed forms with compliance, both factors against the interior point, what it
// refuses, warm starts, and honest claims on problems from MuJoCo.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/solver.hpp"
#include "support/shared_problems.hpp"
#include "support/small_problems.hpp"
#include "support/solving.hpp"

namespace delassus::newton_test {
namespace {

using tests::diagonal_matrix;
using tests::infinity;
using tests::one_row;
using tests::point_on_plane;
using tests::to;

tests::Solved solve(const Problem& problem, double tolerance, const Solution* start = nullptr) {
    SolveSettings settings = to(tolerance);
    settings.warm_start = start != nullptr;
    return tests::solve_with("newton", problem, settings, {}, start ? *start : Solution{});
}

// m x = a + λ and u = x + e λ: where the row holds, λ = −(a/m)/(1/m + e).
TEST(Newton, YieldsByTheCompliance) {
    const double mass = 2.0, e = 0.25;
    const auto with_compliance = [&](double a, Cone cone) {
        Problem problem = one_row(mass, a, std::move(cone));
        problem.E = diagonal_matrix({e});
        return problem;
    };
    const double held = 6.0 / (1.0 + mass * e);
    const auto expect = [](const Problem& problem, double x, double lambda) {
        tests::expect_solution(solve(problem, 1e-12), {x}, {lambda}, 1e-11);
    };
    expect(with_compliance(-6.0, Cone::nonnegative(1)), -e * held, held);
    expect(with_compliance(6.0, Cone::nonnegative(1)), 3.0, 0.0);
    expect(with_compliance(6.0, Cone::free(1)), e * held, -held);
    expect(with_compliance(6.0, Cone::box({-1.0}, {2.0})), 2.5, -1.0);
    expect(with_compliance(-6.0, Cone::box({-1.0}, {2.0})), -2.0, 2.0);
    expect(with_compliance(-6.0, Cone::box({-1.0}, {infinity})), -e * held, held);
}

// A point of mass m on a plane with the compliance e in all rows: with M = 1/(1/m + e), λ is the projection of
// M (press, −push)/m onto the cone. The apex at a push away from the plane.
TEST(Newton, SticksSlidesAndOpens) {
    const double mass = 2.0, e = 0.125, mu = 0.5, scale = 1.0 / (1.0 + mass * e);
    const auto expect = [&](double press, double push, double friction, std::vector<double> lambda) {
        Problem problem = point_on_plane(mass, press, push, friction, Law::Associated);
        problem.E = diagonal_matrix({e, e, e});
        const std::vector<double> x = {(lambda[0] - press) / mass, (lambda[1] + push) / mass, 0.0};
        tests::expect_solution(solve(problem, 1e-12), x, lambda, 1e-11);
    };
    expect(6.0, 2.0, mu, {6.0 * scale, -2.0 * scale, 0.0});
    const double normal = scale * (6.0 + 5.0 * mu) / (1.0 + mu * mu);
    expect(6.0, 5.0, mu, {normal, -mu * normal, 0.0});
    expect(-6.0, 1.0, mu, {0.0, 0.0, 0.0});
    expect(6.0, 5.0, 0.0, {6.0 * scale, 0.0, 0.0});
}

/// Bodies of three freedoms in a row, each pressed against the ground and against its neighbours.
Problem bodies_in_a_row(std::int32_t count, bool shuffled, unsigned seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::vector<std::int32_t> place(static_cast<std::size_t>(count));
    for (std::int32_t k = 0; k < count; ++k) place[static_cast<std::size_t>(k)] = k;
    if (shuffled) std::shuffle(place.begin(), place.end(), generator);
    Problem problem;
    std::vector<Triplet> H, D;
    std::vector<double> E;
    for (std::int32_t i = 0; i < 3 * count; ++i) {
        H.push_back({i, i, 2.0 + uniform(generator)});
        problem.a.push_back(3.0 * uniform(generator));
    }
    const auto add = [&](Cone cone, std::int32_t first, std::int32_t second) {
        const double e = 0.02 * (1.5 + uniform(generator));
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const auto row = static_cast<std::int32_t>(problem.b.size());
            for (std::int32_t j = 0; j < 3; ++j) {
                D.push_back({row, 3 * first + j, (i == j ? 1.0 : 0.0) + 0.3 * uniform(generator)});
                if (second >= 0) D.push_back({row, 3 * second + j, (i == j ? -1.0 : 0.0) + 0.3 * uniform(generator)});
            }
            problem.b.push_back(0.5 * uniform(generator));
            E.push_back(i == 0 ? 2.0 * e : e);
        }
        problem.cones.push_back(std::move(cone));
    };
    for (std::int32_t k = 0; k < count; ++k) {
        const auto body = place[static_cast<std::size_t>(k)];
        add(Cone::friction(0.4), body, -1);
        if (k > 0) add(Cone::friction(0.7), body, place[static_cast<std::size_t>(k) - 1]);
        if (k % 3 == 0) add(Cone::friction(0.3, 2), body, -1);
        if (k % 4 == 0) add(Cone::nonnegative(1), body, -1);
        if (k % 5 == 0) add(Cone::box({-0.1}, {0.2}), body, -1);
        if (k % 7 == 0) add(Cone::free(2), body, -1);
    }
    const auto m = static_cast<std::int32_t>(problem.b.size());
    problem.H = SparseMatrix::from_triplets(3 * count, 3 * count, std::move(H));
    problem.D = SparseMatrix::from_triplets(m, 3 * count, std::move(D));
    problem.E = diagonal_matrix(E);
    problem.law = Law::Associated;
    return problem;
}

void expect_agreement(const Problem& problem) {
    const auto [ours, report] = solve(problem, 1e-12);
    EXPECT_EQ(report.status, Status::Solved) << report.message;
    EXPECT_LE(report.error.balance, 1e-12);
    EXPECT_LE(report.iterations, 30);
    const auto [other, other_report] = tests::solve_with("ipm", problem, to(1e-12));
    ASSERT_EQ(other_report.status, Status::Solved) << other_report.message;
    for (std::size_t i = 0; i < ours.x.size(); ++i) EXPECT_NEAR(ours.x[i], other.x[i], 1e-9) << i;
    for (std::size_t i = 0; i < ours.lambda.size(); ++i) EXPECT_NEAR(ours.lambda[i], other.lambda[i], 1e-8) << i;
}

TEST(Newton, AgreesWithTheInteriorPointByItsEnvelope) {
    for (const unsigned seed : {1U, 2U, 3U}) expect_agreement(bodies_in_a_row(12, false, seed));
}

// The order of the bodies makes the envelope large: fronts.
TEST(Newton, AgreesWithTheInteriorPointByFronts) {
    for (const unsigned seed : {4U, 5U}) expect_agreement(bodies_in_a_row(200, true, seed));
}

TEST(Newton, RefusesRowsWithoutFitCompliance) {
    const auto refusal = [](SparseMatrix E) {
        Problem problem = point_on_plane(1.0, 4.0, 2.0, 0.5, Law::Associated);
        problem.E = std::move(E);
        const Registry registry;
        return Solver(registry.load("newton"), {}, &registry).refusal(PreparedProblem(problem), {});
    };
    EXPECT_NE(refusal({}).find("E > 0, in every row"), std::string::npos);
    EXPECT_NE(refusal(diagonal_matrix({0.0, 0.1, 0.1})).find("E > 0, in every row"), std::string::npos);
    EXPECT_NE(refusal(diagonal_matrix({0.1, 0.1, 0.2})).find("both tangents"), std::string::npos);
    const auto coupled =
        SparseMatrix::from_triplets(3, 3, {{0, 0, 0.2}, {0, 1, 0.1}, {1, 0, 0.1}, {1, 1, 0.2}, {2, 2, 0.2}});
    EXPECT_NE(refusal(coupled).find("diagonal E"), std::string::npos);
    EXPECT_EQ(refusal(diagonal_matrix({0.3, 0.1, 0.1})), "");
}

TEST(Newton, StartsAtWhatItIsGiven) {
    const Problem problem = bodies_in_a_row(12, false, 6);
    const auto first = solve(problem, 1e-10);
    ASSERT_EQ(first.report.status, Status::Solved);
    EXPECT_GT(first.report.iterations, 1);
    const auto again = solve(problem, 1e-9, &first.solution);
    EXPECT_EQ(again.report.status, Status::Solved);
    EXPECT_EQ(again.report.iterations, 0);
}

// The path to the folder of robotics lies beside that of the other shared problems.
TEST(Newton, SolvesTheProblemsOfMujoco) {
    const auto root = tests::shared_problems_root().parent_path() / "problems-robotics";
    if (!std::filesystem::exists(root)) GTEST_SKIP() << "no problems in " << root;
    int solved = 0;
    for (const auto& entry : std::filesystem::directory_iterator(root)) {
        if (!std::filesystem::exists(entry.path() / "problem.json")) continue;
        const auto [solution, report] = solve(read_problem(entry.path()), 1e-10);
        EXPECT_EQ(report.status, Status::Solved) << entry.path() << ' ' << report.message;
        EXPECT_LE(std::max(report.error.natural, report.error.balance), 1.001e-10) << entry.path();
        ++solved;
    }
    EXPECT_EQ(solved, 31);
}

}  // namespace
}  // namespace delassus::newton_test
