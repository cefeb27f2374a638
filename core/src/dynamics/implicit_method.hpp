// SPDX-License-Identifier: BSD-3-Clause
// The implicit one-step methods of integrators/ have one form, and differ in six numbers (internal).
#pragma once

#include <cmath>

#include "dynamics/newton.hpp"

namespace delassus {

/// An implicit method for M v̇ = f + C_qᵀ λ, C = 0, all of it at the end of the step:
///
///     Δ = h v_n + h² (position_old a_n + position_new a_{n+1}),          q_{n+1} = q_n ∘ exp(Δ)
///     v_{n+1} = v_n + h (velocity_old a_n + velocity_new a_{n+1})
///     (1 − alpha_m) a_{n+1} + alpha_m a_n = (1 − alpha_f) v̇_{n+1} + alpha_f v̇_n
///
/// a is the algorithmic acceleration, v̇ the one that fits the forces. velocity_new, position_new, 1 − alpha_m and
/// 1 − alpha_f are positive.
struct ImplicitCoefficients {
    double position_old = 0.0, position_new = 1.0;
    double velocity_old = 0.0, velocity_new = 1.0;
    double alpha_m = 0.0, alpha_f = 0.0;

    /// Newmark's two: β and γ.
    static ImplicitCoefficients newmark(double gamma, double beta) {
        return {0.5 - beta, beta, 1.0 - gamma, gamma, 0.0, 0.0};
    }

    /// Chung and Hulbert's, by the factor ρ_∞ of infinite frequencies (integrators/generalized_alpha.cpp).
    static ImplicitCoefficients generalized_alpha(double rho) {
        const double alpha_m = (2.0 * rho - 1.0) / (1.0 + rho), alpha_f = rho / (1.0 + rho);
        const double gamma = 0.5 + alpha_f - alpha_m;
        auto coefficients = newmark(gamma, 0.25 * (gamma + 0.5) * (gamma + 0.5));
        coefficients.alpha_m = alpha_m;
        coefficients.alpha_f = alpha_f;
        return coefficients;
    }

    /// Whether accelerations of the step before enter: the first step then needs consistent ones.
    [[nodiscard]] bool remembers() const {
        return position_old != 0.0 || velocity_old != 0.0 || alpha_m != 0.0 || alpha_f != 0.0;
    }

    /// By what factor a step multiplies errors of the reactions of joints (ImplicitMethod::reaction_growth).
    [[nodiscard]] double reaction_growth() const;

    /// 2 if γ = ½ + α_f − α_m and positions are of order 2 in themselves, else 1.
    [[nodiscard]] int order() const {
        const bool second = std::abs(velocity_new - 0.5 - alpha_f + alpha_m) < 1e-12 &&
                            std::abs(position_old + position_new - 0.5) < 1e-12;
        return second ? 2 : 1;
    }
};

class ImplicitMethod : public Timestepper {
public:
    /// system outlives it.
    ImplicitMethod(DynamicalSystem& system, ImplicitCoefficients coefficients, NewtonSettings settings);

    void restart() override;
    /// A force beside the system's, n, in the steps to come.
    void set_load(Vector load) { newton_.set_load(std::move(load)); }
    [[nodiscard]] int order() const override { return c_.order(); }
    /// Of these methods, only implicit Euler remembers nothing.
    [[nodiscard]] bool damps_at_once() const override { return !c_.remembers(); }
    [[nodiscard]] double reaction_growth() const override { return c_.reaction_growth(); }
    [[nodiscard]] std::vector<double> save() const override;
    void load(const std::vector<double>& memory) override;

private:
    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override;
    [[nodiscard]] StepPoint steady(const State& begin, double h, const Vector& lambda) const;
    [[nodiscard]] StepPoint resting(const State& begin, double h, StepSlopes slopes, const Vector& lambda) const;

    DynamicalSystem& system_;
    std::string method_;
    ImplicitCoefficients c_;
    Accelerations accelerations_;
    Newton newton_;
    std::int32_t n_, m_;
    bool started_ = false;
    Vector v_dot_, a_;  // v̇_n and a_n
};

}  // namespace delassus
