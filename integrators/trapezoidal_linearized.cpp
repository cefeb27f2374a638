// SPDX-License-Identifier: BSD-3-Clause
// The trapezoidal rule with a single iteration of Newton's method (seed eq. 170–171, corrected). Order 2.
#include "dynamics/implicit_method.hpp"

namespace delassus {
namespace {

// One linear problem a step: the equations of trapezoidal.cpp, linearised at a guess of the end of the step and solved
// once. The guess keeps acceleration and reaction, v̇_{n+1} = v̇_n and λ_{n+1} = λ_n, so its error is O(h³) in the
// position and O(h) in λ. One iteration with the exact matrix leaves an error of second order in these, below the
// rule's own h³. With the symmetric part of the matrix it leaves an error of the rule's own order. Linear systems are
// solved exactly.
//
// The seed's eq. 170 starts from v_{n+1} = 0 and λ_{n+1} = 0 at q_n instead. Its constraint row then is
// C_q v_{n+1} = −(2/h) C − C_q v_n − 2 C_t, of which eq. 170 lacks the factor 2 and the last two terms. It drops λ_n
// besides ("sawtooth"): then a force of twice the size acts along C_qᵀ of the end of the step only, an error of order 1
// (measured on a pendulum, with Newton's method converged: 0.99 in q). Here λ_n is kept, and the linearisation is done
// where the seed's closing remark wants it, at an extrapolated end.
const RegisterTimestepper trapezoidal_linearized_row{
    {.name = "trapezoidal_linearized",
     .description = "trapezoidal rule with one linear problem a step; no damping, its multipliers oscillate",
     .options = {jacobian_option("exact"), linearization_option(), newton_options().back()},  // largest_turn
     .constraints = true,
     .unilateral = false,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<ImplicitMethod>(
             system, ImplicitCoefficients::newmark(0.5, 0.25),
             NewtonSettings{.method = "trapezoidal_linearized",
                            .jacobian = values[0].text == "exact" ? Jacobian::Exact : Jacobian::Symmetric,
                            .reuse = Reuse::Full,
                            .max_iterations = 1,
                            .linearized = true,
                            .linearization_limit = values[1].real,
                            .largest_turn = values[2].real});
     }}};

}  // namespace
}  // namespace delassus
