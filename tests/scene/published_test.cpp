// SPDX-License-Identifier: BSD-3-Clause
// Example scenes of mechanisms against published values.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "support/mechanisms.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::published_test {
namespace {

TEST(ExampleScene, SqueezerIsWhereTheHandbookHasIt) {
    Running run(read_scene(example_scene("squeezer")));
    run.finish();
    std::array<double, 8> angle{};
    for (std::size_t k = 1; k < 8; ++k) angle[k] = angle_about_z(run.pose("K" + std::to_string(k)));
    const std::array<double, 7> found = {angle[1], angle[2] - angle[1], angle[3], angle[4] - angle[5],
                                         angle[5], angle[6] - angle[7], angle[7]};
    const std::array<double, 7> published = {15.81077119629904,   -15.75637105984298, 0.04082224013073101,
                                             -0.5347301163226948, 0.5244099658805304, 0.5347301163226948,
                                             1.048080741042263};
    for (std::size_t k = 0; k < 7; ++k)
        EXPECT_LE(std::abs(std::remainder(found[k] - published[k], 2.0 * std::numbers::pi)), 2e-4) << k;
}

TEST(ExampleScene, BricardMovesWithoutLosingEnergy) {
    SceneOverrides overrides;
    overrides.end = 10;
    Running run(read_scene(example_scene("bricard"), overrides));
    EXPECT_EQ(5 * 6 - run.system().constraint_rows(), 0) << "Gruebler's count";
    EXPECT_EQ(5 * 6 - run.system().m(), 1) << "its freedom, since others imply one row";
    const State start = run.simulation.state();
    run.finish();
    double moved = 0.0;
    for (BodyIndex k = 0; k < 5; ++k)
        moved = std::max(moved, std::abs(run.system().pose(run.simulation.state(), k).position[1] -
                                         run.system().pose(start, k).position[1]));
    EXPECT_GT(moved, 0.1);
    EXPECT_NEAR(run.simulation.totals().energy, run.simulation.totals().start_energy, 1e-4);
}

// The governor in three coordinates: the arms' angle β below the horizontal, the slider's height z, the shaft's angle
// ψ, whose momentum L stays. An arm (mass m, moments I_a along it and I_t across) has its mass centre at c from its
// hinge, which is at e = 0.05 m from the shaft and at the height 1 m:
//     J(β) = J₀ + 2 (m (e + c cos β)² + I_a sin² β + I_t cos² β),   ψ̇ = L/J
//     2 (m c² + I_t) β̈ = ½ J′ ψ̇² + 2 m g c cos β − 2 F ∂ℓ/∂β,      m_s z̈ = −m_s g − 2 F ∂ℓ/∂z
// with the spring's length ℓ² = (½ cos β)² + (1 − ½ sin β − z)² and force F = K (ℓ − ½) + C dℓ/dt.
class Governor {
public:
    using State = std::array<double, 4>;  // β, z, and their rates

    [[nodiscard]] static State after(double end, int steps) {
        State y = {beta_start, 0.5, 0.0, 0.0};
        const double h = end / steps;
        for (int k = 0; k < steps; ++k) {  // Runge and Kutta's method of order 4
            const State k1 = rate(y), k2 = rate(moved(y, 0.5 * h, k1)), k3 = rate(moved(y, 0.5 * h, k2)),
                        k4 = rate(moved(y, h, k3));
            for (std::size_t i = 0; i < 4; ++i) y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
        return y;
    }

private:
    static constexpr double g = 9.81, e = 0.05, slider = 3.0, ball = 5.0, rod = 0.3, m = ball + rod;
    static constexpr double c = (0.5 * rod + ball) / m, beta_start = std::numbers::pi / 6;
    static constexpr double along = rod * 2e-4 / 12;
    static constexpr double across =
        rod * (1.0 + 1e-4) / 12 + rod * (c - 0.5) * (c - 0.5) + ball * (1.0 - c) * (1.0 - c);
    static constexpr double stiffness = 8e5, damping = 4e4;

    static double J(double beta) {
        return 5e-6 + 0.005 +
               2.0 * (m * std::pow(e + c * std::cos(beta), 2) + along * std::pow(std::sin(beta), 2) +
                      across * std::pow(std::cos(beta), 2));
    }
    static State moved(const State& y, double h, const State& dy) {
        return {y[0] + h * dy[0], y[1] + h * dy[1], y[2] + h * dy[2], y[3] + h * dy[3]};
    }
    static State rate(const State& y) {
        const double cosine = std::cos(y[0]), sine = std::sin(y[0]);
        const double spin = 2.0 * std::numbers::pi * J(beta_start) / J(y[0]);
        const double slope = 2.0 * (-2.0 * m * (e + c * cosine) * c * sine + 2.0 * (along - across) * sine * cosine);
        const double height = 1.0 - 0.5 * sine - y[1], length = std::hypot(0.5 * cosine, height);
        const double by_beta = (-0.25 * cosine * sine - 0.5 * cosine * height) / length, by_z = -height / length;
        const double force = stiffness * (length - 0.5) + damping * (by_beta * y[2] + by_z * y[3]);
        return {y[2], y[3],
                (0.5 * slope * spin * spin + 2.0 * m * g * c * cosine - 2.0 * force * by_beta) /
                    (2.0 * (m * c * c + across)),
                -g - 2.0 * force * by_z / slider};
    }
};

TEST(ExampleScene, GovernorFollowsItsThreeCoordinates) {
    Running run(read_scene(example_scene("governor")));
    const double momentum = run.simulation.record().angular_momentum[2];
    for (const double time : {0.25, 0.5, 1.0}) {
        while (run.simulation.state().t < time - 1e-9) run.simulation.step();
        const auto expected = Governor::after(time, static_cast<int>(std::lround(time / 4e-5)));
        EXPECT_NEAR(run.pose("slider").position[2], expected[1], 2e-5) << time;
        EXPECT_NEAR(run.velocities("slider")[0][2], expected[3], 2e-4) << time;
        EXPECT_NEAR(run.simulation.record().angular_momentum[2], momentum, 1e-5 * momentum) << time;
    }
}

}  // namespace
}  // namespace delassus::tests::published_test
