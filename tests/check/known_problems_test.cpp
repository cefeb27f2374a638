// SPDX-License-Identifier: BSD-3-Clause
// The problems with known answers are themselves right.
#include "check/known_problems.hpp"

#include <gtest/gtest.h>

#include <set>

#include "delassus/errors.hpp"
#include "delassus/needs.hpp"

namespace delassus::check::known_problems_test {
namespace {

void expect_solved(const KnownProblem& known) {
    SCOPED_TRACE(known.problem.name);
    const PreparedProblem problem(known.problem);
    const auto errors = ErrorMeter(problem).measure(known.solution.x, known.solution.lambda);
    EXPECT_LE(errors.natural, 1e-14);
    EXPECT_LE(errors.balance, 1e-14);
    EXPECT_LE(errors.cone, 1e-14);
    EXPECT_LE(errors.dual, 1e-14);
    EXPECT_LE(errors.gap, 1e-14);
}

TEST(KnownProblems, AreSolvedByTheirSolutions) {
    for (const auto& known : known_problems()) {
        expect_solved(known);
        for (const int k : {1, 7, 19}) expect_solved(known.with_right_hand_side(k));
        for (const double factor : {0.5, 3.0}) expect_solved(known.with_values(factor));
    }
    for (const auto& known : towers()) expect_solved(known);
}

TEST(KnownProblems, AreNotSolvedByNothing) {
    for (const auto& known : known_problems()) {
        if (known.problem.m() == 0) continue;
        SCOPED_TRACE(known.problem.name);
        const PreparedProblem problem(known.problem);
        const std::vector<double> x(known.problem.a.size()), lambda(known.problem.b.size());
        const auto errors = ErrorMeter(problem).measure(x, lambda);
        EXPECT_GT(errors.natural + errors.balance, 1e-2);
    }
}

TEST(KnownProblems, HaveNamesOfTheirOwn) {
    std::set<std::string> names;
    for (const auto& known : known_problems()) EXPECT_TRUE(names.insert(known.problem.name).second);
}

TEST(KnownProblems, NeedEveryCapability) {
    std::uint64_t needs = 0;
    for (const auto& known : known_problems()) needs |= PreparedProblem(known.problem).needs();
    needs |= DELASSUS_CAN_WARM_START | DELASSUS_CAN_DISTRIBUTED | DELASSUS_CAN_PARTITIONED;
    EXPECT_EQ(capability_names(needs), capability_names(~std::uint64_t{0}));
}

TEST(KnownProblems, AreWhatTheirNamesSay) {
    const std::pair<const char*, Structure> endings[] = {{"_diagonal", Structure::Diagonal},
                                                         {"_blocks", Structure::Blocks},
                                                         {"_definite", Structure::Definite},
                                                         {"free_semidefinite", Structure::Semidefinite},
                                                         {"free_indefinite", Structure::Indefinite},
                                                         {"free_unsymmetric", Structure::Unsymmetric},
                                                         {"_reduced", Structure::Reduced}};
    for (const auto& known : known_problems())
        for (const auto& [ending, structure] : endings)
            if (known.problem.name.ends_with(ending) && known.problem.name != "free_semidefinite_diagonal") {
                EXPECT_EQ(name_of(PreparedProblem(known.problem).structure()), name_of(structure))
                    << known.problem.name;
            }
}

/// From zero the first step ends at −u, here −r, of which the second block's tangential part alone is not zero, to the
/// bit.
TEST(KnownProblems, ApexBlocksBeginOnTheAxis) {
    int seen = 0;
    for (const auto& known : known_problems()) {
        if (!known.problem.name.starts_with("apex_friction")) continue;
        SCOPED_TRACE(known.problem.name);
        const Problem& problem = known.problem;
        std::vector<double> r = problem.b;
        if (problem.n() > 0) {
            std::vector<double> velocity = problem.a;
            for (std::size_t i = 0; i < velocity.size(); ++i) velocity[i] /= problem.H.value[i];
            problem.D.multiply_add(1.0, velocity.data(), r.data());
        }
        ASSERT_EQ(r.size(), 12u);
        for (std::size_t block = 0; block < 4; ++block)
            for (std::size_t i = 1; i < 3; ++i) EXPECT_EQ(r[3 * block + i] == 0.0, block != 1 || i != 1);
        EXPECT_GT(r[0], 0.0);
        EXPECT_EQ(r[6], 0.0);
        EXPECT_LT(r[9], 0.0);
        ++seen;
    }
    EXPECT_EQ(seen, 4);
}

TEST(KnownProblems, NewValuesKeepThePattern) {
    for (const auto& known : known_problems()) {
        if (known.problem.H.entries() + known.problem.E.entries() == 0) continue;
        const PreparedProblem first(known.problem), second(known.with_values(2.0).problem);
        EXPECT_EQ(first.raw().pattern_id, second.raw().pattern_id) << known.problem.name;
        EXPECT_NE(first.raw().values_id, second.raw().values_id) << known.problem.name;
    }
}

}  // namespace
}  // namespace delassus::check::known_problems_test
