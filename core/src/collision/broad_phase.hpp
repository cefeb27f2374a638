// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "delassus/collision.hpp"

namespace delassus::collision {

/// Pairs of shapes that are near each other, by FCL's dynamic tree of axis-aligned boxes. The tree holds boxes a little
/// larger than given. A shape that has left its larger box moves in the tree and finds its neighbours anew; the pairs
/// of the others stay as they are, so that slow scenes hardly touch the tree.
class BroadPhase {
public:
    using Pair = std::pair<std::int32_t, std::int32_t>;
    /// Whether a pair of boxes, by their places in `boxes`, may touch at all; asked once for each pair that comes near.
    using Filter = std::function<bool(std::int32_t, std::int32_t)>;
    using Box = fcl::AABBd;

    explicit BroadPhase(Filter filter);
    ~BroadPhase();

    /// Pairs of places in boxes, smaller first, in ascending order: all pairs of boxes that overlap, and some that are
    /// about to. The same number of boxes in every call. slack: how much larger the boxes in the tree are, m. Valid
    /// until the next call.
    const std::vector<Pair>& near_pairs(const std::vector<Box>& boxes, double slack);

private:
    struct Leaf;
    struct Query;
    void find_all();
    void find_again();

    Filter filter_;
    std::vector<std::unique_ptr<Leaf>> leaves_;
    std::vector<Box> large_;  // as in the tree
    std::vector<char> has_moved_;
    std::vector<fcl::CollisionObjectd*> moved_;
    std::vector<Pair> pairs_, found_, merged_;
    fcl::DynamicAABBTreeCollisionManagerd tree_;
};

}  // namespace delassus::collision
