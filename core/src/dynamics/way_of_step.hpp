// SPDX-License-Identifier: BSD-3-Clause
// For methods that describe the way of their last step (internal).
#pragma once

#include "delassus/continuous_extension.hpp"
#include "dynamics/linear_problem.hpp"

namespace delassus {

/// increment, n ← that with begin.q ∘ exp(increment) = end.q, from one that misses it by a local error.
void meet_end(const DynamicalSystem& system, const State& begin, const State& end, Vector& increment);

/// Appends the vector's entries.
inline void append(std::vector<double>& to, const Vector& vector) {
    to.insert(to.end(), vector.begin(), vector.end());
}

}  // namespace delassus
