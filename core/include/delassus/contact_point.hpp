// SPDX-License-Identifier: BSD-3-Clause
// Where two shapes touch or nearly do.
#pragma once

#include <array>
#include <cstdint>

namespace delassus {

using Vector3 = std::array<double, 3>;

/// A point where two shapes are nearer than the envelope.
struct ContactPoint {
    std::int32_t shape_a = 0, shape_b = 0;  ///< shape_a < shape_b
    Vector3 point_a{}, point_b{};           ///< on the surfaces, world frame
    Vector3 normal{};                       ///< unit, from a to b
    double gap = 0.0;                       ///< normal · (point_b − point_a); negative in penetration, m
    std::uint32_t feature = 0;              ///< which point of several between the pair; stable while they slide little
    /// The shapes meet later in the step: the normal and the points' arms from the origins of their bodies are those of
    /// the meeting, and the gap is what the speed along the normal takes until then.
    bool on_the_way = false;
};

}  // namespace delassus
