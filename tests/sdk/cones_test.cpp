// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/sdk/cones.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace delassus::sdk::cones_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Holds the parameter that its cone points to.
struct Friction {
    double mu;
    int rows;
    operator delassus_cone() const { return {DELASSUS_CONE_FRICTION, 0, rows, 1, &mu, nullptr, nullptr}; }
};
Friction friction(double mu, int rows) {
    return {mu, rows};
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

std::vector<double> minus(std::vector<double> a, const std::vector<double>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
    return a;
}

// Moreau: v = P_K(v) − P_K*(−v), with both parts orthogonal. It characterises the two projections at once.
void expect_moreau(const delassus_cone& cone, const std::vector<double>& v) {
    auto onto_cone = v, onto_dual = v;
    for (double& entry : onto_dual) entry = -entry;
    operations_of(cone).project(cone, onto_cone.data());
    operations_of(cone).project_dual(cone, onto_dual.data());
    const double scale = 1.0 + dot(v, v);
    for (std::size_t i = 0; i < v.size(); ++i) EXPECT_NEAR(v[i], onto_cone[i] - onto_dual[i], 1e-12 * scale);
    EXPECT_NEAR(dot(onto_cone, onto_dual), 0.0, 1e-12 * scale);
}

TEST(Cones, ProjectionsDecomposeEveryVector) {
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 2000; ++trial) {
        const double mu = trial % 10 == 0 ? 0.0 : std::exp(2.0 * normal(random));
        for (const int rows : {2, 3}) {
            std::vector<double> v(static_cast<std::size_t>(rows));
            for (double& entry : v) entry = normal(random);
            if (trial % 7 == 0) std::fill(v.begin() + 1, v.end(), 0.0);
            expect_moreau(friction(mu, rows), v);
            expect_moreau({DELASSUS_CONE_NONNEGATIVE, 0, rows, 0, nullptr, nullptr, nullptr}, v);
            expect_moreau({DELASSUS_CONE_FREE, 0, rows, 0, nullptr, nullptr, nullptr}, v);
        }
    }
}

TEST(Cones, FrictionProjectionLiesInTheConeAndIsIdempotent) {
    const auto cone = friction(0.4, 3);
    std::vector<double> v = {0.1, 3.0, -4.0};
    project(cone, v.data());
    EXPECT_NEAR(std::hypot(v[1], v[2]), 0.4 * v[0], 1e-14);
    EXPECT_NEAR(v[1] / v[2], -0.75, 1e-14);
    auto again = v;
    project(cone, again.data());
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(again[i], v[i], 1e-15);
}

TEST(Cones, ApexIsTheProjectionOfThePolarCone) {
    const auto cone = friction(0.5, 3);
    std::vector<double> v = {-1.0, 1.2, 1.2};  // 0.5 ‖v_t‖ = 0.85 ≤ 1
    project(cone, v.data());
    EXPECT_EQ(v, (std::vector<double>{0.0, 0.0, 0.0}));
}

TEST(Cones, ZeroFrictionKeepsTheNormalOnly) {
    const auto cone = friction(0.0, 3);
    std::vector<double> v = {2.0, 1.0, 1.0};
    project(cone, v.data());
    EXPECT_EQ(v, (std::vector<double>{2.0, 0.0, 0.0}));
}

TEST(Cones, ZeroFrictionDoesNotPull) {
    std::vector<double> v = {-1.0, 0.0, 0.0};  // no tangential part: not inside, although 0 ≤ 0 v_n
    operations_of(friction(0.0, 3)).project(friction(0.0, 3), v.data());
    EXPECT_EQ(v, (std::vector<double>{0.0, 0.0, 0.0}));
}

TEST(Cones, BoxClampsAndItsDualKnowsInfiniteBounds) {
    const std::vector<double> lo = {-1.0, -infinity, 0.0, -infinity}, hi = {1.0, 2.0, infinity, infinity};
    const delassus_cone box{DELASSUS_CONE_BOX, 0, 4, 0, nullptr, lo.data(), hi.data()};
    std::vector<double> lambda = {-3.0, 5.0, -1.0, 7.0};
    project(box, lambda.data());
    EXPECT_EQ(lambda, (std::vector<double>{-1.0, 2.0, 0.0, 7.0}));
    std::vector<double> u = {-3.0, 5.0, -1.0, 7.0};
    operations_of(box).project_dual(box, u.data());
    EXPECT_EQ(u, (std::vector<double>{-3.0, 0.0, 0.0, 0.0}));
}

TEST(Cones, BoxGapIsZeroExactlyAtASolution) {
    const std::vector<double> lo = {-1.0, -1.0, -1.0}, hi = {1.0, 1.0, 1.0};
    const delassus_cone box{DELASSUS_CONE_BOX, 0, 3, 0, nullptr, lo.data(), hi.data()};
    const std::vector<double> u = {2.0, -3.0, 0.0}, solution = {-1.0, 1.0, 0.4}, other = {0.0, 1.0, 0.4};
    EXPECT_EQ(operations_of(box).gap(box, solution.data(), u.data()), 0.0);
    EXPECT_DOUBLE_EQ(operations_of(box).gap(box, other.data(), u.data()), 2.0);
}

