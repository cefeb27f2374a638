// SPDX-License-Identifier: BSD-3-Clause
// The trapezoidal rule with constraints on positions (seed eq. 162–169). Order 2, without damping.
#include "dynamics/implicit_method.hpp"

namespace delassus {
namespace {

// The mean of the slopes at both ends, for positions and velocities:
//
//     q_{n+1} = q_n ∘ exp(h (v_n + v_{n+1})/2),   v_{n+1} = v_n + h (v̇_n + v̇_{n+1})/2,
//     M v̇ = f + C_qᵀ λ at both ends,              C_{n+1} = 0
//
// The seed's eq. 163 has (M_n + M_{n+1})/2 times the change of velocity instead; where M is constant that is the same.
// With Δ = (h/2)(v_n + v_{n+1}): v_{n+1} = (2/h) Δ − v_n and v̇_{n+1} = (4/h²) Δ − (4/h) v_n − v̇_n, that is γ′ = 2/h and
// β′ = 4/h²: Newmark's method with γ = ½, β = ¼, after eliminating v̇_n. Newton's unknown is the increment of the
// position, x = (h/2) Δv, and its lower right-hand side −C; in terms of Δv it is −(2/h) C, where the seed's eq. 166 has
// −C/h and so converges at half speed.
//
// In a constrained system, v̇_n is forced through λ_n: the error of λ changes its sign every step and is not damped, as
// the rule has the eigenvalue −1 (twice) at infinite frequency. docs/measurements.md has its order.
const RegisterTimestepper trapezoidal_row{
    {.name = "trapezoidal",
     .description = "trapezoidal rule by Newton's method; no damping, its multipliers oscillate",
     .options = newton_options(),
     .constraints = true,
     .unilateral = false,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<ImplicitMethod>(system, ImplicitCoefficients::newmark(0.5, 0.25),
                                                 newton_settings("trapezoidal", values));
     }}};

}  // namespace
}  // namespace delassus
