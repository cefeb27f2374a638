// SPDX-License-Identifier: BSD-3-Clause
// Which bodies stand still, but for what a solver left of their velocities.
#include "dynamics/bodies_at_rest.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace delassus::bodies_at_rest_test {
namespace {

/// A heavy body and a light one that fall in a step of 1/100 s, each with two velocities, which take turns in the
/// columns, and one row.
struct Fixture {
    static constexpr double heavy = 1e6, light = 1e-2, fall = 9.81e-2;
    std::vector<std::int32_t> bodies{0, 1, 0, 1};
    Problem problem;
    BodiesAtRest rest;

    Fixture() {
        problem.H = SparseMatrix::from_triplets(4, 4, {{0, 0, heavy}, {1, 1, light}, {2, 2, heavy}, {3, 3, light}});
        problem.D = SparseMatrix::from_triplets(1, 4, {{0, 0, 1.0}, {0, 1, -1.0}});
        problem.a = {0.0, 0.0, -heavy * fall, -light * fall};
        problem.b = {0.0};
        rest.begin(problem, bodies);
    }
    std::vector<double> stopped(std::vector<double> x, double error) {
        rest.stop(std::vector<double>(4, error), x);
        return x;
    }
};

TEST(BodiesAtRest, AreSlowerThanWhatTheSolverLeft) {
    Fixture two;
    const double noise = 12e-9 * Fixture::fall;
    EXPECT_EQ(two.stopped({noise, -noise, 0.0, noise}, 1e-9), (std::vector{0.0, 0.0, 0.0, 0.0}));
    EXPECT_EQ(two.stopped({noise, -noise, 0.0, noise}, 1e-10), (std::vector{noise, -noise, 0.0, noise}));
    EXPECT_TRUE(two.rest.all_stand({}, std::vector{noise, -noise, 0.0, noise}, 1e-9));
    EXPECT_FALSE(two.rest.all_stand({}, std::vector{noise, -noise, 0.0, noise}, 1e-10));
}

TEST(BodiesAtRest, MoveOrStandEachByItself) {
    Fixture two;
    const double noise = 1e-9 * Fixture::fall, slow = 1e-6 * Fixture::fall;
    EXPECT_EQ(two.stopped({noise, slow, 0.0, noise}, 1e-9), (std::vector{0.0, slow, 0.0, noise}));
    EXPECT_EQ(two.stopped({slow, noise, 0.0, noise}, 1e-9), (std::vector{slow, 0.0, 0.0, 0.0}));
    const std::vector<std::int32_t> heavy{0, 2}, light{1, 3};
    EXPECT_TRUE(two.rest.all_stand(heavy, std::vector{noise, 0.0}, 1e-9));
    EXPECT_FALSE(two.rest.all_stand(light, std::vector{slow, noise}, 1e-9));
    EXPECT_TRUE(two.rest.all_stand(heavy, std::vector{noise, 0.0}, 1e-9)) << "nothing is left of the last call";
}

TEST(BodiesAtRest, LooseSolvesDoNotStopSlowBodies) {
    Fixture two;
    const double slow = 1e-6 * Fixture::fall;
    EXPECT_EQ(two.stopped({slow, slow, slow, slow}, 1e-3), (std::vector{slow, slow, slow, slow}));
}

TEST(BodiesAtRest, NothingIsSaidOfVelocitiesWithoutBodiesOrRows) {
    Fixture two;
    two.rest.begin(two.problem, {});
    EXPECT_EQ(two.stopped({1e-30, 0.0, 0.0, 0.0}, 1.0)[0], 1e-30);
    EXPECT_FALSE(two.rest.all_stand({}, std::vector{0.0, 0.0, 0.0, 0.0}, 1.0));
    two.problem.D = SparseMatrix::zero(0, 4);
    two.problem.b.clear();
    two.rest.begin(two.problem, two.bodies);
    EXPECT_EQ(two.stopped({1e-30, 0.0, 0.0, 0.0}, 1.0)[0], 1e-30);
}

}  // namespace
}  // namespace delassus::bodies_at_rest_test
