// SPDX-License-Identifier: BSD-3-Clause
// Piles, stacks, walls and elastic blocks: counts, gaps, ranks, weight.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "delassus/generate.hpp"
#include "support/dense.hpp"

namespace delassus::contacts_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using tests::dense;
using tests::rank;

constexpr double kGravity = 9.81;

// All contacts at rest and stuck: x = 0, and the reactions solve Dᵀ λ = −a. Any solution of the redundant system will
// do: the floor carries the weight in each of them. A row belongs to the floor if only one body has columns in it.
void expect_floor_carries(const Problem& problem, double mass, double step) {
    const MatrixXd D = dense(problem.D);
    const VectorXd a = dense(problem.a);
    const VectorXd lambda = D.transpose().completeOrthogonalDecomposition().solve(-a);
    EXPECT_LT((D.transpose() * lambda + a).norm(), 1e-8 * a.norm()) << "the contacts cannot hold the bodies at rest";
    double vertical = 0.0;
    for (Eigen::Index i = 0; i < D.rows(); ++i) {
        double sum = 0.0;  // of the vertical coefficients: 0 between two bodies
        for (Eigen::Index k = 2; k < D.cols(); k += 6) sum += D(i, k);
        vertical += sum * lambda[i];
    }
    EXPECT_NEAR(vertical / (mass * kGravity * step), 1.0, 1e-8);
    double momentum = 0.0;
    for (Eigen::Index k = 2; k < a.size(); k += 6) momentum -= a[k];
    EXPECT_NEAR(momentum / (mass * kGravity * step), 1.0, 1e-12);
}

TEST(SpherePile, FloorCarriesTheWeight) {
    const Problem problem = generate("sphere_pile", {{"contacts", 100}, {"layers", 3}, {"step", 0.02}});
    const double mass = 2500.0 * 4.0 / 3.0 * std::numbers::pi * std::pow(0.05, 3);
    expect_floor_carries(problem, problem.n() / 6 * mass, 0.02);
}

TEST(BoxStack, FloorCarriesTheWeight) {
    const Problem problem =
        generate("box_stack", {{"towers", 2}, {"boxes", 3}, {"mass", 2.0}, {"mass_ratio", 100.0}, {"step", 0.02}});
    expect_floor_carries(problem, 2.0 * (2.0 + 20.0 + 200.0), 0.02);
}

TEST(BrickWall, FloorCarriesTheWeight) {
    const Problem problem = generate("brick_wall", {{"courses", 4}, {"columns", 3}, {"step", 0.02}});
    expect_floor_carries(problem, 4 * 3 * 1800.0 * 0.24 * 0.115 * 0.071, 0.02);
}

// 4 × 4 base, 3 layers: floor 16; inside the layers 24 + 12 + 4; between them 4 · 9 + 4 · 4.
TEST(SpherePile, CountsTheContactsOfAPyramid) {
    const Problem problem = generate("sphere_pile", {{"contacts", 108}, {"layers", 3}});
    EXPECT_EQ(problem.n() / 6, 16 + 9 + 4);
    EXPECT_EQ(problem.cones.size(), 108u);
    EXPECT_EQ(dense(problem.b).norm(), 0.0);
    EXPECT_EQ(generate("sphere_pile", {{"contacts", 108}, {"layers", 3}, {"walls", 1}, {"mu", 0}}).m(), 108 + 16);
}

TEST(SpherePile, HasAtLeastTheContactsAskedForAndNotManyMore) {
    for (const double wanted : {100.0, 1000.0, 10000.0, 100000.0}) {
        for (const double pyramid : {0.0, 1.0}) {
            for (const double walls : {0.0, 1.0}) {
                const Problem problem =
                    generate("sphere_pile", {{"contacts", wanted}, {"pyramid", pyramid}, {"walls", walls}});
                const auto contacts = static_cast<double>(problem.cones.size());
                EXPECT_GE(contacts, wanted);
                EXPECT_LE(contacts, wanted * (wanted < 1000 ? 2.0 : 1.25));
            }
        }
    }
}

