// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "delassus/error.hpp"
#include "delassus/problem.hpp"
#include "support/problem_equality.hpp"

namespace delassus::tests::validate_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

SparseMatrix matrix(std::int32_t rows, std::int32_t columns, std::vector<Triplet> triplets) {
    return SparseMatrix::from_triplets(rows, columns, std::move(triplets));
}

/// n = 2, m = 4: one friction cone and one box row.
Problem valid() {
    Problem problem;
    problem.name = "example";
    problem.H = matrix(2, 2, {{0, 0, 2.0}, {0, 1, 0.5}, {1, 0, 0.5}, {1, 1, 2.0}});
    problem.D = matrix(4, 2, {{0, 0, 1.0}, {1, 1, 1.0}, {3, 0, -1.0}});
    problem.E = matrix(4, 4, {{0, 0, 1.0}, {0, 3, 0.5}, {3, 0, 0.5}, {3, 3, 1.0}});
    problem.a = {1.0, 2.0};
    problem.b = {0.0, 0.0, 0.0, 1.0};
    problem.cones = {Cone::friction(0.5), Cone::box({-1.0}, {infinity})};
    return problem;
}

TEST(Validate, AcceptsWhatIsValid) {
    EXPECT_NO_THROW(validate(valid()));
    EXPECT_NO_THROW(validate(Problem{}));  // n = m = 0
    Problem unconstrained = valid();
    unconstrained.D = unconstrained.E = SparseMatrix();
    unconstrained.b.clear();
    unconstrained.cones.clear();
    EXPECT_NO_THROW(validate(unconstrained));
    Problem reduced = valid();
    reduced.H = reduced.D = SparseMatrix();
    reduced.a.clear();
    EXPECT_NO_THROW(validate(reduced));
    reduced.D = SparseMatrix::zero(4, 0);
    EXPECT_NO_THROW(validate(reduced));
    Problem planar = valid();
    planar.cones = {Cone::friction(0.0, 2), Cone::nonnegative(1), Cone::free(1)};
    EXPECT_NO_THROW(validate(planar));
}

TEST(Validate, TakesRoundingForSymmetric) {
    Problem problem = valid();
    problem.E.value[1] *= 1 + 1e-12;
    problem.H.value[1] *= 1 + 1e-12;
    EXPECT_NO_THROW(validate(problem));
}

TEST(Validate, AnUnsymmetricHGoesWithFreeRowsOnly) {
    Problem problem = valid();
    problem.H.value[1] = 0.75;
    expect_sentence(sentence_of<InputError>([&] { validate(problem); }), "example|H is not symmetric|free rows");
    problem.cones = {Cone::free(4)};
    EXPECT_NO_THROW(validate(problem));
}

struct Refusal {
    const char* name;
    std::function<void(Problem&)> spoil;
    const char* words;
};

class ValidateRefuses : public testing::TestWithParam<Refusal> {};

TEST_P(ValidateRefuses, InOneSentence) {
    Problem problem = valid();
    GetParam().spoil(problem);
    expect_sentence(sentence_of<InputError>([&] { validate(problem); }), GetParam().words);
}

