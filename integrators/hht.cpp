// SPDX-License-Identifier: BSD-3-Clause
// The method of Hilber, Hughes and Taylor with constraints on positions (seed eq. 180–188). Order 2, damping by α.
#include "dynamics/implicit_method.hpp"

namespace delassus {
namespace {

// Newmark's position and velocity, and a balance in which the forces lag behind by α, −⅓ ≤ α ≤ 0 (seed eq. 182, with
// the other sign of λ):
//
//     M a_{n+1} = (1 + α) (f + C_qᵀ λ)_{n+1} − α (f + C_qᵀ λ)_n,      γ = ½ − α,   β = (1 − α)²/4  (seed eq. 183)
//
// a_{n+1} stands for the acceleration at t_{n+1} + α h; γ corrects for that, which gives order 2. With M that depends
// on q it would not: M_{n+1}⁻¹ (f + C_qᵀ λ)_n is not an acceleration at t_n, off by α h M⁻¹ Ṁ v̇ (measured on an elastic
// pendulum in polar coordinates: order 0.95). So the accelerations are combined and not the forces,
//
//     a_{n+1} = (1 + α) v̇_{n+1} − α v̇_n,      M v̇_{n+1} = (f + C_qᵀ λ)_{n+1}
//
// which is the same for constant M, keeps order 2 for every M, and is the generalised-α form with α_m = 0 and
// α_f = −α (the seed's remark after eq. 196 says α_f = α). γ′ = γ/(hβ), β′ = 1/((1 + α) h² β).
const RegisterTimestepper hht_row{
    {.name = "hht",
     .description = "Hilber, Hughes and Taylor: order 2 with damping of high frequencies by alpha",
     .options = newton_options({{.key = "alpha",
                                 .type = DELASSUS_OPTION_REAL,
                                 .default_value = "-0.1",
                                 .minimum = -1.0 / 3.0,
                                 .maximum = 0.0,
                                 .doc = "0: the trapezoidal rule; -1/3: the most damping"}}),
     .constraints = true,
     .unilateral = false,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         const double alpha = values[newton_option_count].real;
         auto coefficients = ImplicitCoefficients::newmark(0.5 - alpha, 0.25 * (1.0 - alpha) * (1.0 - alpha));
         coefficients.alpha_f = -alpha;
         return std::make_unique<ImplicitMethod>(system, coefficients, newton_settings("hht", values));
     }}};

}  // namespace
}  // namespace delassus
