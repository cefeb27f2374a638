// SPDX-License-Identifier: BSD-3-Clause
// Positions and velocities that left the constraints by the error of a step, moved back onto them (internal).
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "dynamics/linear_problem.hpp"

namespace delassus {

/// The least x, n, in the method's norm with C_q x = −off, off: m. C_q may be that of a point nearby.
using LeastChange = std::function<const Vector&(const std::vector<double>& off)>;

/// end.q ← end.q ∘ exp(x) with the least x, again until C is rounding. Throws StepTooLong if that does not lead there.
DELASSUS_API void return_positions(const DynamicalSystem& system, std::string_view method, const State& begin,
                                   State& end, double h, const LeastChange& least);

/// end.v ← end.v + x likewise, until C_q v + C_t is rounding. D: C_q at the end, m × n. A residual that a C_q of
/// nearby does not lower below 1e-8 of the velocities throws StepTooLong.
DELASSUS_API void return_velocities(const DynamicalSystem& system, std::string_view method, const State& begin,
                                    State& end, double h, const SparseMatrix& D, const LeastChange& least);

}  // namespace delassus
