// SPDX-License-Identifier: BSD-3-Clause
// The method of order 5 of Dormand and Prince with its embedded one of order 4 (Journal of Computational and Applied
// Mathematics 6, 1980; Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, table II.5.2). Its
// seventh stage is the first one of the next step.
//
// Its continuous extension (dynamics/explicit_method.hpp) has order 4 where
//
//     Σ d_i c_iᵏ = 0 for k = 0, 1, 2;  1/4 for k = 3;   Σ d_i a_ij c_j² = 1/12,   Σ d_i a_i2 = 0
//
// as Σ_j a_ij c_j = c_i²/2 but for i = 2. d_2 = 0 follows, and d_7 is free. The error of order 5, in the mean over the
// step and all nine trees, is least at d_7 = 2.3825, which is Shampine's choice (Mathematics of Computation 46, 1986;
// Hairer, Nørsett and Wanner, sec. II.6); d_7 = 12/5 has shorter numbers and a five hundredth more error.
#include "dynamics/error_limit.hpp"
#include "dynamics/explicit_method.hpp"

namespace delassus {
namespace {

constexpr double nodes[] = {0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0};
constexpr double stages[] = {1.0 / 5.0,       3.0 / 40.0,       9.0 / 40.0,        44.0 / 45.0,      -56.0 / 15.0,
                             32.0 / 9.0,      19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0,
                             9017.0 / 3168.0, -355.0 / 33.0,    46732.0 / 5247.0,  49.0 / 176.0,     -5103.0 / 18656.0};
constexpr double weights[] = {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0};
constexpr double embedded[] = {71.0 / 57600.0,      0.0,          -71.0 / 16695.0, 71.0 / 1920.0,
                               -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0};
constexpr double dense[] = {-32483.0 / 28800.0, 0.0,       6388.0 / 2385.0, -5483.0 / 960.0, 603369.0 / 169600.0,
                            -539.0 / 300.0,     12.0 / 5.0};

const RegisterTimestepper dormand_prince_row{
    {.name = "dormand_prince",
     .description = "Dormand and Prince's Runge–Kutta method of order 5(4), for steps by tolerance; without contacts",
     .options = {error_limit_option()},
     .constraints = true,
     .unilateral = false,
     .order = 5,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<ExplicitMethod>(system,
                                                 ButcherTableau{.name = "dormand_prince",
                                                                .order = 5,
                                                                .c = nodes,
                                                                .a = stages,
                                                                .b = weights,
                                                                .error = embedded,
                                                                .dense = dense},
                                                 values[0].real);
     }}};

}  // namespace
}  // namespace delassus
