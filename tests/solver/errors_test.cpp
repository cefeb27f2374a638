// SPDX-License-Identifier: BSD-3-Clause
// The error measures: zero at known solutions, independent of units, and equal to their formulas elsewhere.
#include "delassus/errors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "support/places.hpp"
#include "support/small_problems.hpp"

namespace delassus::errors_test {
namespace {

using tests::point_on_plane;

void expect_zero(const Errors& errors, double tolerance) {
    EXPECT_LE(errors.natural, tolerance);
    EXPECT_LE(errors.siconos, tolerance);
    EXPECT_LE(errors.balance, tolerance);
    EXPECT_LE(errors.cone, tolerance);
    EXPECT_LE(errors.dual, tolerance);
    EXPECT_LE(errors.gap, tolerance);
}

// docs/errors.md lists the measures of the table, row by row.
TEST(Errors, AreDocumentedAsTheirTableSays) {
    std::ifstream file(std::string(tests::places::source) + "/docs/errors.md");
    std::stringstream text;
    text << file.rdbuf();
    std::set<std::string_view> names;
    for (const ErrorMeasure& measure : error_measures) {
        EXPECT_TRUE(names.insert(measure.name).second) << measure.name;
        const std::string formula(measure.formula);
        std::string cell;  // within a table, | is escaped
        for (const char c : formula) cell += c == '|' ? "\\|" : std::string(1, c);
        const std::string row = "\n| `" + std::string(measure.name) + "` | " + cell + " | " +
                                std::string(measure.note) + (measure.note.empty() ? "|\n" : " |\n");
        const std::string wanted = measure.is_error ? row : "`" + std::string(measure.name) + "` stands beside them";
        EXPECT_NE(text.str().find(wanted), std::string::npos) << wanted;
        EXPECT_TRUE(measure.is_error || text.str().find(formula) != std::string::npos) << formula;
    }
}

TEST(Errors, VanishForASlidingPointUnderExactCoulomb) {
    // m = 2, pressed by 6, pushed by 5 at μ = 0.5: λ = (6, −3, 0), v_t = (5 − 3)/2 = 1.
    const PreparedProblem problem(point_on_plane(2.0, 6.0, 5.0, 0.5, Law::Coulomb));
    const std::vector<double> x = {0.0, 1.0, 0.0}, lambda = {6.0, -3.0, 0.0};
    expect_zero(ErrorMeter(problem).measure(x, lambda), 1e-15);
}

TEST(Errors, AssociatedLawWantsTheSlidingPointToLiftOff) {
    // The convex law has u_n = μ‖u_t‖ while sliding: with λ = s (1, −μ, 0), u = (s − 6, 5 − μ s)/m and u_n = μ u_t give
    // s = (6 + 5 μ)/(1 + μ²).
    const double mu = 0.5, s = (6.0 + 5.0 * mu) / (1.0 + mu * mu);
    const PreparedProblem problem(point_on_plane(2.0, 6.0, 5.0, mu, Law::Associated));
    const std::vector<double> lambda = {s, -mu * s, 0.0}, x = {(s - 6.0) / 2.0, (5.0 - mu * s) / 2.0, 0.0};
    const ErrorMeter meter(problem);
    expect_zero(meter.measure(x, lambda), 1e-15);
    const PreparedProblem coulomb(point_on_plane(2.0, 6.0, 5.0, mu, Law::Coulomb));
    EXPECT_GT(ErrorMeter(coulomb).measure(x, lambda).natural, 0.05);
}

TEST(Errors, NaturalEqualsItsFormula) {
    // One nonnegative row: N = 1/m, s² = m, r = −press/m. At λ = 0: u = r, ‖S⁻¹(0 − P(−s² u))‖ = press/√m = ‖S r‖.
    Problem data;
    data.H = tests::diagonal_matrix({4.0});
    data.D = tests::identity(1);
    data.a = {-8.0};
    data.b = {0.0};
    data.cones = {Cone::nonnegative(1)};
    const PreparedProblem problem(data);
    const ErrorMeter meter(problem);
    EXPECT_DOUBLE_EQ(meter.natural(nullptr, std::vector<double>{0.0}.data()), 1.0);
    // Halfway, λ = 4: u = −1, s²u = −4: λ − P(λ + 4) = −4, /s = 2, over ‖S r‖ = 4.
    EXPECT_DOUBLE_EQ(meter.natural(nullptr, std::vector<double>{4.0}.data()), 0.5);
    EXPECT_DOUBLE_EQ(meter.measure(std::vector<double>{-1.0}, std::vector<double>{4.0}).balance, 0.0);
    EXPECT_DOUBLE_EQ(meter.measure(std::vector<double>{-1.0}, std::vector<double>{4.0}).gap, 4.0 / 16.0);
    // |D||x| = 1 and λ = 4: ε (s + 4/s) / ‖S r‖ = ε.
    EXPECT_DOUBLE_EQ(meter.measure(std::vector<double>{-1.0}, std::vector<double>{4.0}).rounding, 0x1p-53);
}

TEST(Errors, LinearProblemsHaveTheScaledResidual) {
    const PreparedProblem problem(tests::tied_masses());
    const ErrorMeter meter(problem);
    const std::vector<double> x = {1.0, 1.0}, lambda = {-3.0};
    expect_zero(meter.measure(x, lambda), 1e-15);
    EXPECT_DOUBLE_EQ(meter.natural(std::vector<double>{3.0, 1.0}.data(), lambda.data()), 2.0 / 4.0);
}

TEST(Errors, DoNotDependOnUnits) {
    // Lengths × L and masses × M scale x by L, λ and a by M L, D by 1 (rows are directions), b by L.
    const double L = 1e6, M = 1e-7;
    Problem small = point_on_plane(2.0, 6.0, 5.0, 0.5, Law::Coulomb);
    Problem scaled = small;
    for (double& value : scaled.H.value) value *= M;
    for (double& value : scaled.a) value *= M * L;
    std::vector<double> x = {-0.2, 0.9, -0.1}, lambda = {5.0, -2.0, 0.3};
    const PreparedProblem first(small), second(scaled);
    const Errors before = ErrorMeter(first).measure(x, lambda);
    for (double& value : x) value *= L;
    for (double& value : lambda) value *= M * L;
    const Errors after = ErrorMeter(second).measure(x, lambda);
    EXPECT_NEAR(before.natural / after.natural, 1.0, 1e-12);
    EXPECT_NEAR(before.balance / after.balance, 1.0, 1e-12);
    EXPECT_NEAR(before.dual / after.dual, 1.0, 1e-12);
    EXPECT_NEAR(before.gap / after.gap, 1.0, 1e-12);
    EXPECT_GT(std::abs(before.siconos / after.siconos - 1.0), 0.5) << "this measure adds impulses to velocities";
}

TEST(Errors, VelocityIsMeasuredInTheEnergyNorm) {
    const PreparedProblem problem(tests::tied_masses());
    const ErrorMeter meter(problem);
    const std::vector<double> reference = {1.0, 1.0}, x = {1.0, 2.0};
    EXPECT_DOUBLE_EQ(meter.velocity(x, reference), std::sqrt(3.0 / 4.0));
}

TEST(Errors, VelocityAtRestIsRelativeToTheFreeVelocity) {
    const PreparedProblem problem(point_on_plane(2.0, 6.0, 1.0, 0.5, Law::Coulomb));
    const std::vector<double> rest = {0.0, 0.0, 0.0}, x = {0.0, 0.001, 0.0};
    // Without reactions x = a/m, and ‖a/m‖_H = ‖a‖/√m.
    EXPECT_NEAR(ErrorMeter(problem).velocity(x, rest), 0.001 * 2.0 / std::sqrt(37.0), 1e-15);
}

TEST(Structure, IsDetectedFromTheValues) {
    const auto structure_of = [](std::int32_t n, std::vector<Triplet> triplets) {
        Problem problem;
        problem.H = SparseMatrix::from_triplets(n, n, std::move(triplets));
        problem.a.assign(static_cast<std::size_t>(n), 0.0);
        return PreparedProblem(problem).structure();
    };
    EXPECT_EQ(structure_of(2, {{0, 0, 1.0}, {1, 1, 1e-9}}), Structure::Diagonal);
    EXPECT_EQ(structure_of(2, {{0, 0, 1.0}}), Structure::Semidefinite);
    EXPECT_EQ(structure_of(2, {{0, 0, 1.0}, {1, 1, -1.0}}), Structure::Indefinite);
    EXPECT_EQ(structure_of(2, {{0, 0, 2.0}, {0, 1, 1.0}, {1, 0, 1.0}, {1, 1, 2.0}}), Structure::Blocks);
    EXPECT_EQ(structure_of(2, {{0, 0, 1.0}, {0, 1, 1.0}, {1, 0, 1.0}, {1, 1, 1.0}}), Structure::Semidefinite);
    EXPECT_EQ(structure_of(2, {{0, 0, 1.0}, {0, 1, 2.0}, {1, 0, 2.0}, {1, 1, 1.0}}), Structure::Indefinite);
    EXPECT_EQ(structure_of(2, {{0, 0, 1.0}, {0, 1, 2.0}, {1, 1, 1.0}}), Structure::Unsymmetric);

    // A spring chain of 40: definite when an end is held, semidefinite when it floats.
    std::vector<Triplet> chain;
    for (std::int32_t i = 0; i < 39; ++i) {
        chain.push_back({i, i, 1.0});
        chain.push_back({i + 1, i + 1, 1.0});
        chain.push_back({i, i + 1, -1.0});
        chain.push_back({i + 1, i, -1.0});
    }
    EXPECT_EQ(structure_of(40, chain), Structure::Semidefinite);
    chain.push_back({0, 0, 1.0});
    EXPECT_EQ(structure_of(40, chain), Structure::Definite);
    EXPECT_EQ(PreparedProblem(Problem{}).structure(), Structure::Reduced);
}

TEST(Needs, ComeFromTheProblem) {
    const PreparedProblem slide(point_on_plane(1.0, 1.0, 1.0, 0.5, Law::Coulomb));
    EXPECT_EQ(slide.needs(), DELASSUS_CAN_FRICTION | DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL);
    Problem twice = tests::tied_masses();
    twice.D = SparseMatrix::from_triplets(2, 2, {{0, 0, 1.0}, {0, 1, -1.0}, {1, 0, -2.0}, {1, 1, 2.0}});
    twice.b = {0.0, 0.0};
    twice.cones = {Cone::free(2)};
    EXPECT_EQ(PreparedProblem(twice).needs(), DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_REDUNDANT);
    twice.E = tests::identity(2);
    EXPECT_EQ(PreparedProblem(twice).needs(), DELASSUS_CAN_FREE | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_COMPLIANCE);
}

TEST(Identity, TellsPatternsFromValues) {
    Problem data = tests::tied_masses();
    const PreparedProblem first(data);
    data.a = {9.0, 9.0};
    EXPECT_EQ(PreparedProblem(data).raw().values_id, first.raw().values_id);
    data.H.value[0] = 2.0;
    const PreparedProblem heavier(data);
    EXPECT_EQ(heavier.raw().pattern_id, first.raw().pattern_id);
    EXPECT_NE(heavier.raw().values_id, first.raw().values_id);
    data.cones = {Cone::nonnegative(1)};
    EXPECT_NE(PreparedProblem(data).raw().pattern_id, first.raw().pattern_id);
}

/// Two masses tied by rows with these entries.
Problem masses_with_rows(const std::vector<Triplet>& entries, std::vector<Cone> cones) {
    Problem problem = tests::tied_masses();
    problem.b.clear();
    for (const Cone& cone : cones) problem.b.resize(problem.b.size() + static_cast<std::size_t>(cone.rows), 0.5);
    problem.D = SparseMatrix::from_triplets(problem.m(), 2, entries);
    problem.cones = std::move(cones);
    return problem;
}

// S² is the mass that a row feels: 1/(1/m₁ + 1/m₂) between two bodies, whatever the heavier one weighs.
TEST(Meter, NormInRowsIsThatOfTheMassesThatRowsFeel) {
    Problem data =
        masses_with_rows({{0, 0, 1.0}, {0, 1, -1.0}, {1, 1, 1.0}}, {Cone::nonnegative(1), Cone::nonnegative(1)});
    data.H.value = {2.0, 1e9};
    const PreparedProblem prepared(data);
    const double between = 1.0 / (1.0 / 2.0 + 1.0 / 1e9);
    EXPECT_NEAR(prepared.meter().norm_in_rows(std::vector<double>{0.3, 0.1}),
                std::sqrt(between * 0.2 * 0.2 + 1e9 * 0.1 * 0.1), 1e-9);
    EXPECT_NEAR(prepared.meter().norm_in_rows(std::vector<double>{0.3, 0.0}), std::sqrt(between) * 0.3, 1e-15);
    EXPECT_THROW(static_cast<void>(prepared.meter().norm_in_rows(std::vector<double>{1.0})), InputError);
}

// Rows come, go and change kind while H stays: a renewed problem is judged, and says what it needs, as a new one does.
TEST(Renewal, EqualsANewProblem) {
    std::vector<Problem> sequence = {
        masses_with_rows({{0, 0, 1.0}, {0, 1, -1.0}}, {Cone::free(1)}),
        masses_with_rows({{0, 0, 2.0}, {0, 1, -1.0}}, {Cone::free(1)}),
        masses_with_rows({{0, 0, 2.0}, {1, 1, -1.0}}, {Cone::nonnegative(2)}),
        masses_with_rows({{0, 0, 2.0}, {0, 1, 1.0}, {1, 0, -4.0}, {1, 1, -2.0}}, {Cone::free(1), Cone::free(1)}),
        masses_with_rows({{0, 0, 1.0}, {1, 1, 1.0}, {2, 0, 1.0}}, {Cone::free(1), Cone::friction(0.3, 2)}),
        masses_with_rows({}, {}),
        masses_with_rows({{0, 1, 1.0}}, {Cone::box({-1.0}, {2.0})})};
    sequence.push_back(sequence[1]);
    sequence.back().E = tests::identity(1);
    sequence.push_back(sequence[1]);
    sequence.back().H.value[1] = 5.0;
    PreparedProblem kept(sequence[0]);
    std::set<std::uint64_t> values = {kept.raw().values_id};
    for (std::size_t k = 0; k < sequence.size(); ++k) {
        kept.renew(sequence[k]);
        if (k > 0) {
            EXPECT_TRUE(values.insert(kept.raw().values_id).second) << k;
        }
        const PreparedProblem fresh(sequence[k]);
        EXPECT_EQ(kept.needs(), fresh.needs()) << k;
        EXPECT_EQ(kept.structure(), fresh.structure()) << k;
        EXPECT_EQ(kept.raw().m, fresh.raw().m) << k;
        const std::vector<double> x = {0.3, -0.7}, lambda(sequence[k].b.size(), 0.9);
        const Errors here = kept.meter().measure(x, lambda), there = ErrorMeter(fresh).measure(x, lambda);
        EXPECT_DOUBLE_EQ(here.natural, there.natural) << k;
        EXPECT_DOUBLE_EQ(here.balance, there.balance) << k;
        EXPECT_DOUBLE_EQ(here.gap, there.gap) << k;
        EXPECT_DOUBLE_EQ(here.rounding, there.rounding) << k;
    }
}

TEST(Renewal, KeepsItsIdentityWithItsValues) {
    Problem data = tests::tied_masses();
    PreparedProblem kept(data);
    const auto pattern = kept.raw().pattern_id, values = kept.raw().values_id;
    data.a = {9.0, 9.0};
    kept.renew(data);
    EXPECT_EQ(kept.raw().values_id, values);
    data.D.value[0] = 7.0;
    kept.renew(data);
    EXPECT_NE(kept.raw().values_id, values);
    EXPECT_EQ(kept.raw().pattern_id, pattern);
}

TEST(Renewal, RefusesWhatIsNotFiniteAndStaysAsItWas) {
    Problem data = tests::tied_masses();
    PreparedProblem kept(data);
    const double before = data.D.value[0];
    data.D.value[0] = std::nan("");
    EXPECT_THROW(kept.renew(data), InputError);
    EXPECT_EQ(kept.problem().D.value[0], before);
}

// A meter's own sums tell of values that are not finite, and are not deceived by finite ones that overflow in them.
TEST(Renewal, RefusesWhatIsNotFiniteWithAMeter) {
    const Problem first = masses_with_rows({{0, 0, 1.0}, {1, 1, 1.0}}, {Cone::nonnegative(2)});
    PreparedProblem kept(first);
    const std::vector<double> x = {0.3, -0.7}, lambda = {0.9, 0.1};
    const double natural = kept.meter().measure(x, lambda).natural;
    Problem bad = first;
    for (double* value : {&bad.D.value[1], &bad.b[0], &bad.a[1]}) {
        for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
            const double right = std::exchange(*value, wrong);
            EXPECT_THROW(kept.renew(bad), InputError);
            *value = right;
            EXPECT_EQ(kept.problem().D.value, first.D.value);
            EXPECT_EQ(kept.problem().b, first.b);
            EXPECT_EQ(kept.meter().measure(x, lambda).natural, natural);
        }
    }
    Problem large = first;
    large.D.value[1] = 1e200;
    EXPECT_NO_THROW(kept.renew(large));
    EXPECT_EQ(kept.problem().D.value, large.D.value);
    kept.renew(first);
    EXPECT_EQ(kept.meter().measure(x, lambda).natural, natural);
}

TEST(Renewal, LeavesTheFormerArrays) {
    const Problem first = masses_with_rows({{0, 0, 1.0}, {1, 1, 1.0}}, {Cone::nonnegative(2)});
    Problem second = first;
    second.D.value = {2.0, 3.0};
    PreparedProblem kept(first);
    kept.renew(std::move(second));
    EXPECT_EQ(kept.problem().D.value, (std::vector<double>{2.0, 3.0}));
    EXPECT_EQ(second.D.value, first.D.value);  // NOLINT: what is left is part of the promise
    EXPECT_EQ(second.E.rows, 0);
}

TEST(Renewal, KeepsWhereBoundsStand) {
    const Problem first = masses_with_rows({{0, 0, 1.0}, {1, 1, 1.0}}, {Cone::free(1), Cone::box({-1.0}, {2.0})});
    Problem second = first;
    second.cones[1] = Cone::box({-3.0}, {4.0});
    PreparedProblem kept(first);
    const double *lo = kept.raw().cones[1].lo, *hi = kept.raw().cones[1].hi;
    kept.renew(std::move(second));
    EXPECT_EQ(kept.raw().cones[1].lo, lo);
    EXPECT_EQ(kept.raw().cones[1].hi, hi);
    EXPECT_EQ(*lo, -3.0);
    EXPECT_EQ(*hi, 4.0);
}

// Contacts of two bodies and of one go through passes of their own; natural() goes through plain products.
TEST(Errors, OfAPileAreThoseOfPlainProducts) {
    for (const Law law : {Law::Associated, Law::Coulomb}) {
        Problem pile = generate_sphere_pile({});
        pile.law = law;
        PreparedProblem problem(pile);
        std::vector<double> x(pile.a.size()), lambda(pile.b.size());
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(static_cast<double>(i));
        for (std::size_t i = 0; i < lambda.size(); ++i) lambda[i] = std::sin(2.0 + 0.7 * static_cast<double>(i));
        const Errors errors = problem.meter().measure(x, lambda);
        EXPECT_NEAR(errors.natural, problem.meter().natural(x.data(), lambda.data()), 1e-13 * errors.natural);
        std::vector<double> momentum(x.size()), impulse(x.size());
        pile.H.multiply_add(1.0, x.data(), momentum.data());
        pile.D.transpose_multiply_add(1.0, lambda.data(), impulse.data());
        double residual = 0.0, of_momentum = 0.0, of_impulse = 0.0, of_a = 0.0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            residual = std::hypot(residual, momentum[i] - impulse[i] - pile.a[i]);
            of_momentum = std::hypot(of_momentum, momentum[i]);
            of_impulse = std::hypot(of_impulse, impulse[i]);
            of_a = std::hypot(of_a, pile.a[i]);
        }
        EXPECT_NEAR(errors.balance, residual / std::max({of_momentum, of_impulse, of_a}), 1e-12 * errors.balance);
        // The scaling and ‖S r‖ come from a pass of their own as well, but for a new right-hand side.
        problem.set_right_hand_side(pile.a, pile.b);
        EXPECT_NEAR(problem.meter().measure(x, lambda).natural, errors.natural, 1e-13 * errors.natural);
    }
}

}  // namespace
}  // namespace delassus::errors_test
