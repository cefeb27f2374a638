// SPDX-License-Identifier: BSD-3-Clause
// Ranks, LICQ and the pointed friction cone, on arrangements whose answer is known.
#include "delassus/qualification.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "delassus/generate.hpp"
#include "delassus/rank.hpp"
#include "support/solving.hpp"

namespace delassus::qualification_test {
namespace {

/// A point (3 velocities) between two planes with friction whose normals make the angle 2θ with one another, symmetric
/// to the z axis: rows normal, two tangents each.
Problem wedge(double theta, double mu) {
    const double c = std::cos(theta), s = std::sin(theta);
    Problem problem;
    problem.name = "wedge";
    problem.H = tests::diagonal_matrix({1.0, 1.0, 1.0});
    std::vector<Triplet> D;
    for (int side = 0; side < 2; ++side) {
        const double sign = side == 0 ? 1.0 : -1.0;
        const std::int32_t row = 3 * side;
        D.push_back({row, 0, sign * s});
        D.push_back({row, 2, c});
        D.push_back({row + 1, 0, c});
        D.push_back({row + 1, 2, -sign * s});
        D.push_back({row + 2, 1, 1.0});
        problem.cones.push_back(Cone::friction(mu));
    }
    problem.D = SparseMatrix::from_triplets(6, 3, std::move(D));
    problem.a = {0.0, 0.0, -1.0};
    problem.b.assign(6, 0.0);
    return problem;
}

class QualificationTest : public testing::Test {
protected:
    void SetUp() override {
        if (!tests::is_built("ipm") && !tests::is_built("admm")) GTEST_SKIP() << "neither ipm nor admm is built";
    }
    static Qualification found(const Problem& problem) {
        const Registry registry;
        return qualify(problem, registry);
    }
};

// The two cones touch each other's opposite when the half angle of the wedge of normals plus the friction angle is a
// right angle: the wedge jams for μ ≥ cot θ. The smallest net force of unit normals is then 0, and before 2·½·(cos θ −
// μ sin θ): both forces lean inwards.
TEST_F(QualificationTest, WedgesJamFromTheCotangentOn) {
    const double theta = 1.2, limit = 1.0 / std::tan(theta);
    for (const double share : {0.0, 0.5, 0.9, 0.99}) {
        const auto before = found(wedge(theta, share * limit));
        EXPECT_EQ(before.pointed, Answer::Yes) << share;
        const double mu = share * limit;
        // Rows are scaled to unit mean length already.
        EXPECT_NEAR(before.pointedness, std::cos(theta) - mu * std::sin(theta), 1e-5) << share;
        EXPECT_TRUE(before.cancelling.empty());
    }
    for (const double share : {1.0, 1.01, 3.0}) {
        const Problem problem = wedge(theta, share * limit);
        const auto after = found(problem);
        EXPECT_EQ(after.pointed, Answer::No) << share;
        ASSERT_EQ(after.cancelling.size(), 6u);
        std::vector<double> net(3, 0.0);
        problem.D.transpose_multiply_add(1.0, after.cancelling.data(), net.data());
        for (const double component : net) EXPECT_NEAR(component, 0.0, 1e-5);
        EXPECT_NEAR(after.cancelling[0] + after.cancelling[3], 1.0, 1e-12);
        for (const int first : {0, 3})
            EXPECT_LE(std::hypot(after.cancelling[static_cast<std::size_t>(first + 1)],
                                 after.cancelling[static_cast<std::size_t>(first + 2)]),
                      share * limit * after.cancelling[static_cast<std::size_t>(first)] + 1e-6);
    }
}

TEST_F(QualificationTest, TheReducedFormSaysTheSame) {
    for (const double mu : {0.2, 0.6}) {
        const Problem full = wedge(1.2, mu);
        Problem reduced;
        reduced.name = "reduced wedge";
        std::vector<Triplet> N;
        for (std::int32_t j = 0; j < 6; ++j) {
            std::vector<double> unit(6, 0.0), velocity(3, 0.0), column(6, 0.0);
            unit[static_cast<std::size_t>(j)] = 1.0;
            full.D.transpose_multiply_add(1.0, unit.data(), velocity.data());
            full.D.multiply_add(1.0, velocity.data(), column.data());
            for (std::int32_t i = 0; i < 6; ++i) N.push_back({i, j, column[static_cast<std::size_t>(i)]});
        }
        reduced.E = SparseMatrix::from_triplets(6, 6, std::move(N));
        reduced.b.assign(6, -1.0);
        reduced.cones = full.cones;
        const auto a = found(full), b = found(reduced);
        EXPECT_EQ(a.pointed, b.pointed) << mu;
        EXPECT_NEAR(a.pointedness, b.pointedness, 1e-5) << mu;
        EXPECT_EQ(a.rank, b.rank);
    }
}

// A box on a table: its reactions are not unique, but bounded. Glued to it, they are not even that.
TEST_F(QualificationTest, ABoxOnATableHasBoundedReactions) {
    BoxStackParameters parameters;
    parameters.boxes = 1;
    const Problem box = generate_box_stack(parameters);
    const auto loose = found(box);
    EXPECT_EQ(loose.independent, Answer::No);
    EXPECT_EQ(loose.rank, 6);
    EXPECT_EQ(loose.pointed, Answer::Yes);
    const auto fixed = found(glued(box));
    EXPECT_EQ(fixed.free_rows, 12);
    EXPECT_EQ(fixed.free_rank, 6);
    EXPECT_EQ(fixed.pointed, Answer::No);
}

TEST_F(QualificationTest, IndependentJointsQualify) {
    const auto chain = found(generate("chain", {{"bodies", 10}}));
    EXPECT_EQ(chain.independent, Answer::Yes);
    EXPECT_EQ(chain.pointed, Answer::Yes);
    const auto repeated = found(generate("chain", {{"bodies", 10}, {"repeated", 2}}));
    EXPECT_EQ(repeated.independent, Answer::No);
    EXPECT_EQ(repeated.pointed, Answer::No);
}

// Bounded rows cannot run away; a stop against a stop can.
TEST_F(QualificationTest, BoxesCountByTheirRecession) {
    Problem squeezed;
    squeezed.name = "squeezed";
    squeezed.H = tests::diagonal_matrix({1.0});
    squeezed.D = SparseMatrix::from_triplets(2, 1, {{0, 0, 1.0}, {1, 0, 1.0}});
    squeezed.a = {0.0};
    squeezed.b = {0.0, 0.0};
    squeezed.cones = {Cone::nonnegative(1), Cone::box({-tests::infinity}, {0.0})};
    EXPECT_EQ(found(squeezed).pointed, Answer::No);
    squeezed.cones[1] = Cone::box({-5.0}, {5.0});
    EXPECT_EQ(found(squeezed).pointed, Answer::Yes);
}

// A stack of n boxes on a floor: four points a face, of rank 6 each.
TEST(Rank, OfStacksDenseAndSparse) {
    BoxStackParameters parameters;
    for (const std::int32_t boxes : {1, 10, 400}) {
        parameters.boxes = boxes;
        EXPECT_EQ(estimate_rank(generate_box_stack(parameters)), 6 * boxes);
    }
}

}  // namespace
}  // namespace delassus::qualification_test
