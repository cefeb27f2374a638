// SPDX-License-Identifier: BSD-3-Clause
#include "collision/broad_phase.hpp"

#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>

namespace delassus::collision {

/// FCL wants a geometry in every object of its tree; only the box is used here.
struct BroadPhase::Leaf : fcl::CollisionObjectd {
    Leaf(const std::shared_ptr<fcl::CollisionGeometryd>& geometry, std::int32_t shape_index)
        : fcl::CollisionObjectd(geometry), shape(shape_index) {}

    void enlarge(double slack) {
        aabb = tight;
        aabb.expand(fcl::Vector3d::Constant(slack));
    }

    std::int32_t shape;
    Box tight;
};

struct BroadPhase::Query {
    const Filter& filter;
    std::vector<std::pair<std::int32_t, std::int32_t>>& pairs;

    static bool visit(fcl::CollisionObjectd* first, fcl::CollisionObjectd* second, void* data) {
        const auto& query = *static_cast<const Query*>(data);
        const auto* a = static_cast<const Leaf*>(first);
        const auto* b = static_cast<const Leaf*>(second);
        if (a->shape > b->shape) std::swap(a, b);
        if (a->tight.overlap(b->tight) && query.filter(a->shape, b->shape))
            query.pairs.emplace_back(a->shape, b->shape);
        return false;
    }
};

BroadPhase::BroadPhase(Filter filter) : filter_(std::move(filter)) {}

BroadPhase::~BroadPhase() = default;

void BroadPhase::overlaps(const std::vector<std::int32_t>& shapes, const std::vector<Box>& boxes, double slack,
                          std::vector<std::pair<std::int32_t, std::int32_t>>& pairs) {
    if (shapes.empty()) return;
    if (leaves_.empty()) {
        const auto geometry = std::make_shared<fcl::Sphered>(1.0);
        std::vector<fcl::CollisionObjectd*> objects;
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            leaves_.push_back(std::make_unique<Leaf>(geometry, shapes[i]));
            leaves_[i]->tight = boxes[i];
            leaves_[i]->enlarge(slack);
            objects.push_back(leaves_[i].get());
        }
        tree_.registerObjects(objects);
        tree_.setup();
    } else {
        moved_.clear();
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            Leaf& leaf = *leaves_[i];
            leaf.tight = boxes[i];
            if (leaf.getAABB().contain(leaf.tight)) continue;
            leaf.enlarge(slack);
            moved_.push_back(&leaf);
        }
        if (!moved_.empty()) tree_.update(moved_);
    }
    Query query{filter_, pairs};
    tree_.collide(&query, &Query::visit);
}

}  // namespace delassus::collision
