// SPDX-License-Identifier: BSD-3-Clause
// The price of the associated law: a sliding contact opens with u_n = μ‖u_t‖ (docs/problem.md); exact Coulomb keeps it
// closed. Examples/scenes/friction_laws.yaml with other μ and steps.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "delassus/sdk/problem_view.hpp"
#include "delassus/timestepper.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::friction_laws_test {
namespace {

struct Case {
    Law law;
    double mu;
    double step;  ///< s
};

/// A block of 0.2 m height on the ground, z = 0.1 m at rest.
Scene block_on_ground(const Case& chosen, const std::string& gravity, const std::string& velocity) {
    return parse_scene(
        fmt::format("step: {}\nend: 1\ngravity: {}\nenvelope: 0.05\n"
                    "solver: {{name: pgs, law: {}, tolerance: 1.0e-12}}\n"
                    "materials: {{wood: {{friction: {}}}}}\nbodies:\n"
                    "  - {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: wood}}]}}\n"
                    "  - {{name: block, mass: 2, position: [0, 0, 0.1], velocity: {}, shapes: [{{box: {{size: [0.6, "
                    "0.4, 0.2]}}, material: wood}}]}}\n",
                    chosen.step, gravity, chosen.law == Law::Coulomb ? "coulomb" : "associated", chosen.mu, velocity),
        "s.yaml");
}

class FrictionLaws : public testing::TestWithParam<Case> {
protected:
    /// Takes steps until t and checks each contact of each step that has some.
    void slide(Scene& scene, double until) {
        auto& system = *scene.systems[0].system;
        StepSolver solver(registry(), scene.systems[0].solver);
        Problem problem;
        solver.watch([&](const Problem& seen) { problem = seen; });
        const auto stepper = make_timestepper("euler_implicit_linearized", system);
        state_ = system.initial_state();
        while (state_.t < until - 1e-9) {
            problem = {};
            const auto report = stepper->step(state_, GetParam().step, solver);
            ASSERT_TRUE(report.solved) << report.message;
            if (problem.m() == 0) continue;
            const PreparedProblem prepared(problem);
            const sdk::ProblemView view(prepared.raw());
            const Eigen::VectorXd u = view.D * sdk::VectorView(state_.v.data(), view.n) + view.b;
            for (const auto& cone : view.cones) {
                const double tangential = u.segment<2>(cone.first_row + 1).norm();
                const double opening = GetParam().law == Law::Associated ? GetParam().mu * tangential : 0.0;
                ASSERT_NEAR(u[cone.first_row], opening, 1e-8) << "at t = " << state_.t;
            }
            ++steps_with_contact_;
        }
        height_ = system.pose(state_, system.find_body("block")).position[2] - 0.1;
        speed_ = system.velocities(state_, system.find_body("block"))[0];
    }

    State state_;
    int steps_with_contact_ = 0;
    double height_ = 0.0;
    Vector3 speed_{};
};

// Down an incline of 40° from rest. The gap Φ goes into u_n = v_n + Φ/h, so that u_n = μ‖u_t‖ at the end of a step
// means that the block floats at Φ = h μ v; its friction is that of its weight but for the speed at which Φ grows.
TEST_P(FrictionLaws, SlidingDown) {
    const double mu = GetParam().mu, h = GetParam().step, angle = 40.0 * M_PI / 180.0;
    Scene scene = block_on_ground(
        GetParam(), fmt::format("[{}, 0, {}]", 9.81 * std::sin(angle), -9.81 * std::cos(angle)), "[0, 0, 0]");
    slide(scene, 0.2);
    EXPECT_EQ(steps_with_contact_, std::lround(0.2 / h));
    const double v = 0.2 * 9.81 * (std::sin(angle) - mu * std::cos(angle));
    if (GetParam().law == Law::Coulomb) {
        EXPECT_NEAR(speed_[0], v, 1e-8);
        EXPECT_NEAR(height_, 0.0, 1e-10);
    } else {
        // M v̇ = h f + impulses over all steps: μ (v_n at the end) less than without the artefact, v_n = h μ a.
        EXPECT_NEAR(speed_[0], v - mu * speed_[2], 1e-8);
        EXPECT_NEAR(height_, h * mu * speed_[0], 1e-9);  // gaps have a resolution of 1e-9 of the size
    }
}

// Thrown onto the ground at 2 m/s: after the first step v = (v₀ − μ g h)/(1 + μ²) under the associated law, and the
// block leaves the ground at μ v, however small the step.
TEST_P(FrictionLaws, ThrownOntoTheGround) {
    const double mu = GetParam().mu, h = GetParam().step;
    Scene scene = block_on_ground(GetParam(), "[0, 0, -9.81]", "[2, 0, 0]");
    slide(scene, h);
    EXPECT_EQ(steps_with_contact_, 1);
    if (GetParam().law == Law::Coulomb) {
        EXPECT_NEAR(speed_[0], 2.0 - mu * 9.81 * h, 1e-8);
        EXPECT_NEAR(speed_[2], 0.0, 1e-8);
    } else {
        const double v = (2.0 - mu * 9.81 * h) / (1.0 + mu * mu);
        EXPECT_NEAR(speed_[0], v, 1e-8);
        EXPECT_NEAR(speed_[2], mu * v, 1e-8);
    }
}

INSTANTIATE_TEST_SUITE_P(Cases, FrictionLaws,
                         testing::Values(Case{Law::Associated, 0.1, 1e-2}, Case{Law::Associated, 0.6, 1e-2},
                                         Case{Law::Associated, 0.3, 1e-3}, Case{Law::Coulomb, 0.1, 1e-2},
                                         Case{Law::Coulomb, 0.6, 1e-2}, Case{Law::Coulomb, 0.3, 1e-3}),
                         [](const auto& chosen) {
                             const Case& one = chosen.param;
                             return fmt::format("{}_mu{:.0f}_step{:.0f}ms",
                                                one.law == Law::Coulomb ? "coulomb" : "associated", 10 * one.mu,
                                                1e3 * one.step);
                         });

}  // namespace
}  // namespace delassus::tests::friction_laws_test
