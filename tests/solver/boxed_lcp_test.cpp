// SPDX-License-Identifier: BSD-3-Clause
// The boxed problems of engines as problems with cones (examples/engines/boxed_lcp.hpp), without an engine.
#include "../../examples/engines/boxed_lcp.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace delassus::tests::boxed_lcp_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// What an engine holds.
struct Boxed {
    Eigen::MatrixXd A;
    std::vector<double> b, lo, hi;
    std::vector<int> normal_of;

    [[nodiscard]] int rows() const { return static_cast<int>(b.size()); }
    [[nodiscard]] const PreparedProblem& pose(BoxedLcp& lcp) const { return lcp.pose(rows(), A, b, lo, hi, normal_of); }
    bool solve(BoxedLcp& lcp, std::vector<double>& x) const { return lcp.solve(rows(), A, b, x, lo, hi, normal_of); }
    [[nodiscard]] std::vector<double> w(const std::vector<double>& x) const {
        const Eigen::VectorXd w = A * Eigen::Map<const Eigen::VectorXd>(x.data(), rows()) -
                                  Eigen::Map<const Eigen::VectorXd>(b.data(), rows());
        return {w.data(), w.data() + w.size()};
    }
};

/// A unit mass on the plane that would move with (−push, v_1, v_2) in a step: x are its impulses.
Boxed particle(double push, double v_1, double v_2, double mu_1, double mu_2) {
    return {Eigen::Matrix3d::Identity(), {push, -v_1, -v_2}, {0, -mu_1, -mu_2}, {infinity, mu_1, mu_2}, {-1, 0, 0}};
}

TEST(BoxedLcp, FrictionIsMuNAgainstTheVelocityInEveryDirection) {
    BoxedLcp lcp("pgs", 1e-13);
    for (int k = 0; k < 100; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / 100.0;
        const Boxed boxed = particle(0.4, std::cos(angle), std::sin(angle), 0.3, 0.3);
        std::vector<double> x(3, 0.0);
        ASSERT_TRUE(boxed.solve(lcp, x)) << lcp.refusal();
        EXPECT_NEAR(x[0], 0.4, 1e-12);
        EXPECT_NEAR(x[1], -0.3 * 0.4 * std::cos(angle), 1e-12);
        EXPECT_NEAR(x[2], -0.3 * 0.4 * std::sin(angle), 1e-12);
    }
}

// Of the impulses within the ellipse it is the one that takes most energy: x_i = −μ_i² u_i N / √(μ_1² u_1² + μ_2²
// u_2²).
TEST(BoxedLcp, TwoCoefficientsAreAnEllipse) {
    const double mu_1 = 0.2, mu_2 = 0.5;
    BoxedLcp lcp("pgs", 1e-13);
    for (int k = 0; k < 20; ++k) {
        const double angle = 2.0 * std::numbers::pi * (k + 0.1) / 20.0;
        const Boxed boxed = particle(0.4, std::cos(angle), std::sin(angle), mu_1, mu_2);
        std::vector<double> x(3, 0.0);
        ASSERT_TRUE(boxed.solve(lcp, x)) << lcp.refusal();
        const std::vector<double> u = boxed.w(x);
        const double scale = 0.4 / std::hypot(mu_1 * u[1], mu_2 * u[2]);
        EXPECT_NEAR(x[0], 0.4, 1e-11);
        EXPECT_NEAR(x[1], -mu_1 * mu_1 * u[1] * scale, 1e-11);
        EXPECT_NEAR(x[2], -mu_2 * mu_2 * u[2] * scale, 1e-11);
    }
}

TEST(BoxedLcp, WhatHoldsIsNotTouchedByTheCone) {
    const Boxed boxed = particle(1.0, 0.1, -0.2, 0.5, 0.5);
    BoxedLcp lcp("ssn", 1e-12);
    std::vector<double> x(3, 0.0);
    ASSERT_TRUE(boxed.solve(lcp, x));
    for (const double u : boxed.w(x)) EXPECT_NEAR(u, 0.0, 1e-10);
    EXPECT_NEAR(x[1], -0.1, 1e-10);
    EXPECT_NEAR(x[2], 0.2, 1e-10);
}

