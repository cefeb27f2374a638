// SPDX-License-Identifier: BSD-3-Clause
// The error measures: zero at known solutions, independent of units, and equal to their formulas elsewhere.
#include "delassus/errors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/small_problems.hpp"

namespace delassus {
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

}  // namespace
}  // namespace delassus
