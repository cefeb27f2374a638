// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "relations/judge_apart.hpp"

namespace delassus::relations {

/// Scenes that are smaller than this one by one thing each, the large things first: a body with all that holds to it, a
/// joint with what drives it, a motor, a spring, a load, a shape, half of the time, an option, a speed, a turn.
[[nodiscard]] std::vector<Json> smaller_scenes(const Json& scene);

/// What is left of a scene, and what its relation said last.
struct Shrunk {
    Json scene;
    std::string detail;
};

/// A scene that cannot be made smaller by any of these without the relation holding again, or what was reached after so
/// many seconds. told: what failed, and by which verdict.
[[nodiscard]] Shrunk shrunk(const ApartSettings& settings, const Json& scene, const Told& told, double seconds);

}  // namespace delassus::relations
