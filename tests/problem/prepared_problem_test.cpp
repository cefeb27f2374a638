// SPDX-License-Identifier: BSD-3-Clause
// A prepared problem that is renewed with another is as one prepared from it, whatever it keeps.
#include <gtest/gtest.h>

#include "delassus/errors.hpp"
#include "delassus/generate.hpp"
#include "delassus/needs.hpp"

namespace delassus::prepared_problem_test {
namespace {

void expect_same(const PreparedProblem& renewed, const Problem& problem) {
    const PreparedProblem fresh(problem);
    EXPECT_EQ(renewed.structure(), fresh.structure());
    EXPECT_EQ(renewed.needs(), fresh.needs());
    const std::vector<double> x(static_cast<std::size_t>(problem.n()), 0.5);
    const std::vector<double> lambda(static_cast<std::size_t>(problem.m()), 0.1);
    const Errors here = ErrorMeter(renewed).measure(x, lambda), there = ErrorMeter(fresh).measure(x, lambda);
    EXPECT_EQ(here.natural, there.natural);
    EXPECT_EQ(here.balance, there.balance);
    EXPECT_EQ(renewed.meter().measure(x, lambda).natural, there.natural);
}

/// The problem without the last `count` of its cones.
Problem without_last(Problem problem, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
        problem.D.rows -= problem.cones.back().rows;
        problem.cones.pop_back();
    }
    const auto rows = static_cast<std::size_t>(problem.D.rows);
    problem.D.row_start.resize(rows + 1);
    problem.D.column.resize(static_cast<std::size_t>(problem.D.row_start.back()));
    problem.D.value.resize(problem.D.column.size());
    problem.b.resize(rows);
    return problem;
}

TEST(RenewedProblem, IsAsOneMadeAnew) {
    ElasticBlockParameters parameters;
    const Problem first = generate_elastic_block(parameters);
    PreparedProblem prepared(first);
    static_cast<void>(prepared.meter());
    // Contacts go, with H as it was and with new values in its places.
    const Problem fewer = without_last(first, 2);
    prepared.renew(fewer);
    expect_same(prepared, fewer);
    Problem stiffer = without_last(first, 3);
    for (double& value : stiffer.H.value) value *= 2.0;
    prepared.renew(stiffer);
    expect_same(prepared, stiffer);
    // They come back, and then another system altogether takes the place.
    prepared.renew(first);
    expect_same(prepared, first);
    const Problem stack = generate_box_stack({});
    prepared.renew(stack);
    expect_same(prepared, stack);
    prepared.renew(first);
    expect_same(prepared, first);
}

}  // namespace
}  // namespace delassus::prepared_problem_test
