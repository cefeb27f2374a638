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
//
// ---- Energy of linear systems ----
//
// Without damping forces E alone may grow for some steps where ρ_∞ < 1. With r = M (a − v̇), δ = ½ − α_f,
// g = α_f − α_m = γ − ½ and b = β − γ/2 = g²/4 (also of hht.cpp), what never grows is
//
//     E* = E + ½ b h² aᵀM a + δ/(2g) rᵀK⁻¹ r
//
// Let [·] be the change and ⟨·⟩ the mean over a step. Newmark's formulas give [q] = h⟨v⟩ + b h² [a] and [v] = h⟨a⟩ +
// g h [a], the balance is ⟨r⟩ = −δ [r] − g M [a], and what remains is
//
//     [E*] = −b g h² ‖[a]‖²_M − δ (1 + δ/g) ‖[r]‖²_{K⁻¹}
//
// At the start r = 0 and M a = −K q, so that E never exceeds (1 + (g h ω)²/4) times its first value.
//
// ---- Turning constraints ----
//
// The damping by ρ_∞ holds where C_q stays. A disturbance of λ, along the normals, alternates from step to step by the
// factor −ρ_∞. If a step turns the constraints by an angle θ, the normals have turned by θ one step later: a part of
// the disturbance in proportion to θ moves what the constraints leave free, and comes back from there. The factor
// becomes ρ_∞ + c θ with c of the order of 1, so that beyond some θ the method gains energy and fails, with any solver.
//
// For a body of mass m and moment J at the arm l from a hinge, which turns by θ a step without other forces, the step
// (q, v, a, v̇) ↦ (q, v, a, v̇) was linearised in axes that turn along. Apart from the two eigenvalues 1 of the turning
// itself, the largest of ρ_∞ = 1 at θ = 0.02, 0.1 and 0.3 are 1.011, 1.057 and 1.180 (J = m l²/3): above 1 for any θ.
// Otherwise it reaches 1 at this θ (rad a step):
//
//     J / m l²              1/100   1/3     1      3
//     ρ_∞ = 0.9             0.08    0.13   0.15   0.20
//     ρ_∞ = 0.8             0.16    0.28   0.32   0.42
//     ρ_∞ = 0.6             0.35    0.62   0.70   0.90
//     ρ_∞ = 0.4             0.59    1.1    1.2    1.4
//     ρ_∞ = 0.2             0.92    2.2    2.3    2.5
//     hht, α = −0.1         0.20    0.35   0.41   0.55
//     hht, α = −0.3         0.45    0.83   0.92   1.1
//
// Runs of this body agree: with ρ_∞ = 0.8 and J = m l²/3 it keeps turning at θ = 0.26 and fails from 0.28 on.
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
