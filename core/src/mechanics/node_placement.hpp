// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "mechanics/rotation.hpp"

namespace delassus::mechanics {

/// Where a node is and how it moves; column −1 if it is fixed.
struct NodePlacement {
    Vector3d x = Vector3d::Zero(), v = Vector3d::Zero();
    std::int32_t column = -1;
};

}  // namespace delassus::mechanics
