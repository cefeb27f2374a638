// SPDX-License-Identifier: BSD-3-Clause
#include "collision/broad_phase.hpp"

#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>

#include <algorithm>
#include <iterator>

namespace delassus::collision {

/// FCL wants a geometry in every object of its tree; only the box is used here.
struct BroadPhase::Leaf : fcl::CollisionObjectd {
    Leaf(const std::shared_ptr<fcl::CollisionGeometryd>& geometry, std::int32_t place_of_box, const Box& box)
        : fcl::CollisionObjectd(geometry), place(place_of_box) {
        aabb = box;
    }
    void take(const Box& box) { aabb = box; }

    std::int32_t place;
};

struct BroadPhase::Query {
    const BroadPhase& self;
    std::vector<Pair>& pairs;

    void put(std::int32_t a, std::int32_t b) const {
        if (self.filter_(std::min(a, b), std::max(a, b))) pairs.emplace_back(std::min(a, b), std::max(a, b));
    }
    static std::int32_t place_of(const fcl::CollisionObjectd* object) {
        return static_cast<const Leaf*>(object)->place;
    }

    static bool any(fcl::CollisionObjectd* first, fcl::CollisionObjectd* second, void* data) {
        static_cast<const Query*>(data)->put(place_of(first), place_of(second));
        return false;
    }
    /// Two that have both moved find each other twice; the larger place reports it.
    static bool of_moved(fcl::CollisionObjectd* in_tree, fcl::CollisionObjectd* moved, void* data) {
        const auto& query = *static_cast<const Query*>(data);
        const auto a = place_of(in_tree), b = place_of(moved);
        if (a < b || (a > b && !query.self.has_moved_[static_cast<std::size_t>(a)])) query.put(a, b);
        return false;
    }
};

BroadPhase::BroadPhase(Filter filter) : filter_(std::move(filter)) {}

BroadPhase::~BroadPhase() = default;

const std::vector<BroadPhase::Pair>& BroadPhase::near_pairs(const std::vector<Box>& boxes, double slack) {
    const auto enlarged = [&](const Box& box) {
        Box larger = box;
        larger.expand(fcl::Vector3d::Constant(slack));
        return larger;
    };
    if (leaves_.empty() && !boxes.empty()) {
        const auto geometry = std::make_shared<fcl::Sphered>(1.0);
        std::vector<fcl::CollisionObjectd*> objects;
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            large_.push_back(enlarged(boxes[i]));
            leaves_.push_back(std::make_unique<Leaf>(geometry, static_cast<std::int32_t>(i), large_[i]));
            objects.push_back(leaves_[i].get());
        }
        has_moved_.assign(boxes.size(), 0);
        tree_.registerObjects(objects);
        tree_.setup();
        find_all();
        return pairs_;
    }
    moved_.clear();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        has_moved_[i] = large_[i].contain(boxes[i]) ? 0 : 1;
        if (!has_moved_[i]) continue;
        large_[i] = enlarged(boxes[i]);
        leaves_[i]->take(large_[i]);
        moved_.push_back(leaves_[i].get());
    }
    if (moved_.empty()) return pairs_;
    tree_.update(moved_);
    // One query for each of many costs more than one sweep through the tree.
    if (4 * moved_.size() > boxes.size()) {
        find_all();
    } else {
        find_again();
    }
    return pairs_;
}

void BroadPhase::find_all() {
    pairs_.clear();
    Query query{*this, pairs_};
    tree_.collide(&query, &Query::any);
    std::sort(pairs_.begin(), pairs_.end());
}

void BroadPhase::find_again() {
    const auto of_moved = [&](const Pair& pair) {
        return has_moved_[static_cast<std::size_t>(pair.first)] || has_moved_[static_cast<std::size_t>(pair.second)];
    };
    pairs_.erase(std::remove_if(pairs_.begin(), pairs_.end(), of_moved), pairs_.end());
    found_.clear();
    Query query{*this, found_};
    for (auto* leaf : moved_) tree_.collide(leaf, &query, &Query::of_moved);
    std::sort(found_.begin(), found_.end());
    merged_.clear();
    std::merge(pairs_.begin(), pairs_.end(), found_.begin(), found_.end(), std::back_inserter(merged_));
    pairs_.swap(merged_);
}

}  // namespace delassus::collision
