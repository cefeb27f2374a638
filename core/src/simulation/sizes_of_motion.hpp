// SPDX-License-Identifier: BSD-3-Clause
// How large is what moves: what an `accuracy` is a share of (internal).
#pragma once

#include <vector>

#include "delassus/joint_coordinates.hpp"
#include "delassus/scene.hpp"

namespace delassus {

/// A mechanism is what joints, beams and elements hold together. Its size is half the diagonal of the box about its
/// mass centres, nodes and joints at the start, and no less than half the extent of its largest shape or the radius of
/// gyration of a body, m.
struct SizesOfMotion {
    std::vector<double> of_velocities;  ///< StepControl::sizes: of angles 1, of lengths that of the mechanism
    double least = 1.0;                 ///< of a mechanism, m
    /// In which the largest mechanism, of size L, falls some of its sizes or goes them as fast as the fastest body
    /// starts: 3 min(√(L/g), L/v), s. 0: there is no gravity, and nothing moves at the start.
    double time = 0.0;
};

/// joints: of the system, or null: coordinates are maximal.
[[nodiscard]] SizesOfMotion sizes_of_motion(const SceneSystem& system, const JointCoordinates* joints);

}  // namespace delassus
