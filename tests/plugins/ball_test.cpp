// SPDX-License-Identifier: BSD-3-Clause
// The kind of cone that only builds with DELASSUS_TEST_CONE have, from a problem folder to the report.
#ifdef DELASSUS_TEST_CONE
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "delassus/problem_files.hpp"
#include "delassus/qualification.hpp"
#include "support/run_command.hpp"
#include "support/solving.hpp"

namespace delassus::tests {
namespace {

Cone ball(double radius, std::int32_t rows) {
    return {ConeKind{4}, rows, {radius}, {}, {}};
}

/// Two masses of 2 in the plane, each with a friction that holds up to an impulse of 2. The one is pushed by 5 and
/// slides, the other by 1 and sticks. A third in space, of mass 1/2, is pushed by 6 against 3.
Problem three_pushes() {
    Problem problem;
    problem.H = diagonal_matrix({2, 2, 2, 2, 0.5, 0.5, 0.5});
    problem.D = identity(7);
    problem.a = {3, 4, 0.6, -0.8, 2, -4, 4};
    problem.b.assign(7, 0.0);
    problem.cones = {ball(2, 2), ball(2, 2), ball(3, 3)};
    return problem;
}
const std::vector<double> lambda = {-1.2, -1.6, -0.6, 0.8, -1, 2, -2}, x = {0.9, 1.2, 0, 0, 2, -4, 4};

TEST(Ball, GoesFromAFolderToTheReport) {
    const ScratchFolder scratch;
    write_problem(three_pushes(), scratch / "pushes");
    EXPECT_NE(text_of(scratch / "pushes/problem.json").find("\"radius\""), std::string::npos);
    const auto solved = run_command("solve " + (scratch / "pushes").string() +
                                    " --solver apgd --tolerance 1e-10 --json --solution " + (scratch / "s").string());
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
    const auto report = nlohmann::json::parse(solved.out);
    EXPECT_EQ(report["status"], "solved");
    for (const char* name : {"natural", "balance", "cone", "dual", "gap"})
        EXPECT_LE(report["error"][name], 1e-9) << name;
    const Solution solution = read_solution(scratch / "s", 7, 7);
    for (std::size_t i = 0; i < 7; ++i) {
        EXPECT_NEAR(solution.x[i], x[i], 1e-9) << i;
        EXPECT_NEAR(solution.lambda[i], lambda[i], 1e-9) << i;
    }
}

TEST(Ball, AnErrorIsSeen) {
    const PreparedProblem prepared(three_pushes());
    EXPECT_LE(prepared.meter().measure(x, lambda).natural, 1e-14);
    EXPECT_LE(prepared.meter().measure(x, lambda).gap, 1e-14);
    auto outside = lambda;
    outside[0] *= 1.5;
    EXPECT_GT(prepared.meter().measure(x, outside).cone, 1e-2);
    EXPECT_GT(prepared.meter().measure(x, outside).natural, 1e-2);
    auto inside = lambda;
    inside[0] = inside[1] = 0.0;
    EXPECT_EQ(prepared.meter().measure(x, inside).cone, 0.0);
    EXPECT_GT(prepared.meter().measure(x, inside).gap, 1e-2);
}

// Rows on a common body, so that the scaled blocks are coupled and their radii stand in different units.
TEST(Ball, SolvesACoupledProblem) {
    Problem problem = three_pushes();
    problem.D = SparseMatrix::from_triplets(7, 7,
                                            {{0, 0, 1},
                                             {0, 2, -1},
                                             {1, 1, 1},
                                             {1, 3, -1},
                                             {2, 2, 3},
                                             {3, 3, 3},
                                             {4, 4, 1},
                                             {4, 0, 2},
                                             {5, 5, 1},
                                             {6, 6, 0.1}});
    const auto solved = solve_with("apgd", problem, to(1e-10));
    EXPECT_EQ(solved.report.status, Status::Solved) << solved.report.message;
    EXPECT_LE(solved.report.error.natural, 1e-10);
    std::size_t row = 0;
    for (const Cone& cone : problem.cones) {
        double square = 0.0;
        for (std::int32_t i = 0; i < cone.rows; ++i, ++row)
            square += solved.solution.lambda[row] * solved.solution.lambda[row];
        EXPECT_LE(std::sqrt(square), cone.parameters[0] * (1.0 + 1e-12));
    }
}

TEST(Ball, IsRefusedByWhoDoesNotKnowIt) {
    try {
        static_cast<void>(solve_with("pgs", three_pushes(), to(1e-8)));
        FAIL() << "pgs took it";
    } catch (const std::exception& refusal) {
        EXPECT_NE(std::string(refusal.what()).find("3 balls"), std::string::npos) << refusal.what();
    }
}

TEST(Ball, HasNoDirectionWithoutBound) {
    const Registry registry;
    const auto found = qualify(three_pushes(), registry);
    EXPECT_EQ(found.pointed, Answer::Yes);
}

}  // namespace
}  // namespace delassus::tests
#endif
