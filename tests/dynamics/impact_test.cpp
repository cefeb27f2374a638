// SPDX-License-Identifier: BSD-3-Clause
// Impacts within a step beside the motion that goes through them one after the other.
#include "dynamics/impact.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace delassus::impact_test {
namespace {

struct End {
    double gap, speed;
    int bounces = 0;
};

End followed(double h, double gap, double speed, double acceleration, double restitution) {
    constexpr int parts = 2000000;
    const double part = h / parts;
    End end{gap, speed};
    for (int k = 0; k < parts; ++k) {
        const double next = end.gap + part * (end.speed + 0.5 * acceleration * part);
        if (next < 0.0 && end.speed < 0.0) {
            end.speed *= -restitution;
            ++end.bounces;
        } else {
            end.gap = next;
            end.speed += acceleration * part;
        }
    }
    return end;
}

TEST(Impact, EndsWhereTheMotionThroughAllOfThemEnds) {
    const double h = 0.016;
    struct Case {
        double gap, speed, acceleration, restitution;
        int bounces;
    };
    for (const Case& one :
         {Case{0.01, -1.0, -9.81, 0.5, 1}, Case{0.0, -1.0, -9.81, 0.5, 1}, Case{0.0, -1.0, 0.0, 1.0, 1},
          Case{0.01, 0.2, -500.0, 0.7, 2}, Case{0.001, -1.0, -1000.0, 0.95, 6}, Case{0.002, -0.5, -700.0, 1.0, 3},
          Case{0.01, -3.0, 100.0, 0.3, 1}, Case{0.0, 0.5, -200.0, 0.9, 3}}) {
        SCOPED_TRACE(fmt::format("{} {} {} {}", one.gap, one.speed, one.acceleration, one.restitution));
        const auto impact = impact_within(h, {one.gap, one.speed, one.acceleration}, one.acceleration, one.restitution);
        ASSERT_TRUE(impact);
        const End end = followed(h, one.gap, one.speed, one.acceleration, one.restitution);
        EXPECT_EQ(end.bounces, one.bounces);
        EXPECT_NEAR(impact->end_speed, end.speed, 2e-4 * (std::abs(one.speed) + std::abs(one.acceleration) * h));
        const double alone = one.gap + (one.speed + 0.5 * one.acceleration * h) * h;
        EXPECT_NEAR(alone + (h - impact->acts) * impact->change, end.gap, 1e-5);
    }
}

// The gap of a corner that spins is that of its row and ½ α t² more from when it meets.
TEST(Impact, MeetsAgainAsItsGapMovesAndNotItsRow) {
    const double h = 0.01;
    struct Case {
        double acceleration, turning, restitution;
        int bounces;
    };
    for (const Case& one : {Case{-9.81, -300.0, 0.7, 4}, Case{-600.0, 500.0, 0.6, 1}, Case{-9.81, 60.0, 0.5, 1}}) {
        SCOPED_TRACE(fmt::format("{} and {}", one.acceleration, one.turning));
        const auto impact =
            impact_within(h, {0.0, -1.0, one.acceleration}, one.acceleration, one.restitution, one.turning);
        ASSERT_TRUE(impact);
        const End end = followed(h, 0.0, -1.0, one.acceleration + one.turning, one.restitution);
        EXPECT_EQ(end.bounces, one.bounces);
        EXPECT_NEAR(impact->end_speed + one.turning * h, end.speed, 1e-3);
        const double alone = (-1.0 + 0.5 * one.acceleration * h) * h;
        EXPECT_NEAR(alone + (h - impact->acts) * impact->change + 0.5 * one.turning * h * h, end.gap, 1e-5);
    }
    const auto rests = impact_within(h, {0.0, -1.0, -9.81}, -9.81, 0.3, -2000.0);
    ASSERT_TRUE(rests);
    EXPECT_NEAR(rests->end_speed - 2000.0 * h, 0.0, 1e-12);
}

TEST(Impact, ComesToRestWhereAllFlightsAreOver) {
    const auto impact = impact_within(0.1, {0.001, -0.1, -9.81}, -9.81, 0.3);
    ASSERT_TRUE(impact);
    EXPECT_EQ(impact->end_speed, 0.0);
    const double alone = 0.001 + (-0.1 - 0.5 * 9.81 * 0.1) * 0.1;
    EXPECT_NEAR(alone + (0.1 - impact->acts) * impact->change, 0.0, 1e-15);
}

// What hardly meets, as its acceleration stops it, needs a small impulse: at a time long before the step it would move
// bodies by as far.
TEST(Impact, ActsWithinTheStepWhereItHardlyMeets) {
    for (const double acceleration : {180.0, 199.9, 199.9999}) {
        const auto impact = impact_within(0.01, {0.0, -1.0, acceleration}, -9.81, 0.0);
        ASSERT_TRUE(impact) << acceleration;
        EXPECT_GE(impact->acts, impact->meets);
        EXPECT_LE(impact->acts, 0.01);
    }
}

TEST(Impact, IsNoneWhereTheContactDoesNotMeet) {
    EXPECT_FALSE(impact_within(0.01, {0.02, -1.0, 0.0}, 0.0, 0.5));
    EXPECT_FALSE(impact_within(0.01, {0.02, -1.0, 200.0}, 200.0, 0.5));
    EXPECT_FALSE(impact_within(0.01, {0.005, -1.0, 200.0}, 200.0, 0.5)) << "turns round before";
    EXPECT_FALSE(impact_within(0.01, {0.0, 0.0, -9.81}, -9.81, 0.5)) << "rests";
    EXPECT_FALSE(impact_within(0.01, {0.0, 1.0, 9.81}, 9.81, 0.5));
}

}  // namespace
}  // namespace delassus::impact_test
