// SPDX-License-Identifier: BSD-3-Clause
// The implicit Euler method with constraints on positions (seed eq. 152–159). Order 1.
#include "dynamics/implicit_method.hpp"

namespace delassus {
namespace {

// Forces, reactions and constraints are taken at the end of the step:
//
//     q_{n+1} = q_n ∘ exp(h v_{n+1}),   M v̇_{n+1} = (f + C_qᵀ λ)_{n+1},   v̇_{n+1} = (v_{n+1} − v_n)/h,   C_{n+1} = 0
//
// In terms of Δ = h v_{n+1}: v = Δ/h and v̇ = (Δ − h v_n)/h², that is γ′ = 1/h, β′ = 1/h². Newton's unknown is the
// increment of the position, so that the lower right-hand side is −C; seed eq. 156 with its unknown Δv = Δq/h has −C/h
// (not −C_q/h, and Δq = h Δv, not (h/2) Δv as the line above it says).
//
// L-stable: motions much faster than 1/h vanish within a step, and the energy of linear systems never grows, as the
// balance M (v⁺ − v) = −h K q⁺ − h R v⁺ times v⁺ is E⁺ − E = −½‖v⁺ − v‖²_M − ½‖q⁺ − q‖²_K − h v⁺ᵀR v⁺. λ is of first
// order from the second step on. In the first step v̇, and so λ, is off by a share that does not fall with h,
// because (q_1 − q_0)/h is the velocity in the middle of the step.
const RegisterTimestepper euler_implicit_row{
    {.name = "euler_implicit",
     .description = "implicit Euler by Newton's method, constraints on positions; strongly damped",
     .options = newton_options(),
     .constraints = true,
     .unilateral = false,
     .order = 1,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<ImplicitMethod>(system, ImplicitCoefficients{},
                                                 newton_settings("euler_implicit", values));
     }}};

}  // namespace
}  // namespace delassus