TEST(Cones, IntervalsOfSeparableKindsAreTheirProjections) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    for (const ConeOperations& kind : cone_table) {
        if (!kind.is_separable()) continue;
        const std::vector<double> parameters(most_parameters, 1.0), lo = {-1.0, -infinity}, hi = {0.5, 1.0};
        const delassus_cone cone{kind.kind,
                                 0,
                                 2,
                                 kind.parameter_count,
                                 parameters.data(),
                                 kind.has_bounds ? lo.data() : nullptr,
                                 kind.has_bounds ? hi.data() : nullptr};
        for (int trial = 0; trial < 50; ++trial) {
            std::vector<double> v = {2.0 * normal(random), 2.0 * normal(random)}, projected = v;
            kind.project(cone, projected.data());
            for (std::int32_t i = 0; i < 2; ++i) {
                const auto [low, high] = kind.interval(cone, i);
                EXPECT_EQ(projected[i], std::min(high, std::max(low, v[i]))) << kind.name;
            }
        }
    }
}

TEST(Cones, ProjectionsOfAllKindsSolveTheirOwnProblems) {
    // λ = P(z), u = λ − z is a solution: the gap is 0, u lies in Υ*, and λ stays where it is.
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    const std::vector<double> lo(largest_block_rows, -1.0), hi(largest_block_rows, 0.5);
    for (const ConeOperations& kind : cone_table) {
        std::vector<double> parameters;
        for (const ConeParameter& parameter : kind.named_parameters()) parameters.push_back(parameter.example);
        for (int trial = 0; trial < 200; ++trial) {
            const std::int32_t rows = std::min(kind.most_rows, kind.least_rows + trial % largest_block_rows);
            const delassus_cone cone{kind.kind,
                                     0,
                                     rows,
                                     kind.parameter_count,
                                     parameters.data(),
                                     kind.has_bounds ? lo.data() : nullptr,
                                     kind.has_bounds ? hi.data() : nullptr};
            std::vector<double> z(static_cast<std::size_t>(rows));
            for (double& entry : z) entry = 2.0 * normal(random);
            auto lambda = z;
            kind.project(cone, lambda.data());
            const auto u = minus(lambda, z);
            auto again = lambda, dual = u;
            kind.project(cone, again.data());
            kind.project_dual(cone, dual.data());
            EXPECT_NEAR(kind.gap(cone, lambda.data(), u.data()), 0.0, 1e-13 * (1.0 + dot(z, z))) << kind.name;
            EXPECT_NEAR(std::sqrt(dot(minus(again, lambda), minus(again, lambda))), 0.0, 1e-14) << kind.name;
            EXPECT_NEAR(std::sqrt(dot(minus(dual, u), minus(dual, u))), 0.0, 1e-13 * (1.0 + dot(z, z))) << kind.name;
        }
    }
}

TEST(Cones, RangeWalksLongerCones) {
    struct LongerCone {
        delassus_cone cone;
        double later;
    };
    std::vector<LongerCone> cones;
    for (std::int32_t k = 0; k < 4; ++k)
        cones.push_back({{DELASSUS_CONE_FREE, 2 * k, 2, 0, nullptr, nullptr, nullptr}, -1.0});
    delassus_problem problem{};
    problem.cone_count = 4;
    problem.cone_stride = sizeof(LongerCone);
    problem.cones = &cones.front().cone;
    const ConeRange range(problem);
    ASSERT_EQ(range.size(), 4U);
    std::int32_t k = 0;
    for (const delassus_cone& cone : range) {
        EXPECT_EQ(&cone, &cones[k].cone);
        EXPECT_EQ(&range[k], &cones[k].cone);
        EXPECT_EQ(delassus_cone_at(&problem, k), &cones[k].cone);
        ++k;
    }
    EXPECT_EQ(k, 4);
}

TEST(Cones, ProjectionIsTheNearestPoint) {
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    const auto cone = friction(0.7, 3);
    for (int trial = 0; trial < 200; ++trial) {
        const std::vector<double> v = {normal(random), normal(random), normal(random)};
        auto nearest = v;
        project(cone, nearest.data());
        const auto error = minus(v, nearest);
        for (int probe = 0; probe < 20; ++probe) {
            std::vector<double> candidate = {normal(random), normal(random), normal(random)};
            project(cone, candidate.data());
            const auto other = minus(v, candidate);
            EXPECT_LE(dot(error, error), dot(other, other) + 1e-12);
        }
    }
}

}  // namespace
}  // namespace delassus::sdk::cones_test
