// SPDX-License-Identifier: BSD-3-Clause
// The generalised-α method on Lie groups with constraints on positions (seed eq. 189–201). Order 2, damping by ρ_∞.
#include "dynamics/implicit_method.hpp"

namespace delassus {
namespace {

// Newmark's position and velocity with an algorithmic acceleration a, which is tied to the one of the forces, v̇, by
//
//     (1 − α_m) a_{n+1} + α_m a_n = (1 − α_f) v̇_{n+1} + α_f v̇_n,   M v̇_{n+1} = (f + C_qᵀ λ)_{n+1},   C_{n+1} = 0
//
// (seed eq. 191–192 with the other sign of λ; Chung and Hulbert 1993; Arnold and Brüls, Multibody System Dynamics 18,
// 2007; on Lie groups Brüls, Cardona and Arnold, Mechanism and Machine Theory 48, 2012). a_n approximates v̇ at
// t_n + (α_m − α_f) h. A mode of infinite frequency is multiplied by ρ_∞ ∈ [0, 1] a step with (seed eq. 193–196)
//
//     α_m = (2ρ_∞ − 1)/(1 + ρ_∞),   α_f = ρ_∞/(1 + ρ_∞),   γ = ½ + α_f − α_m,   β = (γ + ½)²/4
//
// where the choice of γ gives order 2. γ′ = γ/(hβ), β′ = (1 − α_m)/((1 − α_f) h² β). Once v̇_{n+1} is known,
//
//     a_{n+1} = (α_f v̇_n − α_m a_n)/(1 − α_m) + (1 − α_f)/(1 − α_m) v̇_{n+1}
//
// where the seed's last update has a_n for the first term. The first step has a_0 = v̇_0, an error of O(h) that decays
// for ρ_∞ < 1. q and v are of order 2 from the first step on, λ after that error has decayed.
const RegisterTimestepper generalized_alpha_row{
    {.name = "generalized_alpha",
     .description = "generalised-alpha: order 2 with damping of high frequencies by rho_infinity",
     .options =
         newton_options({{.key = "rho_infinity",
                          .type = DELASSUS_OPTION_REAL,
                          .default_value = "0.8",
                          .minimum = 0.0,
                          .maximum = 1.0,
                          .doc = "factor of the highest frequencies in a step; 0: gone at once, 1: no damping"}}),
     .constraints = true,
     .unilateral = false,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<ImplicitMethod>(
             system, ImplicitCoefficients::generalized_alpha(values[newton_option_count].real),
             newton_settings("generalized_alpha", values));
     }}};

}  // namespace
}  // namespace delassus
