// SPDX-License-Identifier: BSD-3-Clause
// Chains, nets, spinning tops and the walker: Jacobians against finite differences, ranks, momenta.
#include <gtest/gtest.h>

#include <cmath>

#include "delassus/generate.hpp"
#include "support/dense.hpp"

namespace delassus::joints_test {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using tests::dense;
using tests::rank;

// A drift of ±ε s moves every body by ±ε v. So the central difference of C = h b is D v, with v from M v = a (no
// gravity). The difference is exact up to ε² times third derivatives. For a rod in its body frame a = M v − h ω × J ω:
// h is chosen so small that the second term does not count.
template <class Parameters>
void expect_jacobian_is_the_derivative(Parameters parameters, Problem (*function)(const Parameters&)) {
    parameters.gravity = 0.0;
    parameters.speed = 1.0;
    parameters.step = 1e-9;
    const double epsilon = 1e-4;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        parameters.seed = seed;
        parameters.drift = 0.0;
        const Problem problem = function(parameters);
        const VectorXd v = dense(problem.H).partialPivLu().solve(dense(problem.a));
        parameters.drift = epsilon;
        const VectorXd forwards = dense(function(parameters).b) * parameters.step;
        parameters.drift = -epsilon;
        const VectorXd backwards = dense(function(parameters).b) * parameters.step;
        const VectorXd expected = (forwards - backwards) / (2.0 * epsilon);
        const VectorXd found = dense(problem.D) * v;
        EXPECT_GT(expected.norm(), 0.1);
        EXPECT_LT((found - expected).norm(), 1e-6 * expected.norm());
    }
}

TEST(Chain, JacobianIsTheDerivativeOfTheConstraints) {
    for (const bool revolute : {false, true}) {
        for (const bool world_frame : {false, true}) {
            for (const bool closed : {false, true}) {
                ChainParameters parameters;
                parameters.bodies = 5;
                parameters.length = 1.0;
                parameters.revolute = revolute;
                parameters.world_frame = world_frame;
                parameters.closed = closed;
                expect_jacobian_is_the_derivative(parameters, &generate_chain);
            }
        }
    }
}

TEST(Net, JacobianIsTheDerivativeOfTheConstraints) {
    NetParameters parameters;
    parameters.rows = 4;
    parameters.columns = 5;
    expect_jacobian_is_the_derivative(parameters, &generate_net);
}

TEST(Chain, HoldsTogetherAtFirst) {
    for (const bool closed : {false, true}) {
        ChainParameters parameters;
        parameters.revolute = true;
        parameters.closed = closed;
        EXPECT_LT(dense(generate_chain(parameters).b).norm(), 1e-10);
    }
}

// A chain that swings as one rigid body moves no joint.
TEST(Chain, SwingFitsTheJoints) {
    ChainParameters parameters;
    parameters.bodies = 6;
    parameters.swing = 2.0;
    parameters.gravity = 0.0;
    parameters.step = 1e-9;
    for (const bool option : {false, true}) {
        parameters.world_frame = option;
        parameters.revolute = option;
        const Problem problem = generate_chain(parameters);
        const VectorXd v = dense(problem.H).partialPivLu().solve(dense(problem.a));
        EXPECT_GT(v.norm(), 1.0);
        EXPECT_LT((dense(problem.D) * v).norm(), 1e-7);
    }
}

TEST(Chain, RowsAreIndependentUnlessRepeatedOrOverconstrained) {
    const auto deficiency = [](const std::map<std::string, double>& values) {
        const Problem problem = generate("chain", values);
        return problem.m() - rank(problem.D);
    };
    EXPECT_EQ(deficiency({{"bodies", 7}}), 0);
    EXPECT_EQ(deficiency({{"bodies", 7}, {"revolute", 1}}), 0);
    EXPECT_EQ(deficiency({{"bodies", 7}, {"closed", 1}}), 0);
    EXPECT_EQ(deficiency({{"bodies", 4}, {"repeated", 3}}), 2 * 3 * 4);
    EXPECT_EQ(deficiency({{"bodies", 4}, {"repeated", 2}, {"revolute", 1}}), 5 * 4);
    // A closed planar linkage of hinges: mobility N − 2 in the plane, so that the rank is 6 N − (N − 2) of 5 (N + 1)
    // rows.
    EXPECT_EQ(deficiency({{"bodies", 6}, {"closed", 1}, {"planar", 1}, {"revolute", 1}}), 3);
}

