// SPDX-License-Identifier: BSD-3-Clause
// Explicit Runge–Kutta methods on the Lie group, for systems with and without bilateral constraints (internal).
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "delassus/timestepper.hpp"
#include "dynamics/linear_problem.hpp"

namespace delassus {

/// Coefficients of an explicit method of s stages.
struct ButcherTableau {
    std::string name;
    int order = 1;
    std::span<const double> c;  ///< s, the first is 0
    std::span<const double> a;  ///< the rows of the lower triangle, from the second stage on: s (s − 1)/2
    std::span<const double> b;  ///< s
    /// b less that of an embedded method of order − 1, over s + 1 stages of which the last is the beginning of the next
    /// step; empty: there is none.
    std::span<const double> error;
    /// Of the continuous extension, over as many; empty: there is none.
    std::span<const double> dense = {};
};

// Within a step the position is q(t) = q_n ∘ exp(u(t)) with u(t_n) = 0. q̇ = v means that q(t + dt) = q(t) ∘ exp(v dt),
// and as exp(u + T⁻¹(u) ε) = exp(u) ∘ exp(ε) to first order,
//
//     u̇ = T⁻¹(u) v,      v̇ = M(q_n ∘ exp(u))⁻¹ f(q_n ∘ exp(u), v, t)
//
// This is an ordinary differential equation for (u, v) in a vector space: any Runge–Kutta method keeps its order on it
// (Munthe-Kaas, Applied Numerical Mathematics 29, 1999). Without T⁻¹, that is with the sums of velocities of the seed's
// remark after eq. 54, it would be 2 where rotations do not commute.
//
// With constraints v̇ is that of the saddle point
//
//     M v̇ − C_qᵀ λ = f,      C_q v̇ = −(C̈ at v̇ = 0)
//
// which is an ordinary differential equation too, and has C = Ċ = 0 among its solutions. The method leaves them by its
// local error, and that would grow by itself. So each step ends with the nearest positions and velocities, in the norm
// of the mass at the end, at which they hold:
//
//     M x − C_qᵀ μ = 0,   C_q x = −C,        q ← q ∘ exp(x), until C is rounding
//     M x − C_qᵀ μ = 0,   C_q x = −(C_q v + C_t),   v ← v + x
//
// These changes are of the size of the local error, so that the order stays (Hairer and Wanner, Solving Ordinary
// Differential Equations II, sec. VII.2).
//
// Between, u and v are polynomials of θ = (t − t_n)/h. The cubic one with the values and slopes of both ends, and one
// term more,
//
//     y(θ) = y_n + θ δ + θ (1 − θ) ((1 − θ) (h k_1 − δ) − θ (h k_{s+1} − δ)) + θ² (1 − θ)² h Σ d_i k_i,
//     δ = y_{n+1} − y_n
//
// has order 4 where Σ d_i k_i is y⁗ h³/24 up to O(h⁴) (`dense`; Hairer, Nørsett and Wanner, sec. II.6). It meets the
// end that was returned to the constraints, as δ and k_{s+1} are those of it.
class ExplicitMethod : public Timestepper {
public:
    /// system outlives it; the tableau's arrays too.
    ExplicitMethod(DynamicalSystem& system, ButcherTableau tableau,
                   double error_limit = std::numeric_limits<double>::infinity());

    void restart() override;
    [[nodiscard]] int order() const override { return tableau_.order; }
    [[nodiscard]] bool has_embedded_error() const override { return !tableau_.error.empty(); }
    [[nodiscard]] EmbeddedError embedded_error() const override;
    [[nodiscard]] double error_limit() const override { return error_limit_; }
    [[nodiscard]] bool has_extension() const override { return !tableau_.dense.empty(); }
    void extend(ContinuousExtension& way) const override;
    // What is known at the end of the last step: the state, its accelerations and multipliers.
    [[nodiscard]] std::vector<double> save() const override;
    void load(const std::vector<double>& memory) override;

private:
    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override;
    void begin(const State& state, StepSolver& solver, StepReport& report);
    void return_to_constraints(const State& begin, double h, StepSolver& solver, StepReport& report);
    /// M x − Dᵀ μ = 0, D x + b = 0 with M and D at the state; b is left to the caller.
    [[nodiscard]] Problem nearest(const State& state);

    DynamicalSystem& system_;
    ButcherTableau tableau_;
    double error_limit_;
    Accelerations accelerations_;
    std::int32_t n_, m_;
    std::vector<Cone> cones_;
    bool known_ = false;
    bool stepped_ = false;       ///< end_ and known_at_ are the ends of a step
    State known_at_;             // where `last_` was found
    LinearSolution last_;        // accelerations there
    std::vector<Vector> u_, v_;  // slopes of the stages
    Vector increment_, stage_v_, error_q_, error_v_;
    State stage_, end_;  // end_: since the step, its beginning
    std::vector<DiagonalBlock3> blocks_;
    LinearSolution solution_;
    MatrixAssembler M_, D_;
};

}  // namespace delassus
