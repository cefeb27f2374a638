// SPDX-License-Identifier: BSD-3-Clause
// Which shapes of a scene can touch which (internal).
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <vector>

#include "delassus/scene.hpp"

namespace delassus {

/// The pairs of materials, each with its friction, of two shapes of different bodies of which at least one moves and
/// which are not kept apart, by body or by material.
class Touching {
public:
    /// The system must outlive this.
    explicit Touching(const SceneSystem& system);

    struct Pair {
        std::int32_t first, second;  ///< materials
        double friction;
    };
    [[nodiscard]] const std::vector<Pair>& pairs() const { return pairs_; }
    [[nodiscard]] bool friction() const;
    /// Whether the system makes a collision detector: see MultibodySystem::finish().
    [[nodiscard]] bool detects() const;
    /// Whether nodes of blocks or meshes are among what touches.
    [[nodiscard]] bool nodes_touch() const { return nodes_touch_; }
    /// How many elastic blocks and meshes touch.
    [[nodiscard]] std::int32_t meshes() const { return meshes_; }

private:
    [[nodiscard]] bool moves(BodyIndex body) const;
    /// touch: whether shapes of their materials do; nodes of meshes do in any case.
    [[nodiscard]] bool any_pair(const std::set<BodyIndex>& first, const std::set<BodyIndex>& second, bool touch) const;
    [[nodiscard]] ContactMaterial contact_of(std::int32_t first, std::int32_t second) const;

    const SceneSystem& system_;
    std::set<std::array<BodyIndex, 2>> apart_;
    bool shape_moves_ = false, nodes_touch_ = false;
    std::int32_t meshes_ = 0;
    std::vector<Pair> pairs_;
};

}  // namespace delassus