// Spheres are smaller by up to the jitter: gaps from 0 to twice jitter · r, cut at envelope · r, none negative.
TEST(SpherePile, JitterOpensGapsUpToTheEnvelope) {
    const double r = 0.05;
    const Problem all = generate("sphere_pile", {{"contacts", 2000}, {"jitter", 0.02}, {"envelope", 0.05}});
    const Problem some = generate("sphere_pile", {{"contacts", 2000}, {"jitter", 0.02}, {"envelope", 0.01}});
    const Problem exact = generate("sphere_pile", {{"contacts", 2000}});
    EXPECT_EQ(all.cones.size(), exact.cones.size());
    EXPECT_LT(some.cones.size(), all.cones.size());
    EXPECT_GT(some.cones.size(), 0u);
    const auto gaps = [](const Problem& problem) { return VectorXd(0.01 * dense(problem.b)); };
    EXPECT_GE(gaps(all).minCoeff(), 0.0);
    EXPECT_LE(gaps(all).maxCoeff(), 0.04 * r);
    EXPECT_GT(gaps(all).maxCoeff(), 0.03 * r);
    EXPECT_LE(gaps(some).maxCoeff(), 0.01 * r);
}

// A sphere that rolls without slip along x: v = ω r, contact velocity 0; and sliding and rising are what they are.
TEST(SpherePile, RollingSphereDoesNotSlip) {
    const Problem problem = generate("sphere_pile", {{"contacts", 1}, {"layers", 1}, {"radius", 0.25}});
    ASSERT_EQ(problem.n(), 6);
    ASSERT_EQ(problem.m(), 3);
    const MatrixXd D = dense(problem.D);
    VectorXd rolling(6);
    rolling << 0.5, 0, 0, 0, 2.0, 0;
    EXPECT_LT((D * rolling).norm(), 1e-14);
    VectorXd moving(6);
    moving << 3.0, 4.0, 7.0, 0, 0, 0;
    const VectorXd u = D * moving;
    EXPECT_NEAR(u[0], 7.0, 1e-14);
    EXPECT_NEAR(u.tail(2).norm(), 5.0, 1e-14);
}

