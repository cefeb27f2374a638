// SPDX-License-Identifier: BSD-3-Clause
// The statistics of a report against tables computed by hand.
#include "bench/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace delassus::bench::statistics_test {
namespace {

// Four problems, three solvers; C solves one problem only, and the last problem nobody solves.
//        A     B     C     best   ratios
//        1     2     4     1      1  2  4
//        6     3     –     3      2  1  –
//        10    5     –     5      2  1  –
//        –     –     –     –
const Times table = {
    {1.0, 2.0, 4.0}, {6.0, 3.0, std::nullopt}, {10.0, 5.0, std::nullopt}, {std::nullopt, std::nullopt, std::nullopt}};

TEST(Statistics, ProfilesAreThoseOfTheTable) {
    const Profiles profiles = performance_profiles(table);
    EXPECT_EQ(profiles.problems, 3U);
    EXPECT_EQ(profiles.ratios[0], (std::vector<double>{1.0, 2.0, 2.0}));
    EXPECT_EQ(profiles.ratios[1], (std::vector<double>{1.0, 1.0, 2.0}));
    EXPECT_EQ(profiles.ratios[2], (std::vector<double>{4.0}));
    EXPECT_DOUBLE_EQ(profiles.at(0, 1.0), 1.0 / 3.0);
    EXPECT_DOUBLE_EQ(profiles.at(1, 1.0), 2.0 / 3.0);
    EXPECT_DOUBLE_EQ(profiles.at(1, 1.99), 2.0 / 3.0);
    EXPECT_DOUBLE_EQ(profiles.at(0, 2.0), 1.0);
    EXPECT_DOUBLE_EQ(profiles.at(2, 3.9), 0.0);
    EXPECT_DOUBLE_EQ(profiles.at(2, 1e9), 1.0 / 3.0);
}

TEST(Statistics, TimesBelowTheClockCountAsEqual) {
    const Profiles profiles = performance_profiles({{1e-7, 9e-6}}, 1e-5);
    EXPECT_EQ(profiles.ratios[0], std::vector<double>{1.0});
    EXPECT_EQ(profiles.ratios[1], std::vector<double>{1.0});
}

TEST(Statistics, ShiftedGeometricMean) {
    // (1 + 1)(3 + 1)(7 + 1) = 64, its third root is 4.
    EXPECT_NEAR(shifted_geometric_mean({1.0, 3.0, 7.0}, 1.0), 3.0, 1e-14);
    EXPECT_NEAR(shifted_geometric_mean({2.0, 8.0}, 0.0), 4.0, 1e-14);
    EXPECT_TRUE(std::isnan(shifted_geometric_mean({}, 1.0)));
}

TEST(Statistics, FitsAPowerExactly) {
    const auto fit =
        fit_power({10.0, 100.0, 1000.0, 20000.0}, {3.0 * std::pow(10.0, 1.4), 3.0 * std::pow(100.0, 1.4),
                                                   3.0 * std::pow(1000.0, 1.4), 3.0 * std::pow(20000.0, 1.4)});
    ASSERT_TRUE(fit.has_value());
    EXPECT_NEAR(fit->exponent, 1.4, 1e-12);
    EXPECT_NEAR(fit->factor, 3.0, 1e-10);
    EXPECT_NEAR(fit->standard_error, 0.0, 1e-12);
}

// In logarithms to base 10: (0, 0), (1, 2), (2, 1). Slope ½, residuals −½, 1, −½ of sum 3/2 over one degree of
// freedom and Σ(u − ū)² = 2: a standard error of √(3/4).
TEST(Statistics, StandardErrorOfAPower) {
    const auto fit = fit_power({1.0, 10.0, 100.0}, {1.0, 100.0, 10.0});
    ASSERT_TRUE(fit.has_value());
    EXPECT_NEAR(fit->exponent, 0.5, 1e-12);
    EXPECT_NEAR(fit->standard_error, std::sqrt(0.75), 1e-12);
}

TEST(Statistics, NoFitWhereThereIsNone) {
    EXPECT_FALSE(fit_power({1.0, 2.0}, {1.0, 2.0}).has_value());
    EXPECT_FALSE(fit_power({1.0, 1.0, 1.0}, {1.0, 2.0, 3.0}).has_value());
    EXPECT_FALSE(fit_power({1.0, 2.0, 3.0}, {1.0, 0.0, 3.0}).has_value());
}

TEST(Statistics, RatiosCarryTheSpread) {
    const Ratio slower = ratio_of({4.0, 5.0}, {2.0, 2.5});
    EXPECT_DOUBLE_EQ(slower.value, 2.0);
    EXPECT_DOUBLE_EQ(slower.low, 1.6);
    EXPECT_DOUBLE_EQ(slower.high, 2.5);
    EXPECT_TRUE(slower.certain());
    EXPECT_FALSE(ratio_of({2.0, 3.0}, {2.1, 2.5}).certain());
    EXPECT_TRUE(ratio_of({1.0, 1.1}, {2.0, 2.5}).certain());
}

}  // namespace
}  // namespace delassus::bench::statistics_test