TEST(Chain, GradesTheMasses) {
    const Problem graded = generate("chain", {{"bodies", 5}, {"mass", 2.0}, {"mass_ratio", 1e8}});
    const Problem heavy = generate("chain", {{"bodies", 5}, {"mass", 2.0}, {"mass_ratio", 1e8}, {"heavy_end", 1}});
    for (int k = 0; k < 5; ++k) {
        EXPECT_NEAR(dense(graded.H)(6 * k, 6 * k) / (2.0 * std::pow(100.0, k)), 1.0, 1e-12);
        EXPECT_EQ(dense(heavy.H)(6 * k, 6 * k), k == 4 ? 2e8 : 2.0);
    }
}

// Both frames describe one mechanical problem: the velocities of the mass centres after the step agree.
TEST(Chain, FramesAgree) {
    const auto solve = [](const Problem& problem) {
        const auto n = problem.n();
        const auto m = problem.m();
        MatrixXd K = MatrixXd::Zero(n + m, n + m);
        K << dense(problem.H), -dense(problem.D).transpose(), dense(problem.D), MatrixXd::Zero(m, m);
        VectorXd rhs(n + m);
        rhs << dense(problem.a), -dense(problem.b);
        return VectorXd(K.partialPivLu().solve(rhs).head(n));
    };
    std::map<std::string, double> values = {{"bodies", 5}, {"speed", 1.0}, {"revolute", 1}, {"drift", 0.01}};
    const VectorXd body = solve(generate("chain", values));
    values["world_frame"] = 1;
    const Problem world_problem = generate("chain", values);
    const VectorXd world = solve(world_problem);
    EXPECT_NE(dense(world_problem.H)(3, 4), 0.0);
    for (int k = 0; k < 5; ++k) {
        EXPECT_LT((body.segment<3>(6 * k) - world.segment<3>(6 * k)).norm(), 1e-9 * body.norm());
        EXPECT_NEAR(body.segment<3>(6 * k + 3).norm(), world.segment<3>(6 * k + 3).norm(), 1e-9 * body.norm());
    }
}

TEST(Net, RanksFollowFromItsShape) {
    const auto deficiency = [](const std::map<std::string, double>& values) {
        const Problem problem = generate("net", values);
        return problem.m() - rank(problem.D);
    };
    EXPECT_EQ(generate("net", {{"rows", 5}, {"columns", 6}}).m(), 5 * 5 + 4 * 6);
    EXPECT_EQ(deficiency({{"rows", 5}, {"columns", 6}}), 0);
    EXPECT_EQ(deficiency({{"rows", 5}, {"columns", 6}, {"sag", 0}}), 4);
    EXPECT_EQ(deficiency({{"rows", 4}, {"columns", 4}, {"repeated", 2}}), 24);
    // Flat and fully braced it is rigid in its plane: the rank is 2 (nodes − 4).
    const Problem braced = generate("net", {{"rows", 5}, {"columns", 6}, {"sag", 0}, {"diagonals", 2}});
    EXPECT_EQ(braced.m(), 5 * 5 + 4 * 6 + 2 * 4 * 5);
    EXPECT_EQ(rank(braced.D), 2 * (30 - 4));
}

