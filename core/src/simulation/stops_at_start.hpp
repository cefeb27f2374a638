// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "delassus/multibody.hpp"

namespace delassus {

/// Of the joints that are beyond their stops at a state, the furthest, as a sentence with what to do; empty where none
/// is by more than rounding of what users write: 1e-3 rad, or 1e-3 of the extent of the bodies.
[[nodiscard]] std::string beyond_stops(const MultibodySystem& system, const State& bodies);

}  // namespace delassus
