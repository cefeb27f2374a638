// SPDX-License-Identifier: BSD-3-Clause
// What a user may look at where a step cannot be taken (internal).
#pragma once

#include <string>

#include "delassus/multibody.hpp"
#include "delassus/scene.hpp"

namespace delassus {

/// The end of a sentence that names, each where there are any: bodies that touch or may within a step of the scene's
/// size from a state of the bodies; joints at a stop, with their motors; joints with rows that were left out. Where
/// there is none of them, the body that moves fastest, or the first joints.
[[nodiscard]] std::string what_acts(const SceneSystem& scene, const State& bodies);

}  // namespace delassus
