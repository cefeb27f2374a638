// SPDX-License-Identifier: BSD-3-Clause
// Mechanisms against published or closed-form values; more of them are scenes (tests/scene/published_test.cpp).
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "delassus/timestepper.hpp"
#include "support/mechanisms.hpp"

namespace delassus::published_test {
namespace {

State run(DynamicalSystem& system, const std::string& method, double end, int steps, const OptionTexts& options = {}) {
    static const Registry registry;
    SolverConfig config;
    config.tolerance = 1e-10;
    StepSolver solver(registry, config);
    const auto stepper = make_timestepper(method, system, options);
    State state = system.initial_state();
    for (int k = 0; k < steps; ++k) stepper->step(state, end / steps, solver);
    return state;
}

// Symmetric tangents: Newton needs an iteration more here and there, each several times cheaper than by LU.
const OptionTexts nearly_lossless = {{"rho_infinity", "0.95"}, {"jacobian", "symmetric"}};

TEST(Published, PendulumAfterTenSeconds) {
    // Order 2: the error falls by four from step to half step, and extrapolation takes it away.
    const auto system = tests::pendulum();
    const auto position = [&](int steps) { return run(*system, "generalized_alpha", 10.0, steps, nearly_lossless).q; };
    const auto coarse = position(10000), fine = position(20000);
    const std::array<double, 2> expected = {-0.275087462576, -0.961419205099};
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR((coarse[i] - expected[i]) / (fine[i] - expected[i]), 4.0, 0.1);
        EXPECT_NEAR((4.0 * fine[i] - coarse[i]) / 3.0, expected[i], 1e-7);
    }
}

TEST(Published, FourBarAfterTenSeconds) {
    const auto system = tests::four_bars(2);
    const double energy = system->energy(system->initial_state());
    const State state = run(*system, "generalized_alpha", 10.0, 10000, nearly_lossless);
    const Pose last = system->pose(state, 4);
    EXPECT_NEAR(2.0 * (last.position[0] - 2.0), 0.328458111541, 2e-3);
    EXPECT_NEAR(2.0 * last.position[1], 0.944518538179, 1e-3);
    EXPECT_NEAR(system->energy(state), energy, 1e-3);
}

TEST(ClosedForm, TopPrecessesSteadily) {
    // A symmetric top about its foot precesses at the rate Ω and the angle θ to the vertical where
    //     I₁ Ω² cos θ − I₃ ω₃ Ω + m g l = 0,     ω₃ = spin about its axis, I₁ about the foot.
    const double mass = 2.0, arm = 0.3, axial = 0.02, across = 0.03, theta = 0.7, rate = 3.0;
    const double about_foot = across + mass * arm * arm;
    const double spin = (about_foot * rate * rate * std::cos(theta) + mass * 9.81 * arm) / (axial * rate);
    MultibodySystem system;
    BodyParameters top;
    top.name = "top";
    top.mass = mass;
    top.inertia = {across, across, axial};
    top.pose = {{arm * std::sin(theta), 0.0, arm * std::cos(theta)},
                {std::cos(0.5 * theta), 0.0, std::sin(0.5 * theta), 0.0}};
    // ω = Ω e_z + (ω₃ − Ω cos θ) e_axis; in the body frame e_z is (−sin θ, 0, cos θ).
    top.angular_velocity = {-rate * std::sin(theta), 0.0, spin};
    top.velocity = {0.0, rate * arm * std::sin(theta), 0.0};
    JointParameters foot;
    foot.second = system.add_body(top);
    system.add_joint(foot);
    system.finish();
    const double end = 1.0;
    const State state = run(system, "generalized_alpha", end, 8000, nearly_lossless);
    const auto position = system.pose(state, 0).position;
    EXPECT_NEAR(position[2], arm * std::cos(theta), 1e-4 * arm);
    EXPECT_NEAR(std::atan2(position[1], position[0]), std::remainder(rate * end, 2.0 * M_PI), 1e-3);
}

TEST(ClosedForm, StiffSpringPendulumStretchesAsItsTension) {
    // As k → ∞ the spring is a rod, stretched by Δl = m (g cos φ + l φ̇²)/k with φ from the vertical. The fast mode,
    // with hω = √(k/m) h up to 1e3, dies out.
    for (const double stiffness : {1e6, 1e8, 1e10, 1e12}) {
        MultibodySystem system;
        system.set_gravity({0.0, -9.81, 0.0});
        BodyParameters bob;
        bob.name = "bob";
        bob.inertia = {1e-3, 1e-3, 1e-3};
        bob.pose.position = {-1.0, 0.0, 0.0};
        SpringParameters spring;
        spring.second = system.add_body(bob);
        spring.second_point = bob.pose.position;
        spring.stiffness = stiffness;
        system.add_spring(spring);
        system.finish();
        const State state = run(system, "euler_implicit", 0.5, 5000);
        const double length = std::hypot(state.q[0], state.q[1]);
        const double speed = std::hypot(state.v[0], state.v[1]);
        const double stretch = (9.81 * -state.q[1] / length + speed * speed / length) / stiffness;
        // Ten digits of the length are left for the stretch at most.
        EXPECT_NEAR(length - 1.0, stretch, 2e-3 * stretch + 4e-16) << "k = " << stiffness;
        EXPECT_GT(stretch * stiffness, 9.81);
    }
}

}  // namespace
}  // namespace delassus::published_test
