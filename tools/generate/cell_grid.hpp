// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

namespace delassus::generating {

/// All pairs (i, j), i < j, of points whose distance is at most `reach`, in ascending order. Points are sorted into
/// cubes of edge `reach` and compared with those of the 27 cubes around them: linear in time and memory as long as the
/// points fill their bounding box to a bounded share, and the number of points in a cube is bounded.
std::vector<std::pair<std::int32_t, std::int32_t>> pairs_within(const std::vector<Eigen::Vector3d>& points,
                                                                double reach);

}  // namespace delassus::generating
