// SPDX-License-Identifier: BSD-3-Clause
// The classical Runge–Kutta method of order 4 (dynamics/explicit_method.hpp).
#include "dynamics/explicit_method.hpp"

namespace delassus {
namespace {

constexpr double c[] = {0.0, 0.5, 0.5, 1.0};
constexpr double a[] = {0.5, 0.0, 0.5, 0.0, 0.0, 1.0};
constexpr double b[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};

const RegisterTimestepper rk4_row{
    {.name = "rk4",
     .description = "Runge–Kutta–Munthe-Kaas of order 4; explicit, without contacts",
     .options = {},
     .constraints = true,
     .unilateral = false,
     .order = 4,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>&) -> std::unique_ptr<Timestepper> {
         return std::make_unique<ExplicitMethod>(
             system, ButcherTableau{.name = "rk4", .order = 4, .c = c, .a = a, .b = b, .error = {}});
     }}};

}  // namespace
}  // namespace delassus
