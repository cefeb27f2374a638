// SPDX-License-Identifier: BSD-3-Clause
// Contact and friction against closed forms, by the linearised implicit Euler method with the exact Coulomb law.
#include "mechanics/contact_fixture.hpp"

namespace delassus::contact_test {
namespace {

using tests::about_y;
using tests::ContactTest;
using tests::g;

TEST_F(ContactTest, SphereSlidesThenRolls) {
    // Friction −μ m g until v = ω r: at t = 2 v₀/(7 μ g), and v = 5 v₀/7 from then on.
    const double radius = 0.2, mu = 0.3, v0 = 2.0, h = 1e-3;
    add_ground(0.0, mu);
    const auto sphere = add_sphere({0.0, 0.0, radius}, radius);
    system->finish();
    const double rolls = 2.0 * v0 / (7.0 * mu * g);
    SolverConfig config;
    config.name = "pgs";
    config.tolerance = 1e-10;
    config.law = Law::Coulomb;
    StepSolver solver(registry, config);
    const auto stepper = make_timestepper("euler_implicit_linearized", *system);
    State state = system->initial_state();
    state.v[0] = v0;
    double began = 0.0;
    while (state.t < 1.5 * rolls) {
        stepper->step(state, h, solver);
        const double slip = state.v[0] - radius * state.v[4];
        if (slip > 1e-6) began = state.t;
        if (state.t < 0.9 * rolls) {
            EXPECT_NEAR(state.v[0], v0 - mu * g * state.t, 1e-8);
        }
    }
    EXPECT_NEAR(began, rolls, 1.5 * h);
    EXPECT_NEAR(state.v[0], 5.0 / 7.0 * v0, 1e-8);
    EXPECT_NEAR(system->pose(state, sphere).position[2], radius, 1e-9);
}

TEST_F(ContactTest, BoxOnAnInclineSticksOrSlides) {
    for (const double mu : {0.2, 0.56, 0.594, 0.8}) {
        const double angle = std::atan(0.577), half = 0.1;
        start_anew();
        add_ground(angle, mu);
        add_box({{half * std::sin(angle), 0.0, half * std::cos(angle)}, about_y(angle)}, {2 * half, half, half});
        system->finish();
        const double end = 0.5;
        const State state = run(end, 1e-2);
        const double speed = std::hypot(state.v[0], state.v[2]);
        const double expected = mu >= 0.577 ? 0.0 : g * (std::sin(angle) - mu * std::cos(angle)) * end;
        EXPECT_NEAR(speed, expected, 1e-7) << "mu " << mu;
        EXPECT_EQ(last.cones.size(), 4U) << "a face on a plane has four points";
    }
}

TEST_F(ContactTest, SphereOnAnInclineRollsWhereFrictionSuffices) {
    // Rolling needs the friction 2/7 m g sin θ; else it slips with a = g (sin θ − μ cos θ).
    const double angle = 0.5, radius = 0.1, end = 0.4;
    for (const double factor : {0.7, 0.97, 1.03}) {
        const double mu = factor * 2.0 / 7.0 * std::tan(angle);
        start_anew();
        add_ground(angle, mu);
        add_sphere({radius * std::sin(angle), 0.0, radius * std::cos(angle)}, radius);
        system->finish();
        const State state = run(end, 1e-3);
        const double speed = std::hypot(state.v[0], state.v[2]);
        const double acceleration =
            factor > 1.0 ? 5.0 / 7.0 * g * std::sin(angle) : g * (std::sin(angle) - mu * std::cos(angle));
        EXPECT_NEAR(speed, acceleration * end, 1e-6);
        // The friction's moment turns it by 5 μ g cos θ/(2 r) while it slips.
        EXPECT_NEAR(state.v[4] * radius, factor > 1.0 ? speed : 2.5 * mu * g * std::cos(angle) * end, 1e-6);
    }
}

TEST_F(ContactTest, StackCarriesItsWeight) {
    // The contacts under the j-th box carry g Σ_{k ≥ j} m_k.
    const double half = 0.1, h = 1e-2;
    add_ground(0.0, 0.5);
    std::vector<double> mass = {1.0, 2.0, 0.5, 3.0};
    for (std::size_t k = 0; k < mass.size(); ++k)
        add_box({{0.0, 0.0, half * (2.0 * static_cast<double>(k) + 1.0)}, {1, 0, 0, 0}}, {half, half, half}, mass[k]);
    system->finish();
    SolverConfig config;
    config.name = "pgs";
    config.tolerance = 1e-11;
    StepSolver solver(registry, config);
    const auto stepper = make_timestepper("euler_implicit_linearized", *system);
    State state = system->initial_state();
    for (int k = 0; k < 20; ++k) stepper->step(state, h, solver);
    UnilateralRows rows;
    system->collect_unilateral(state, h, rows);
    ASSERT_EQ(rows.contacts().size(), 16U);
    Problem seen;
    solver.watch([&](const Problem& problem) { seen = problem; });
    stepper->step(state, h, solver);
    Solution solution;
    Solver pgs = make_solver(registry, config);
    SolveSettings settings;
    settings.tolerance = 1e-11;
    pgs.solve(PreparedProblem(seen), solution, settings);
    std::vector<double> force(mass.size(), 0.0);
    for (std::size_t c = 0; c < 16; ++c) force[c / 4] += solution.lambda[3 * c] / h;
    double above = 0.0;
    for (std::size_t k = mass.size(); k-- > 0;) {
        above += mass[k];
        EXPECT_NEAR(force[k], g * above, 1e-6 * g * above) << "under box " << k;
    }
    for (const double v : state.v) EXPECT_NEAR(v, 0.0, 1e-9);
}

TEST_F(ContactTest, BallBouncesUntilItsLastBounce) {
    // √(2h/g) (1 + e)/(1 − e) until rest, for a fall from the height h; first order in the step.
    const double height = 0.5, e = 0.5, radius = 0.05;
    add_ground(0.0, 0.0, e);
    add_sphere({0.0, 0.0, radius + height}, radius);
    system->finish();
    const double expected = std::sqrt(2.0 * height / g) * (1.0 + e) / (1.0 - e);
    double moving_until = 0.0;
    const State state = run(1.3 * expected, 1e-4, [&](const State& now) {
        if (std::abs(now.v[2]) > 2e-3) moving_until = now.t;
    });
    EXPECT_NEAR(moving_until, expected, 0.02 * expected);
    EXPECT_NEAR(state.q[2], radius, 1e-4);
    EXPECT_EQ(last.cones.front().kind, ConeKind::Nonnegative) << "no friction, one row";
    EXPECT_EQ(last.m(), 1);
}

TEST_F(ContactTest, NothingNearMakesNoRows) {
    add_ground(0.0, 0.5);
    add_sphere({0.0, 0.0, 1.0}, 0.1);
    system->finish();
    run(0.01, 1e-3);
    EXPECT_EQ(last.m(), 0);
}

TEST_F(ContactTest, LimitsAndBoundedMotors) {
    // A slider pushed by a motor that can give 2 N against a stop at 0.1 m: it accelerates at 2 m/s², then rests there.
    BodyParameters body;
    body.name = "slider";
    const auto slider = system->add_body(body);
    JointParameters joint;
    joint.name = "rail";
    joint.kind = JointKind::Prismatic;
    joint.second = slider;
    joint.axis = {1.0, 0.0, 0.0};
    joint.upper = 0.1;
    MotorParameters motor;
    motor.name = "push";
    motor.joint = system->add_joint(joint);
    motor.speed = true;
    motor.motion = Motion::constant(10.0);
    motor.force_limit = 2.0;
    system->add_motor(motor);
    system->finish();
    const double h = 1e-3;
    const State state = run(1.0, h, [&](const State& now) {
        if (now.t < 0.3) {
            EXPECT_NEAR(now.v[0], 2.0 * now.t, 1e-9);
        }
        EXPECT_LE(now.q[0], 0.1 + 1e-9);
    });
    EXPECT_NEAR(state.q[0], 0.1, 1e-9);
    EXPECT_NEAR(state.v[0], 0.0, 1e-9);
}

}  // namespace
}  // namespace delassus::contact_test