// Two spheres of one pile in contact that roll on one another like gears: no relative velocity at the contact. In any
// contact of two equal spheres, equal angular velocities slide, opposite ones roll.
TEST(SpherePile, OppositeRotationsRollOnOneAnother) {
    const Problem problem = generate("sphere_pile", {{"contacts", 20}, {"layers", 2}});
    const MatrixXd D = dense(problem.D);
    int pairs = 0;
    for (Eigen::Index row = 0; row < D.rows(); row += 3) {
        std::vector<Eigen::Index> bodies;
        for (Eigen::Index k = 0; k < D.cols(); k += 6) {
            if (D.block(row, k, 3, 6).norm() > 0.0) bodies.push_back(k);
        }
        if (bodies.size() != 2) continue;
        ++pairs;
        VectorXd x = VectorXd::Zero(D.cols());
        const Vector3d omega(1.0, -2.0, 0.5);
        x.segment<3>(bodies[0] + 3) = omega;
        x.segment<3>(bodies[1] + 3) = -omega;
        EXPECT_LT((D.middleRows(row, 3) * x).norm(), 1e-14);
        x.segment<3>(bodies[1] + 3) = omega;
        const Vector3d normal = D.block<1, 3>(row, bodies[1]).transpose();
        EXPECT_NEAR(normal.norm(), 1.0, 1e-14);
        EXPECT_NEAR((D.middleRows(row, 3) * x).norm(), 2.0 * 0.05 * omega.cross(normal).norm(), 1e-14);
        // The tangents are an orthonormal frame with the normal, and the reaction on the other body is opposite.
        const Eigen::Matrix3d frame = D.block<3, 3>(row, bodies[1]);
        EXPECT_LT((frame * frame.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
        EXPECT_LT((frame + D.block<3, 3>(row, bodies[0])).norm(), 1e-14);
    }
    EXPECT_GT(pairs, 5);
}

TEST(BoxStack, FacesHaveRedundantRows) {
    const Problem friction = generate("box_stack", {{"towers", 2}, {"boxes", 3}});
    EXPECT_EQ(friction.n(), 36);
    EXPECT_EQ(friction.m(), 2 * 3 * 12);
    EXPECT_EQ(rank(friction.D), 2 * 3 * 6);
    const Problem smooth = generate("box_stack", {{"towers", 2}, {"boxes", 3}, {"mu", 0}});
    EXPECT_EQ(smooth.m(), 2 * 3 * 4);
    EXPECT_EQ(rank(smooth.D), 2 * 3 * 3);
    EXPECT_EQ(smooth.cones.front().kind, ConeKind::Nonnegative);
    const Problem apart = generate("box_stack", {{"boxes", 2}, {"gap", 0.003}, {"step", 0.01}});
    EXPECT_NEAR(apart.b.front(), 0.3, 1e-15);
    EXPECT_NEAR(apart.b.back(), 0.0, 0.0);
}

TEST(BoxStack, HeavyTopIsOnTop) {
    const Problem problem = generate("box_stack", {{"boxes", 4}, {"mass", 3}, {"mass_ratio", 1e6}, {"heavy_top", 1}});
    const VectorXd H = dense(problem.H).diagonal();
    EXPECT_EQ(H[12], 3.0);
    EXPECT_EQ(H[18], 3e6);
    EXPECT_NEAR(H[18 + 5], 3e6 / 12.0 * (0.3 * 0.3 + 0.2 * 0.2), 1e-6);
}

// 2 courses of 3: the floor bears 3 whole bricks; each of the 4 upper bricks (half, whole, whole, half) lies on 1, 2, 2
// and 1 of them. Head joints: 2 below, 3 above. Four contacts on each.
TEST(BrickWall, CountsItsJoints) {
    EXPECT_EQ(generate("brick_wall", {{"courses", 2}, {"columns", 3}}).cones.size(), 4u * (3 + 6));
    const Problem all = generate("brick_wall", {{"courses", 2}, {"columns", 3}, {"head_joints", 1}});
    EXPECT_EQ(all.cones.size(), 4u * (3 + 6 + 2 + 3));
    EXPECT_EQ(all.n(), 6 * (3 + 4));
    EXPECT_EQ(rank(all.D), all.n());
}

TEST(BrickWall, ThePushHitsOneBrick) {
    const Problem problem = generate("brick_wall", {{"push", 2.0}});
    int moving = 0;
    for (std::size_t i = 1; i < problem.a.size(); i += 6) moving += problem.a[i] != 0.0 ? 1 : 0;
    EXPECT_EQ(moving, 1);
}

TEST(Glue, IsWhatGluedMakes) {
    for (const char* kind : {"sphere_pile", "box_stack", "brick_wall", "elastic_block"}) {
        const Problem contacts = generate(kind);
        const Problem stuck = generate(kind, {{"glue", 1}});
        EXPECT_EQ(stuck.m(), contacts.m());
        EXPECT_EQ(stuck.D.value, contacts.D.value);
        EXPECT_EQ(stuck.cones.size(), contacts.cones.size());
        for (const Cone& cone : stuck.cones) EXPECT_EQ(cone.kind, ConeKind::Free);
    }
}

// M and K from the problem: K is linear in Young's modulus.
struct Matrices {
    MatrixXd mass, stiffness;
};

Matrices matrices_of(ElasticBlockParameters parameters) {
    const double young = parameters.young;
    const MatrixXd once = dense(generate_elastic_block(parameters).H);
    parameters.young = 2.0 * young;
    const MatrixXd twice = dense(generate_elastic_block(parameters).H);
    const double h = parameters.step;
    return {2.0 * once - twice, (twice - once) / (h * h)};
}

// The patch test: displacements that are linear in the position, u = G x, have the energy ½ ε : C ε V exactly, with
// ε = (G + Gᵀ)/2, and 0 for a rotation.
TEST(ElasticBlock, PassesThePatchTest) {
    ElasticBlockParameters parameters;
    parameters.elements = 3;
    parameters.layers = 2;
    const Matrices matrices = matrices_of(parameters);
    const MatrixXd& K = matrices.stiffness;
    EXPECT_LT((K - K.transpose()).norm(), 1e-9 * K.norm());
    const double nu = parameters.poisson;
    const double lame = parameters.young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    const double shear = parameters.young / (2.0 * (1.0 + nu));
    const double volume = 18 * std::pow(parameters.size, 3);
    Eigen::Matrix3d stretch, turn;
    stretch << 0.3, 0.1, -0.2, 0.4, -0.5, 0.7, 0.05, -0.6, 0.2;
    turn << 0, -3, 2, 3, 0, -1, -2, 1, 0;
    for (const Eigen::Matrix3d& G : {stretch, turn}) {
        VectorXd u(K.rows());
        int node = 0;
        for (int k = 0; k <= 2; ++k) {
            for (int j = 0; j <= 3; ++j) {
                for (int i = 0; i <= 3; ++i) u.segment<3>(3 * node++) = G * (Vector3d(i, j, k) * parameters.size);
            }
        }
        const Eigen::Matrix3d strain = 0.5 * (G + G.transpose());
        const double expected =
            0.5 * volume * (lame * std::pow(strain.trace(), 2) + 2.0 * shear * strain.squaredNorm());
        EXPECT_NEAR(0.5 * u.dot(K * u), expected, 1e-8 * K.norm() * u.squaredNorm());
        if (expected > 0.0) {
            EXPECT_NEAR(0.5 * u.dot(K * u) / expected, 1.0, 1e-8);
        }
    }
    // Translations see the whole mass and no stiffness.
    VectorXd along = VectorXd::Zero(K.rows());
    for (int i = 0; i < along.size(); i += 3) along[i] = 1.0;
    EXPECT_NEAR(along.dot(matrices.mass * along) / (parameters.density * volume), 1.0, 1e-9);
    EXPECT_LT((K * along).norm(), 1e-9 * K.norm());
}

// A column under its own weight, squeezed by its static displacement, is at rest without Poisson's effect: K u = f_g
// but for the lowest nodes, which carry the weight.
TEST(ElasticBlock, SqueezedByItsWeightItIsInBalance) {
    ElasticBlockParameters parameters;
    parameters.elements = 2;
    parameters.layers = 5;
    parameters.poisson = 0.0;
    parameters.slide = 0.0;
    parameters.squeeze = 1.0;
    const Problem problem = generate_elastic_block(parameters);
    const VectorXd a = dense(problem.a);
    const double weight = parameters.density * 20 * std::pow(parameters.size, 3) * kGravity * parameters.step;
    EXPECT_LT(a.tail(a.size() - 27).norm(), 1e-10 * weight);
    EXPECT_NEAR(-a.sum() / weight, 1.0, 1e-10);
}

TEST(ElasticBlock, DampingEntersH) {
    ElasticBlockParameters parameters;
    parameters.elements = 2;
    parameters.layers = 2;
    const Matrices plain = matrices_of(parameters);
    parameters.damping_mass = 3.0;
    parameters.damping_stiffness = 0.02;
    const double h = parameters.step;
    const MatrixXd expected = (1.0 + 3.0 * h) * plain.mass + (h * h + 0.02 * h) * plain.stiffness;
    const MatrixXd found = dense(generate_elastic_block(parameters).H);
    EXPECT_LT((found - expected).norm(), 1e-10 * expected.norm());
}

TEST(ElasticBlock, IsSparseAndContactsAreTheLowestNodes) {
    const Problem problem = generate("elastic_block", {{"elements", 10}, {"layers", 10}});
    EXPECT_EQ(problem.n(), 3 * 11 * 11 * 11);
    EXPECT_EQ(problem.m(), 3 * 11 * 11);
    EXPECT_EQ(problem.D.entries(), problem.m());
    EXPECT_LE(problem.H.entries(), 81 * problem.n());
    EXPECT_GT(problem.H.entries(), 20 * problem.n());
}

}  // namespace
}  // namespace delassus::contacts_test
