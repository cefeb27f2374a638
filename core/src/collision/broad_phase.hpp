// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "delassus/collision.hpp"

namespace delassus::collision {

/// Pairs of axis-aligned boxes that overlap, by FCL's dynamic tree. The tree holds boxes a little larger than given
/// and moves one only when its shape has left it, so that slow scenes hardly touch the tree.
class BroadPhase {
public:
    /// Whether a pair of shapes may touch at all.
    using Filter = std::function<bool(std::int32_t, std::int32_t)>;
    using Box = fcl::AABBd;

    explicit BroadPhase(Filter filter);
    ~BroadPhase();

    /// Appends the pairs (smaller index first, unordered among each other) among boxes[i] of shapes[i], the same shapes
    /// in every call. slack: how much larger the boxes in the tree are, m.
    void overlaps(const std::vector<std::int32_t>& shapes, const std::vector<Box>& boxes, double slack,
                  std::vector<std::pair<std::int32_t, std::int32_t>>& pairs);

private:
    struct Leaf;
    struct Query;
    Filter filter_;
    std::vector<std::unique_ptr<Leaf>> leaves_;
    std::vector<fcl::CollisionObjectd*> moved_;
    fcl::DynamicAABBTreeCollisionManagerd tree_;
};

}  // namespace delassus::collision
