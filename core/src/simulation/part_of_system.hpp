// SPDX-License-Identifier: BSD-3-Clause
// Some bodies of a scene's system, as a system of their own.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/scene.hpp"

namespace delassus {

struct PartOfSystem {
    std::unique_ptr<MultibodySystem> system;
    std::vector<BodyIndex> bodies;     ///< the numbers of its bodies in the whole, ascending
    std::vector<std::int32_t> rows;    ///< of its bilateral rows among the kept rows of the whole, ascending
    std::vector<std::int32_t> angles;  ///< of the angles at the end of its q: their places in q of the whole
    std::vector<std::int32_t> shapes;  ///< of its shapes in the whole, ascending
};

/// Has these moving bodies (ascending) and all that are fixed or kinematic, and of joints, forces and shapes those that
/// act between them alone. Gaps, keys of contacts and rows are those of the whole. touched: of the moving ones those
/// that bodies may touch that are not among them. The system has no nodes; both may be used side by side.
[[nodiscard]] DELASSUS_API PartOfSystem part_of_system(const SceneSystem& whole, const std::vector<BodyIndex>& moving,
                                                       const std::vector<BodyIndex>& touched);

}  // namespace delassus
