// SPDX-License-Identifier: BSD-3-Clause
// Solving by a plugin's name, and problems with known answers for every kind of row.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "delassus/solver.hpp"
#include "support/small_problems.hpp"

namespace delassus::tests {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

inline bool is_built(const std::string& name) {
    const Registry registry;
    return std::ranges::any_of(registry.plugins(), [&](const PluginInfo& info) { return info.name == name; });
}

struct Solved {
    Solution solution;
    SolveReport report;
};

inline SolveSettings to(double tolerance, std::int64_t max_iterations = SolveSettings{}.max_iterations) {
    SolveSettings settings;
    settings.tolerance = tolerance;
    settings.max_iterations = max_iterations;
    return settings;
}

inline Solved solve_with(const std::string& name, const Problem& problem, const SolveSettings& settings,
                         OptionTexts options = {}, Solution start = {}) {
    const Registry registry;
    const PreparedProblem prepared(problem);
    Solver solver(registry.load(name), std::move(options), &registry);
    Solved result{std::move(start), {}};
    result.report = solver.solve(prepared, result.solution, settings);
    return result;
}

/// Solved, with these values up to the accuracy. note: what else a failure should say.
inline void expect_solution(const Solved& solved, const std::vector<double>& x, const std::vector<double>& lambda,
                            double accuracy = 1e-9, const std::string& note = {}) {
    EXPECT_EQ(solved.report.status, Status::Solved) << note << ' ' << solved.report.message;
    ASSERT_EQ(solved.solution.x.size(), x.size());
    ASSERT_EQ(solved.solution.lambda.size(), lambda.size());
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(solved.solution.x[i], x[i], accuracy) << note << " x " << i;
    for (std::size_t i = 0; i < lambda.size(); ++i)
        EXPECT_NEAR(solved.solution.lambda[i], lambda[i], accuracy) << note << " λ " << i;
}

/// A mass that is pushed by a against one row of a cone.
inline Problem one_row(double mass, double a, Cone cone) {
    Problem problem;
    problem.H = diagonal_matrix({mass});
    problem.D = identity(1);
    problem.a = {a};
    problem.b = {0.0};
    problem.cones = {std::move(cone)};
    return problem;
}

struct KnownAnswer {
    Problem problem;
    std::vector<double> x, lambda;
};

/// Free, nonnegative and box rows.
inline std::vector<KnownAnswer> known_answers_of_rows() {
    return {{tied_masses(), {1.0, 1.0}, {-3.0}},
            {one_row(2.0, -6.0, Cone::nonnegative(1)), {0.0}, {6.0}},
            {one_row(2.0, 6.0, Cone::nonnegative(1)), {3.0}, {0.0}},
            {one_row(2.0, 5.0, Cone::box({-1.0}, {2.0})), {2.0}, {-1.0}},
            {one_row(2.0, -5.0, Cone::box({-1.0}, {2.0})), {-1.5}, {2.0}},
            {one_row(2.0, 0.5, Cone::box({-1.0}, {2.0})), {0.0}, {-0.5}},
            {one_row(2.0, -5.0, Cone::box({-1.0}, {infinity})), {0.0}, {5.0}},
            {one_row(2.0, 5.0, Cone::box({-infinity}, {infinity})), {0.0}, {-5.0}},
            {one_row(2.0, 5.0, Cone::box({1.0}, {1.0})), {3.0}, {1.0}}};
}

/// A point on a plane that sticks, slides, opens, and slides without friction, by the associated law.
inline std::vector<KnownAnswer> known_answers_of_associated_friction() {
    const double mu = 0.5, s = (6.0 + 5.0 * mu) / (1.0 + mu * mu);
    return {{point_on_plane(2.0, 6.0, 2.0, mu, Law::Associated), {0.0, 0.0, 0.0}, {6.0, -2.0, 0.0}},
            {point_on_plane(2.0, 6.0, 5.0, mu, Law::Associated),
             {(s - 6.0) / 2.0, (5.0 - mu * s) / 2.0, 0.0},
             {s, -mu * s, 0.0}},
            {point_on_plane(2.0, -6.0, 1.0, mu, Law::Associated), {3.0, 0.5, 0.0}, {0.0, 0.0, 0.0}},
            {point_on_plane(2.0, 6.0, 5.0, 0.0, Law::Associated), {0.0, 2.5, 0.0}, {6.0, 0.0, 0.0}}};
}

}  // namespace delassus::tests
