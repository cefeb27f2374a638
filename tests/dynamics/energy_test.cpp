// SPDX-License-Identifier: BSD-3-Clause
// Energy of linear systems, from hω = 0.01 to 1e8 (h = 1). Two modes, ω and ω/2, that both coordinates share.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "support/order.hpp"
#include "support/systems/linear_oscillators.hpp"

namespace delassus::tests::energy_test {
namespace {

const double frequencies[] = {1e-2, 1.0, 1e2, 1e4, 1e6, 1e8};

/// Displaced, moving, both.
std::vector<State> starts(double omega) {
    return {{0.0, {1.0, 0.3}, {0.0, 0.0}}, {0.0, {0.0, 0.0}, {1.0, 0.3}}, {0.0, {1.0, 0.3}, {omega, -omega}}};
}

/// The energies of the states from the beginning on, until nothing is left.
std::vector<State> states(const std::string& method, const OptionTexts& options, LinearOscillators& system, int steps) {
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper(method, system, options);
    std::vector<State> result = {system.initial_state()};
    while (static_cast<int>(result.size()) <= steps && system.energy(result.back()) > 1e-150) {
        result.push_back(result.back());
        stepper->step(result.back(), 1.0, solver);
    }
    return result;
}

TEST(Energy, NeverGrowsWithImplicitEuler) {
    for (const char* method : {"euler_implicit", "euler_implicit_linearized"})
        for (const double omega : frequencies)
            for (const auto& start : starts(omega)) {
                LinearOscillators system(omega, 0.5 * omega, start);
                double before = system.energy(start);
                for (const auto& state : states(method, {}, system, 300)) {
                    EXPECT_LE(system.energy(state), before * (1.0 + 1e-14)) << method << " at " << omega;
                    before = system.energy(state);
                }
            }
}

// It is algebraically stable: what contracts in a norm contracts in it (Hairer and Wanner II, sec. IV.12).
TEST(Energy, NeverGrowsWithRadauIIA) {
    for (const double omega : frequencies)
        for (const auto& start : starts(omega)) {
            LinearOscillators system(omega, 0.5 * omega, start);
            double before = system.energy(start);
            for (const auto& state : states("radau_iia", {{"newton_tolerance", "1e-13"}}, system, 100)) {
                EXPECT_LE(system.energy(state), before * (1.0 + 1e-11)) << omega;
                before = system.energy(state);
            }
            if (omega >= 1e2) {
                EXPECT_LE(before, 1e-3 * system.energy(start)) << "fast modes vanish, at " << omega;
            }
        }
}

TEST(Energy, StaysWithTheTrapezoidalRule) {
    for (const char* method : {"trapezoidal", "trapezoidal_linearized", "newmark"})
        for (const double omega : frequencies)
            for (const auto& start : starts(omega)) {
                LinearOscillators system(omega, 0.5 * omega, start);
                const double first = system.energy(start);
                for (const auto& state : states(method, {}, system, 300))
                    EXPECT_NEAR(system.energy(state) / first, 1.0, 1e-12) << method << " at " << omega;
            }
}

// The midpoint rule solves for velocities: of stiff modes rounding costs it more digits.
TEST(Energy, StaysWithTheMethodsForVelocities) {
    for (const char* method : {"moreau_jean", "linearly_implicit_trapezoidal"})
        for (const double omega : frequencies)
            for (const auto& start : starts(omega)) {
                LinearOscillators system(omega, 0.5 * omega, start);
                const double first = system.energy(start), allowed = omega <= 100.0 ? 1e-12 : 1e-6;
                for (const auto& state : states(method, {{"linearization_limit", "inf"}}, system, 300))
                    EXPECT_NEAR(system.energy(state) / first, 1.0, allowed) << method << " at " << omega;
            }
}

// With γ > ½ the energy itself may grow for a few steps. What never grows is (Hughes, The Finite Element Method, 1987,
// ch. 9) E + ½ h² (β − γ/2) aᵀM a, with M a = −K q.
TEST(Energy, OfNewmarksMethodNeverGrowsWithItsThirdTerm) {
    for (const double omega : frequencies)
        for (const auto& start : starts(omega)) {
            LinearOscillators system(omega, 0.5 * omega, start);
            const auto extended = [&](const State& state) {
                Eigen::Vector2d a = Eigen::Vector2d::Zero();
                system.add_force(state, 1.0, a.data());
                return system.energy(state) + 0.5 * (0.3025 - 0.3) * a.squaredNorm();
            };
            double before = extended(start);
            for (const auto& state : states("newmark", {{"gamma", "0.6"}, {"beta", "0.3025"}}, system, 200)) {
                EXPECT_LE(extended(state), before * (1.0 + 1e-9)) << omega;
                before = extended(state);
            }
        }
}

struct Damped {
    std::string method;
    OptionTexts options;
    double rho;  ///< of infinite frequencies
};

// The damped methods of order 2 take a stiff mode from its first displacement to velocities of (h ω)² times the energy
// (their overshoot), and from then on damp it: by ρ_∞ a step.
TEST(Energy, OfStiffModesFallsByTheFactorChosen) {
    for (const auto& damped :
         {Damped{"generalized_alpha", {{"rho_infinity", "0.8"}}, 0.8},
          Damped{"generalized_alpha", {{"rho_infinity", "0.9"}}, 0.9},
          Damped{"generalized_alpha", {{"rho_infinity", "0.5"}}, 0.5}, Damped{"hht", {{"alpha", "-0.1"}}, 0.9 / 1.1},
          Damped{"hht", {{"alpha", "-0.3"}}, 0.7 / 1.3},
          Damped{"newmark", {{"gamma", "0.6"}, {"beta", "0.3025"}}, 0.9 / 1.1}})
        for (const double omega : {1e4, 1e6, 1e8}) {
            LinearOscillators system(omega, 0.5 * omega, starts(omega)[0]);
            const auto run = states(damped.method, damped.options, system, 90);
            ASSERT_EQ(run.size(), 91u) << damped.method;
            for (const auto& state : run)
                EXPECT_LE(system.energy(state), 2.0 * omega * omega * system.energy(run[0])) << damped.method;
            const double rate = std::pow(system.energy(run[90]) / system.energy(run[45]), 1.0 / 90.0);
            EXPECT_NEAR(rate, damped.rho, 0.03) << damped.method << " at " << omega;
        }
}

// What never grows with the generalised-α form (derived in integrators/generalized_alpha.cpp): with
// r = M (a − v̇), δ = ½ − α_f, g = α_f − α_m and b = β − γ/2 = g²/4,
//     E + ½ b h² aᵀM a + δ/(2g) rᵀK⁻¹ r
TEST(Energy, WithItsAlgorithmicTermsNeverGrowsWithGeneralizedAlpha) {
    struct Method {
        std::string name;
        OptionTexts options;
        double delta, g;
    };
    const auto alpha = [](const char* text, double rho) {
        return Method{
            "generalized_alpha", {{"rho_infinity", text}}, 0.5 * (1.0 - rho) / (1.0 + rho), (1.0 - rho) / (1.0 + rho)};
    };
    const auto hht = [](const char* text, double value) {
        return Method{"hht", {{"alpha", text}}, 0.5 + value, -value};
    };
    for (const auto& method : {alpha("0", 0.0), alpha("0.5", 0.5), alpha("0.8", 0.8), alpha("0.95", 0.95),
                               hht("-0.05", -0.05), hht("-0.1", -0.1), hht("-0.3", -0.3)})
        for (const double omega : frequencies)
            for (const auto& start : starts(omega)) {
                LinearOscillators system(omega, 0.5 * omega, start);
                const Eigen::LDLT<Eigen::Matrix2d> K(system.stiffness());
                const Registry registry;
                StepSolver solver(registry, {});
                const auto stepper = make_timestepper(method.name, system, method.options);
                State state = start;
                Eigen::Vector2d a = -system.stiffness() * Eigen::Map<const Eigen::Vector2d>(start.q.data());
                Eigen::Vector2d r = Eigen::Vector2d::Zero();
                const auto extended = [&] {
                    return system.energy(state) + 0.125 * method.g * method.g * a.squaredNorm() +
                           0.5 * method.delta / method.g * r.dot(K.solve(r));
                };
                double before = extended();
                for (int step = 0; step < 100 && before > 1e-150; ++step) {
                    stepper->step(state, 1.0, solver);
                    const auto memory = stepper->save();  // 1, v̇, a, …
                    a = Eigen::Vector2d(memory[3], memory[4]);
                    r = a - Eigen::Vector2d(memory[1], memory[2]);
                    const double now = extended();
                    ASSERT_LE(now, before * (1.0 + 1e-9)) << method.name << " at " << omega << ", step " << step;
                    before = now;
                }
            }
}

// Moving through equilibrium there is nothing to overshoot.
TEST(Energy, OfAMovingSystemStaysBelowTheFirst) {
    for (const auto& damped :
         {Damped{"generalized_alpha", {{"rho_infinity", "0.8"}}, 0.0},
          Damped{"generalized_alpha", {{"rho_infinity", "0"}}, 0.0}, Damped{"hht", {{"alpha", "-0.3"}}, 0.0},
          Damped{"newmark", {{"gamma", "0.6"}, {"beta", "0.3025"}}, 0.0}})
        for (const double omega : frequencies) {
            LinearOscillators system(omega, 0.5 * omega, starts(omega)[1]);
            for (const auto& state : states(damped.method, damped.options, system, 300))
                EXPECT_LE(system.energy(state), system.energy(starts(omega)[1]) * (1.0 + 1e-5)) << damped.method;
        }
}

}  // namespace
}  // namespace delassus::tests::energy_test