// ω × J ω from the problem itself: a is linear in h, a(h) = M v + h ω × J ω without gravity (R ω = 2 ω × J ω), and R is
// compared with finite differences of ω × J ω.
TEST(Gyroscopic, HHoldsTheDerivativeOfTheTorque) {
    GyroscopicParameters parameters;
    parameters.bodies = 4;
    parameters.gravity = 0.0;
    parameters.step = 1e-3;
    const Problem problem = generate_gyroscopic(parameters);
    const VectorXd a = dense(problem.a);
    parameters.step = 2e-3;
    const Problem twice = generate_gyroscopic(parameters);
    const MatrixXd M = 2.0 * dense(problem.H) - dense(twice.H);
    const MatrixXd R = (dense(problem.H) - M) / 1e-3;
    const VectorXd v = M.partialPivLu().solve(2.0 * a - dense(twice.a));
    EXPECT_TRUE(M.isDiagonal(1e-9));
    const double disc = parameters.mass * parameters.radius * parameters.radius;
    for (int k = 0; k < parameters.bodies; ++k) {
        const Matrix3d J = Vector3d(M.diagonal().segment<3>(6 * k + 3)).asDiagonal();
        EXPECT_NEAR(J(0, 0) / disc, 0.25, 1e-9);
        EXPECT_NEAR(J(2, 2) / disc, 0.5, 1e-9);
        const Vector3d omega = v.segment<3>(6 * k + 3);
        EXPECT_NEAR(omega.z(), k % 2 == 0 ? 300.0 : -300.0, 5.1);
        Matrix3d expected;
        for (int j = 0; j < 3; ++j) {
            const Vector3d plus = omega + Vector3d::Unit(j);
            const Vector3d minus = omega - Vector3d::Unit(j);
            expected.col(j) = 0.5 * (plus.cross(J * plus) - minus.cross(J * minus));
        }
        const Matrix3d found = R.block<3, 3>(6 * k + 3, 6 * k + 3);
        EXPECT_LT((found - expected).norm(), 1e-9 * expected.norm());
        EXPECT_GT((found - found.transpose()).norm(), 0.5 * found.norm());
    }
    EXPECT_LT((dense(problem.D) * v).norm(), 1e-9 * v.norm()) << "the first velocities do not fit the joints";
}

TEST(Motors, HasEveryConeAndCompliance) {
    const Problem problem = generate("motors", {{"legs", 2}, {"torque", 20}, {"step", 0.005}});
    std::map<ConeKind, int> count;
    for (const Cone& cone : problem.cones) ++count[cone.kind];
    EXPECT_EQ(count[ConeKind::Free], 2 * 2 * 2);
    EXPECT_EQ(count[ConeKind::Box], 2 * 2);
    EXPECT_EQ(count[ConeKind::Nonnegative], 2);
    EXPECT_EQ(count[ConeKind::Friction], 2);
    EXPECT_EQ(problem.n(), 6 * (1 + 2 * 2));
    // A hip: bushing 1/(h² k), axis, motor 1/(h c).
    const VectorXd E = dense(problem.E).diagonal();
    EXPECT_NEAR(E[0], 1.0 / (0.005 * 0.005 * 1e6), 1e-12);
    EXPECT_EQ(E[3], 0.0);
    EXPECT_NEAR(E[5], 1.0 / (0.005 * 50.0), 1e-12);
    EXPECT_EQ(problem.cones[2].kind, ConeKind::Box);
    EXPECT_NEAR(problem.cones[2].hi.at(0), 0.1, 1e-15);
    EXPECT_EQ(problem.cones[2].lo.at(0), -problem.cones[2].hi.at(0));
}

// The machine is assembled: it has no joint errors; moved as one rigid body about any point it strains no hinge, motor
// or stop; and a foot that stands on the floor is where the angles put it: gap 0.
TEST(Motors, RigidMotionStrainsNothingButTheFeet) {
    const Problem problem = generate("motors", {{"motor_speed", 0}, {"knee_clearance", 0}});
    EXPECT_LT(dense(problem.b).norm(), 1e-9);
    VectorXd translation = VectorXd::Zero(problem.n());
    for (int i = 0; i < problem.n(); i += 6) translation.segment<3>(i) = Vector3d(1.0, 2.0, 3.0);
    const VectorXd u = dense(problem.D) * translation;
    Eigen::Index row = 0;
    for (const Cone& cone : problem.cones) {
        const VectorXd block = u.segment(row, cone.rows);
        if (cone.kind == ConeKind::Friction) {
            EXPECT_NEAR(block[0], 3.0, 1e-12);
            EXPECT_NEAR(block.tail(2).norm(), std::sqrt(5.0), 1e-12);
        } else {
            EXPECT_LT(block.norm(), 1e-12);
        }
        row += cone.rows;
    }
}

}  // namespace
}  // namespace delassus::joints_test