// Rows in any order: friction of contact 5 in rows 1 and 3, a motor, a joint, a stop, friction in one direction.
TEST(BoxedLcp, RowsGoToTheConesThatTheyAre) {
    Boxed boxed;
    boxed.A = Eigen::MatrixXd::Identity(9, 9);
    boxed.A(1, 5) = boxed.A(5, 1) = 0.25;
    boxed.b = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    boxed.lo = {-1e10, -0.5, -2, -0.5, 0, 0, 0, -0.1, 0};
    boxed.hi = {1e10, 0.5, 3, 0.5, 1e10, 1e10, infinity, 0.1, 0};
    boxed.normal_of = {-1, 5, -1, 5, 4, 5, -1, 6, 4};
    BoxedLcp lcp("pgs");
    const Problem& problem = boxed.pose(lcp).problem();
    EXPECT_EQ(problem.law, Law::Coulomb);
    EXPECT_EQ(problem.b, (std::vector<double>{-0.0, -2, -4, -5, -1, -3, -6, -7, -8}));
    ASSERT_EQ(problem.cones.size(), 6U);
    EXPECT_EQ(problem.cones[0].kind, ConeKind::Free);
    EXPECT_EQ(problem.cones[1].kind, ConeKind::Box);
    EXPECT_EQ(problem.cones[1].lo, std::vector<double>{-2});
    EXPECT_EQ(problem.cones[1].hi, std::vector<double>{3});
    EXPECT_EQ(problem.cones[2].lo, std::vector<double>{0});
    EXPECT_EQ(problem.cones[2].hi, std::vector<double>{infinity});
    EXPECT_EQ(problem.cones[3].kind, ConeKind::Friction);
    EXPECT_EQ(problem.cones[3].rows, 3);
    EXPECT_EQ(problem.cones[3].parameters[0], 0.5);
    EXPECT_EQ(problem.cones[4].rows, 2);
    EXPECT_EQ(problem.cones[4].parameters[0], 0.1);
    EXPECT_EQ(problem.cones[5].kind, ConeKind::Box);  // friction without a coefficient gives no force
    EXPECT_EQ(problem.cones[5].hi, std::vector<double>{0});
    EXPECT_EQ(problem.E.row_times(3, std::vector<double>{0, 0, 0, 0, 1, 0, 0, 0, 0}.data()), 0.25);
    std::vector<double> x(9, 0.0);
    ASSERT_TRUE(boxed.solve(lcp, x)) << lcp.refusal();
    EXPECT_NEAR(x[2], 2.0, 1e-8);  // the motor within its limits
    EXPECT_NEAR(x[4], 4.0, 1e-8);
    EXPECT_EQ(x[8], 0.0);
    EXPECT_NEAR(x[7], 0.6, 1e-8);  // μ x_6
}

TEST(BoxedLcp, RefusesWhatNoConeSays) {
    BoxedLcp lcp("pgs");
    const auto refusal = [&](auto change) {
        Boxed boxed = particle(0.4, 1, 0, 0.3, 0.3);
        change(boxed);
        std::vector<double> x = {7, 8, 9};
        x.resize(boxed.b.size(), 10);
        const std::vector<double> before = x;
        EXPECT_FALSE(boxed.solve(lcp, x));
        EXPECT_EQ(x, before);
        return lcp.refusal();
    };
    EXPECT_EQ(refusal([](Boxed& p) { p.lo[1] = -0.2; }),
              "Row 1 of the engine's problem is friction with other bounds than −μ and μ.");
    EXPECT_EQ(refusal([](Boxed& p) { p.hi[0] = 3; }),
              "Row 0 of the engine's problem is a normal force with other bounds than 0 and ∞.");
    EXPECT_EQ(refusal([](Boxed& p) { p.normal_of[2] = 1; }),
              "Row 2 of the engine's problem names a normal force that is none.");
    EXPECT_EQ(refusal([](Boxed& p) { p.normal_of[2] = 3; }),
              "Row 2 of the engine's problem names a normal force that is none.");
    EXPECT_EQ(refusal([](Boxed& p) {
                  p.A = Eigen::MatrixXd::Identity(4, 4);
                  p.b.push_back(0);
                  p.lo.push_back(-0.3);
                  p.hi.push_back(0.3);
                  p.normal_of.push_back(0);
              }),
              "Row 3 of the engine's problem is the third direction of friction of a contact; a cone has two.");
    EXPECT_NE(refusal([](Boxed& p) { p.b[1] = std::nan(""); }).find("b[1]"), std::string::npos);
    EXPECT_NE(refusal([](Boxed& p) { p.A(0, 0) = -1; }).find("semidefinite"), std::string::npos);
    // What follows is solved.
    std::vector<double> x(3, 0.0);
    EXPECT_TRUE(particle(0.4, 1, 0, 0.3, 0.3).solve(lcp, x));
    EXPECT_EQ(lcp.refusal(), "");
}

TEST(BoxedLcp, AnAnswerThatIsNotExactEnoughIsNotGivenToTheEngine) {
    Boxed boxed = particle(0.4, 0.7, 0.3, 0.3, 0.3);
    boxed.A(0, 1) = boxed.A(1, 0) = 0.1;
    BoxedLcp lcp("pgs", 1e-30, 1e-30);
    std::vector<double> x = {7, 8, 9};
    EXPECT_FALSE(boxed.solve(lcp, x));
    EXPECT_EQ(x, (std::vector<double>{7, 8, 9}));
}

}  // namespace
}  // namespace delassus::tests::boxed_lcp_test
