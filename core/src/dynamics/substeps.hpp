// SPDX-License-Identifier: BSD-3-Clause
// Into what a step may be divided (internal).
#pragma once

#include <cstdint>

namespace delassus {

/// The shortest substep, relative to the step. It can pass a jump of velocities: it errs by its size
/// times the jump.
inline constexpr double shortest_substep = 1e-6;

/// Into which a step is divided at most.
inline constexpr std::int64_t most_substeps = 64;

}  // namespace delassus