const Refusal refusals[] = {
    {"HOfWrongShape", [](Problem& p) { p.H = SparseMatrix::zero(3, 3); }, "H is 3 × 3|2 × 2"},
    {"HAbsent", [](Problem& p) { p.H = SparseMatrix(); }, "H is absent|2"},
    {"DOfWrongShape", [](Problem& p) { p.D = SparseMatrix::zero(4, 3); }, "D is 4 × 3|4 × 2"},
    {"DWithoutVelocities",
     [](Problem& p) {
         p.H = SparseMatrix();
         p.a.clear();
     },
     "D is 4 × 2|4 × 0"},
    {"EOfWrongShape", [](Problem& p) { p.E = SparseMatrix::zero(4, 5); }, "E is 4 × 5|4 × 4"},
    {"AShort", [](Problem& p) { p.a.pop_back(); }, "H is 2 × 2|1 × 1"},
    {"BNotCovered", [](Problem& p) { p.b.push_back(0.0), p.D = p.E = SparseMatrix(); }, "cones cover 4 rows|5"},
    {"ConesBeyondB", [](Problem& p) { p.cones.push_back(Cone::free(1)); }, "cones cover 5 rows|4"},
    {"NanInA", [](Problem& p) { p.a[1] = not_a_number; }, "a[1] is nan|finite"},
    {"InfinityInB", [](Problem& p) { p.b[2] = infinity; }, "b[2] is inf|finite"},
    {"NanInH", [](Problem& p) { p.H.value[3] = not_a_number; }, "H(1, 1) is nan"},
    {"InfinityInD", [](Problem& p) { p.D.value[1] = -infinity; }, "D(1, 1) is -inf"},
    {"NanInE", [](Problem& p) { p.E.value[0] = not_a_number; }, "E(0, 0) is nan"},
    {"NegativeMu", [](Problem& p) { p.cones[0].parameters[0] = -0.1; }, "cone 0|friction coefficient -0.1"},
    {"NanMu", [](Problem& p) { p.cones[0].parameters[0] = not_a_number; }, "cone 0|friction coefficient nan"},
    {"InfiniteMu", [](Problem& p) { p.cones[0].parameters[0] = infinity; }, "cone 0|at most 10000"},
    {"HugeMu", [](Problem& p) { p.cones[0].parameters[0] = 1e10; },
     "cone 0|friction coefficient 10000000000|at most 10000"},
    {"FrictionOfFourRows", [](Problem& p) { p.cones = {Cone::friction(0.5, 4)}; }, "cone 0|4 rows|3, or 2"},
    {"EmptyCone", [](Problem& p) { p.cones.push_back(Cone::nonnegative(0)); }, "cone 2 has 0 rows"},
    {"NegativeRows", [](Problem& p) { p.cones.push_back(Cone::free(-1)); }, "cone 2 has -1 rows"},
    {"UnknownKind", [](Problem& p) { p.cones[1].kind = static_cast<ConeKind>(9); }, "kind number 9"},
    {"UnknownLaw", [](Problem& p) { p.law = static_cast<Law>(7); }, "law|7"},
    {"BoxTurned", [](Problem& p) { p.cones[1] = Cone::box({2.0}, {1.0}); }, "cone 1|lo = 2|hi = 1|lo <= hi"},
    {"BoxWithNan", [](Problem& p) { p.cones[1].lo[0] = not_a_number; }, "cone 1|lo = nan"},
    {"BoxAtInfinity", [](Problem& p) { p.cones[1].lo[0] = infinity; }, "cone 1|lo = inf"},
    {"BoxWithoutUpperBounds", [](Problem& p) { p.cones[1].hi.clear(); }, "cone 1|0 upper bounds|1 of each"},
    {"BoundsOnFriction", [](Problem& p) { p.cones[0].lo = {0.0}; }, "cone 0|1 lower|0 of each"},
    {"UnsortedColumns", [](Problem& p) { std::swap(p.H.column[0], p.H.column[1]); }, "row 0 of H|ascend"},
    {"RepeatedColumn", [](Problem& p) { p.H.column[1] = 0; }, "row 0 of H|not repeat"},
    {"ColumnOutside", [](Problem& p) { p.D.column[2] = 2; }, "row 3 of D|column 2|0 to 1"},
    {"NegativeColumn", [](Problem& p) { p.D.column[0] = -1; }, "row 0 of D|column -1"},
    {"RowStartShort", [](Problem& p) { p.D.row_start.pop_back(); }, "D.row_start has 4 positions|5"},
    {"RowStartDescends",
     [](Problem& p) {
         p.D.row_start = {0, 9, 2, 2, 3};
     },
     "D.row_start descends at row 1"},
    {"RowStartBeyondEntries", [](Problem& p) { p.D.row_start.back() = 8; }, "D.row_start goes from 0 to 8|3"},
    {"ValuesWithoutColumns", [](Problem& p) { p.H.column.pop_back(); }, "H has 3 columns and 4 values"},
    {"EUnsymmetric", [](Problem& p) { p.E.value[1] = 0.6; }, "E is not symmetric|E(0, 3)|1.0e-01"},
    {"EOneSided",
     [](Problem& p) {
         p.E = matrix(4, 4, {{2, 1, 1.0}});
     },
     "E is not symmetric"},
    {"ENegative", [](Problem& p) { p.E.value[3] = -1.0; }, "E(3, 3) is -1|semidefinite"},
};

INSTANTIATE_TEST_SUITE_P(All, ValidateRefuses, testing::ValuesIn(refusals),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace delassus::tests::validate_test
