// SPDX-License-Identifier: BSD-3-Clause
// Newmark's methods with constraints on positions (seed eq. 172–179). Order 2 for γ = ½, else 1.
#include "dynamics/implicit_method.hpp"

namespace delassus {
namespace {

// The acceleration within a step is a mean of those at its ends, by weights that differ for position and velocity:
//
//     Δ = h v_n + h² ((½ − β) a_n + β a_{n+1}),   v_{n+1} = v_n + h ((1 − γ) a_n + γ a_{n+1}),
//     M a_{n+1} = (f + C_qᵀ λ)_{n+1},             C_{n+1} = 0
//
// Solved for Δ: γ′ = γ/(h β), β′ = 1/(h² β). Seed eq. 174 has λ with the other sign, and its Newton equation 175 lacks
// the minus before the residual; its unknown is Δa = x/(β h²), hence −C/(β h²) there and −C here.
//
// Expanded about t_n, the velocity is off by (γ − ½) h² v̈ a step: order 2 for γ = ½ only, and γ > ½ damps. A-stable
// for 2β ≥ γ ≥ ½; the best damping of high frequencies is that of β = (γ + ½)²/4, 0.3025 for γ = 0.6. With γ = ½,
// β = ¼ it is the trapezoidal rule. β < ½γ is refused with joints (ImplicitCoefficients::reaction_growth).
const RegisterTimestepper newmark_row{
    {.name = "newmark",
     .description = "Newmark's family; gamma = 0.5 is of order 2 without damping, more damps and is of order 1",
     .options = newton_options({{.key = "gamma",
                                 .type = DELASSUS_OPTION_REAL,
                                 .default_value = "0.5",
                                 .minimum = 0.5,
                                 .maximum = 1.0,
                                 .doc = "weight of the new acceleration in the velocity"},
                                {.key = "beta",
                                 .type = DELASSUS_OPTION_REAL,
                                 .default_value = "0.25",
                                 .minimum = 0.01,
                                 .maximum = 1.0,
                                 .doc = "weight of the new acceleration in the position; at least gamma/2 for "
                                        "stability with any step"}}),
     .constraints = true,
     .unilateral = false,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         const auto* own = values.data() + newton_option_count;
         return std::make_unique<ImplicitMethod>(system, ImplicitCoefficients::newmark(own[0].real, own[1].real),
                                                 newton_settings("newmark", values));
     }}};

}  // namespace
}  // namespace delassus
