// SPDX-License-Identifier: BSD-3-Clause
// delassus_step in the place of mj_step: motions and forces that formulas give, and MuJoCo's own answers where both
// solve the same problem.
#include <gtest/gtest.h>

#ifndef DELASSUS_HAS_MUJOCO
TEST(MujocoStep, Adapter) {
    GTEST_SKIP() << "libmujoco was not found when this was built (Debian: libmujoco-dev)";
}
#else

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "simulation.hpp"
#include "support/places.hpp"

namespace {

constexpr double gravity = 9.81, step = 0.002;

std::string option(const std::string& cone, const std::string& more = "") {
    return "<option timestep='0.002' cone='" + cone + "' " + more + "/>";
}
delassus_mujoco_options options(const char* contacts, const char* law = "coulomb", const char* solver = nullptr,
                                double tolerance = 1e-10) {
    delassus_mujoco_options chosen{};
    chosen.contacts = contacts;
    chosen.law = law;
    chosen.solver = solver;
    chosen.tolerance = tolerance;
    return chosen;
}
std::string grip(const std::string& more) {
    return std::string(delassus::tests::places::source) + "/examples/engines/mujoco/models/" + more;
}

/// A block of 2 kg on a plane; gravity is turned by `slope`, towards `heading` in the plane.
std::string block(const std::string& cone, int condim, double mu, double slope, double heading) {
    const double along = gravity * std::sin(slope);
    return option(cone, fmt::format("gravity='{:.15f} {:.15f} {:.15f}'", along * std::cos(heading),
                                    along * std::sin(heading), -gravity * std::cos(slope))) +
           "<default><geom condim='" + std::to_string(condim) + "' friction='" + std::to_string(mu) +
           " 0.005 0.0001'/></default>"
           "<worldbody><geom type='plane' size='50 50 1'/><body name='block' pos='0 0 0.1'><freejoint/>"
           "<geom type='box' size='0.3 0.2 0.1' mass='2'/><site name='pad' type='box' size='1 1 1'/></body></worldbody>"
           "<sensor><touch site='pad'/></sensor>";
}

class OnASlope : public testing::TestWithParam<std::tuple<const char*, int> > {
protected:
    const std::string cone = std::get<0>(GetParam());
    const int condim = std::get<1>(GetParam());
};

// The tangents are MuJoCo's; a pyramid would turn the friction, or change it by up to √2.
TEST_P(OnASlope, ABlockSlidesWithExactCoulombFriction) {
    const double slope = 0.6, mu = 0.3;
    for (const double heading : {0.0, 0.4, 2.0}) {
        Simulation sim(block(cone, condim, mu, slope, heading), options("hard"));
        sim.d()->qpos[2] -= 1e-9;  // it touches
        const double speed = gravity * (std::sin(slope) - mu * std::cos(slope));
        sim.step(100);
        EXPECT_NEAR(sim.d()->qvel[0], 0.2 * speed * std::cos(heading), 1e-9);
        EXPECT_NEAR(sim.d()->qvel[1], 0.2 * speed * std::sin(heading), 1e-9);
        for (int k = 2; k < 6; ++k) EXPECT_NEAR(sim.d()->qvel[k], 0.0, 1e-9);
    }
}

TEST_P(OnASlope, ABlockThatSticksStays) {
    Simulation sim(block(cone, condim, 0.7, 0.6, 0.4), options("hard"));
    sim.d()->qpos[2] -= 1e-9;
    const std::vector<double> before(sim.d()->qpos, sim.d()->qpos + 3);
    sim.step(500);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(sim.d()->qpos[k], before[static_cast<std::size_t>(k)], 1e-9) << k;
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(sim.d()->qvel[k], 0.0, 1e-9) << k;
}

TEST_P(OnASlope, ForcesCarryTheWeight) {
    for (const char* contacts : {"hard", "mujoco"}) {
        Simulation sim(block(cone, condim, 0.7, 0.3, 0.4), options(contacts));
        sim.d()->qpos[2] -= 1e-9;
        sim.step(1500);
        const double* g = sim.m()->opt.gravity;
        const double near = std::string(contacts) == "hard" ? 1e-7 : 1e-4;
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(sim.contact_force(axis), -2.0 * g[axis], near) << contacts;
        EXPECT_NEAR(sim.d()->sensordata[0], -2.0 * g[2], near) << contacts;  // touch
        // qfrc_constraint and qacc are those of efc_force.
        std::vector<double> force(6), mass_acceleration(6);
        mj_mulJacTVec(sim.m(), sim.d(), force.data(), sim.d()->efc_force);
        mj_mulM(sim.m(), sim.d(), mass_acceleration.data(), sim.d()->qacc);
        for (std::size_t k = 0; k < 6; ++k) {
            EXPECT_NEAR(force[k], sim.d()->qfrc_constraint[k], 1e-9);
            EXPECT_NEAR(mass_acceleration[k], sim.d()->qfrc_smooth[k] + force[k], 1e-9);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Mujoco, OnASlope,
                         testing::Combine(testing::Values("elliptic", "pyramidal"), testing::Values(3, 4, 6)),
                         [](const auto& test) {
                             return std::string(std::get<0>(test.param)) + std::to_string(std::get<1>(test.param));
                         });

class Ball : public testing::TestWithParam<const char*> {
protected:
    static constexpr double radius = 0.1, mass = 2.0, inertia = 0.4 * mass * radius * radius;
    std::string model(int condim, const std::string& friction) const {
        return option(GetParam()) + "<default><geom condim='" + std::to_string(condim) + "' friction='" + friction +
               "'/></default><worldbody><geom type='plane' size='50 50 1'/><body pos='0 0 0.1'><freejoint/>"
               "<geom type='sphere' size='0.1' mass='2'/></body></worldbody>";
    }
};

// Torsional friction μ_τ m g, in m.
TEST_P(Ball, SpinsDownByTorsionalFriction) {
    const double mu = 0.01;
    Simulation sim(model(4, "0.5 0.01 0.0001"), options("hard"));
    sim.d()->qpos[2] -= 1e-9;
    sim.d()->qvel[5] = 20.0;
    sim.step(100);
    EXPECT_NEAR(sim.d()->qvel[5], 20.0 - 100 * step * mu * mass * gravity / inertia, 1e-8);
    sim.step(400);  // it has stopped
    EXPECT_NEAR(sim.d()->qvel[5], 0.0, 1e-9);
    EXPECT_NEAR(sim.d()->qpos[0], 0.0, 1e-9);
}

// Rolling: r F = I α + μ_r N about the axis of rolling, so a = −μ_r m g / (r (m + I/r²)), in any direction.
TEST_P(Ball, RollsOutByRollingFriction) {
    const double mu = 0.002, along = 0.7;
    Simulation sim(model(6, "0.5 0.01 0.002"), options("hard"));
    sim.d()->qpos[2] -= 1e-9;
    const double speed = 1.0;
    sim.d()->qvel[0] = speed * std::cos(along);
    sim.d()->qvel[1] = speed * std::sin(along);
    sim.d()->qvel[3] = -sim.d()->qvel[1] / radius;
    sim.d()->qvel[4] = sim.d()->qvel[0] / radius;
    sim.step(100);
    const double expected = speed - 100 * step * mu * mass * gravity / (radius * (mass + inertia / (radius * radius)));
    EXPECT_NEAR(std::hypot(sim.d()->qvel[0], sim.d()->qvel[1]), expected, 1e-7);
    EXPECT_NEAR(std::atan2(sim.d()->qvel[1], sim.d()->qvel[0]), along, 1e-7);
    sim.step(4000);
    EXPECT_NEAR(std::hypot(sim.d()->qvel[0], sim.d()->qvel[1]), 0.0, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Mujoco, Ball, testing::Values("elliptic", "pyramidal"),
                         [](const auto& test) { return std::string(test.param); });

// The creep of MuJoCo's issue 3328: 1.4e-4 m/s with MuJoCo's Newton, 7e-7 with noslip.
TEST(MujocoStep, AGripDoesNotCreep) {
    for (const int cone : {mjCONE_ELLIPTIC, mjCONE_PYRAMIDAL}) {
        for (const char* solver : {"ssn", "pgs"}) {
            Simulation sim(grip("grip.xml"), options("hard", "coulomb", solver, 1e-9));
            sim.m()->opt.cone = cone;
            mj_resetDataKeyframe(sim.m(), sim.d(), 0);
            sim.step(500);
            const double from = sim.d()->qpos[4];
            sim.step(500);
            EXPECT_NEAR(sim.d()->qpos[4], from, 1e-9) << solver;  // in a second
            EXPECT_NEAR(sim.d()->time, 2.0, 1e-9);
        }
    }
}

// With an integrator whose matrix is not that of the problem: actuators and Coriolis forces are implicit.
TEST(MujocoStep, AnImplicitIntegratorKeepsContactsExact) {
    Simulation sim(grip("grip.xml"), options("hard"));
    sim.m()->opt.integrator = mjINT_IMPLICIT;
    for (int k = 0; k < sim.m()->nu; ++k) {  // velocity feedback
        sim.m()->actuator_biastype[k] = mjBIAS_AFFINE;
        sim.m()->actuator_biasprm[k * mjNBIAS + 2] = -200.0;
    }
    mj_resetDataKeyframe(sim.m(), sim.d(), 0);
    sim.d()->qvel[5] = 3.0;  // of the rod, about its own x
    sim.step(500);
    const double from = sim.d()->qpos[4];
    sim.step(500);
    EXPECT_NEAR(sim.d()->qpos[4], from, 1e-9);
    EXPECT_GT(sim.last().contacts, 0);
}

// Without constraints the step is MuJoCo's, to the bit.
TEST(MujocoStep, WithoutConstraintsNothingChanges) {
    for (const char* integrator : {"Euler", "implicit"}) {
        const std::string model =
            option("elliptic", "integrator='" + std::string(integrator) + "'") +
            "<worldbody><body><joint type='ball' damping='0.1'/><geom type='capsule' fromto='0 0 0 0.3 0 0' "
            "size='0.02'/>"
            "<body pos='0.3 0 0'><joint axis='0 1 0' damping='0.2'/>"
            "<geom type='capsule' fromto='0 0 0 0.3 0.1 0' size='0.02' contype='0'/></body></body></worldbody>";
        Simulation ours(model, options("hard")), mujoco(model);
        for (Simulation* sim : {&ours, &mujoco}) sim->d()->qvel[1] = 2.0;
        for (int n = 0; n < 500; ++n) {
            ours.step();
            mj_step(mujoco.m(), mujoco.d());
        }
        ASSERT_EQ(ours.d()->nefc, 0);
        for (int k = 0; k < ours.m()->nq; ++k) EXPECT_EQ(ours.d()->qpos[k], mujoco.d()->qpos[k]) << integrator;
        EXPECT_EQ(ours.d()->time, mujoco.d()->time);
    }
}

// With MuJoCo's compliance and its convex law, elliptic cones of condim 3, limits, friction loss and equality make
// MuJoCo's own problem: accelerations and forces are those of its Newton solver.
TEST(MujocoStep, MujocosOwnProblemHasMujocosAnswer) {
    const std::string model = std::string(delassus::tests::places::source) + "/tests/import/models/";
    int compared = 0, contacts = 0;
    for (const std::string name : {"humanoid.xml", "quadruped.xml"}) {
        Simulation ours(model + name, options("mujoco", "associated")), newton(model + name);
        for (Simulation* sim : {&ours, &newton}) {
            sim->m()->opt.cone = mjCONE_ELLIPTIC;
            sim->m()->opt.solver = mjSOL_NEWTON;
            sim->m()->opt.tolerance = 0.0;
            sim->m()->opt.iterations = 200;
            std::fill_n(sim->m()->geom_condim, sim->m()->ngeom, 3);
            if (sim->m()->nkey > 0) mj_resetDataKeyframe(sim->m(), sim->d(), 0);
        }
        const int nv = ours.m()->nv;
        std::fill_n(ours.m()->dof_frictionloss, nv, 0.05);
        std::fill_n(newton.m()->dof_frictionloss, nv, 0.05);
        for (int n = 0; n < 400; ++n) {
            mj_step(newton.m(), newton.d());
            if (n % 20 != 0 || newton.d()->ncon == 0) continue;
            mju_copy(ours.d()->qpos, newton.d()->qpos, ours.m()->nq);
            mju_copy(ours.d()->qvel, newton.d()->qvel, nv);
            ASSERT_EQ(ours.forward(), 0) << ours.message();
            mju_copy(newton.d()->qacc_warmstart, ours.d()->qacc, nv);
            mj_forward(newton.m(), newton.d());
            const double size = mju_norm(newton.d()->qacc, nv),
                         force = mju_norm(newton.d()->efc_force, newton.d()->nefc);
            ASSERT_EQ(ours.d()->nefc, newton.d()->nefc);
            for (int k = 0; k < nv; ++k) EXPECT_NEAR(ours.d()->qacc[k], newton.d()->qacc[k], 1e-8 * size) << name << n;
            for (int k = 0; k < ours.d()->nefc; ++k)
                EXPECT_NEAR(ours.d()->efc_force[k], newton.d()->efc_force[k], 1e-8 * force) << name << n;
            ++compared;
            contacts += ours.last().contacts;
        }
    }
    EXPECT_GT(compared, 20);
    EXPECT_GT(contacts, 50);
}

TEST(MujocoStep, WhatRestsNeedsNoSolve) {
    std::string boxes;
    for (int k = 0; k < 3; ++k)
        boxes += "<body pos='0 0 " + fmt::format("{:.12f}", 0.1 + 0.2 * k - 1e-9 * (k + 1)) +
                 "'><freejoint/><geom type='box' size='0.1 0.1 0.1' mass='1'/></body>";
    Simulation sim(option("elliptic") + "<worldbody><geom type='plane' size='5 5 1'/>" + boxes + "</worldbody>",
                   options("hard"));
    sim.step(1);
    EXPECT_EQ(sim.last().remembered, 0);
    EXPECT_EQ(sim.last().solves, 1);
    EXPECT_GE(sim.last().contacts, 12);
    sim.step(200);
    EXPECT_GE(sim.last().contacts, 12);
    EXPECT_EQ(sim.last().remembered, sim.last().contacts);
    EXPECT_EQ(sim.last().solves, 0);
    for (int k = 0; k < sim.m()->nv; ++k) EXPECT_NEAR(sim.d()->qvel[k], 0.0, 1e-9);
}

// Friction loss holds a pendulum that weighs less; a limit stops one that weighs more; an equality makes a second joint
// follow.
TEST(MujocoStep, LossLimitAndEquality) {
    Simulation sim(option("elliptic") +
                       "<compiler angle='radian'/><worldbody>"
                       "<body><joint name='held' axis='0 1 0' frictionloss='4'/>"
                       "<geom type='sphere' pos='0.3 0 0' size='0.05' mass='1'/></body>"
                       "<body pos='0 1 0'><joint name='stopped' axis='0 1 0' limited='true' range='-0.5 0.5'/>"
                       "<geom type='sphere' pos='0.3 0 0' size='0.05' mass='1'/></body>"
                       "<body pos='0 2 0'><joint name='follows' axis='0 1 0'/>"
                       "<geom type='sphere' pos='0.1 0 0' size='0.05' mass='1'/></body></worldbody>"
                       "<equality><joint joint1='follows' joint2='stopped' polycoef='0 0.5 0 0 0'/></equality>"
                       "<sensor><jointlimitfrc joint='stopped'/></sensor>",
                   options("hard"));
    sim.step(2000);
    EXPECT_NEAR(sim.d()->qpos[0], 0.0, 1e-12);
    EXPECT_NEAR(sim.d()->qpos[1], 0.5, 1e-6);
    EXPECT_NEAR(sim.d()->qvel[1], 0.0, 1e-9);
    EXPECT_NEAR(sim.d()->qpos[2], 0.25, 0.01);  // MuJoCo's soft equality
    EXPECT_NEAR(sim.d()->qfrc_constraint[0], -gravity * 0.3, 1e-9);
    EXPECT_GT(sim.d()->sensordata[0], gravity * 0.3 * std::cos(0.5));
}

// Contacts that MuJoCo sees ahead, by a margin, stop a body where the surfaces meet.
TEST(MujocoStep, AMarginSeesContactsAhead) {
    Simulation sim(option("elliptic") +
                       "<worldbody><geom type='plane' size='5 5 1' margin='0.05'/><body pos='0 0 0.5'><freejoint/>"
                       "<geom type='sphere' size='0.1'/></body></worldbody>",
                   options("hard"));
    double lowest = 1.0;
    for (int n = 0; n < 500; ++n) {
        sim.step();
        lowest = std::min(lowest, sim.d()->qpos[2]);
    }
    EXPECT_NEAR(lowest, 0.1, 1e-7);
    EXPECT_NEAR(sim.d()->qpos[2], 0.1, 1e-7);
}

TEST(MujocoStep, RobotsRun) {
    const std::string models = std::string(delassus::tests::places::source) + "/tests/import/models/";
    for (const std::string name : {"humanoid.xml", "quadruped.xml"}) {
        for (const char* contacts : {"hard", "mujoco"}) {
            for (const int condim : {1, 3, 4, 6}) {
                Simulation sim(models + name, options(contacts, "coulomb", nullptr, 1e-8));
                std::fill_n(sim.m()->geom_condim, sim.m()->ngeom, condim);
                if (sim.m()->nkey > 0) mj_resetDataKeyframe(sim.m(), sim.d(), 0);
                sim.step(300);
                EXPECT_NEAR(sim.d()->time, 300 * sim.m()->opt.timestep, 1e-9) << name << contacts << condim;
            }
        }
    }
}

std::string refusal(const std::string& model, const delassus_mujoco_options& chosen) {
    try {
        Simulation sim(model, chosen);
        const double before = sim.d()->time;
        EXPECT_EQ(sim.try_step(), -1);
        EXPECT_EQ(sim.d()->time, before);
        return sim.message();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
}

TEST(MujocoStep, RefusalsAreSentences) {
    const std::string ball =
        "<worldbody><geom type='plane' size='5 5 1'/><body pos='0 0 0.0999'><freejoint/><geom type='sphere' "
        "size='0.1'/>"
        "</body></worldbody>";
    EXPECT_NE(refusal("<option integrator='RK4'/>" + ball, {}).find("RK4"), std::string::npos);
    EXPECT_NE(refusal(ball, options("soft")).find("\"soft\""), std::string::npos);
    EXPECT_NE(refusal(ball, options("hard", "dry")).find("dry"), std::string::npos);
    EXPECT_NE(refusal(ball, options("hard", "coulomb", "nobody")).find("nobody"), std::string::npos);
}

}  // namespace

#endif
