// SPDX-License-Identifier: BSD-3-Clause
// How deep bodies of a multibody system lie in one another.
#include <algorithm>
#include <map>

#include "mechanics/multibody_implementation.hpp"

namespace delassus {

bool MultibodySystem::Implementation::is_detected() const {
    const auto same_pose = [](const Pose& a, const Pose& b) {
        return a.position == b.position && a.orientation == b.orientation;
    };
    const auto same_displacement = [](const BodyDisplacement& a, const BodyDisplacement& b) {
        return a.translation == b.translation && a.rotation == b.rotation;
    };
    return std::equal(poses.begin(), poses.end(), detected.poses.begin(), detected.poses.end(), same_pose) &&
           std::equal(displacements.begin(), displacements.end(), detected.displacements.begin(),
                      detected.displacements.end(), same_displacement);
}

void MultibodySystem::collect_overlaps(const State& state, double h, const sdk::Team& team,
                                       std::vector<BodyOverlap>& overlaps) {
    auto& self = *implementation_;
    self.must_be_finished();
    overlaps.clear();
    if (!self.detector) return;
    self.place_for_step(state, h);
    self.place_shapes(state);
    self.predict_displacements(h, state);
    if (!self.is_detected()) {
        self.detector->detect(self.poses, self.envelope, self.detected.contacts, team, self.displacements);
        self.detected.poses = self.poses;
        self.detected.displacements = self.displacements;
    }
    std::map<std::pair<BodyIndex, BodyIndex>, BodyOverlap> pairs;
    for (const ContactPoint& contact : self.detected.contacts) {
        const auto shape_a = static_cast<std::size_t>(contact.shape_a),
                   shape_b = static_cast<std::size_t>(contact.shape_b);
        if (!(contact.gap < 0.0) || std::max(shape_a, shape_b) >= self.shapes.size()) continue;
        const auto [a, b] = std::minmax(self.shapes[shape_a].body, self.shapes[shape_b].body);
        const auto& of_a = self.extents[shape_a];
        const auto& of_b = self.extents[shape_b];
        BodyOverlap& pair = pairs.try_emplace({a, b}, BodyOverlap{a, b, 0.0, HUGE_VAL, HUGE_VAL}).first->second;
        pair.depth = std::max(pair.depth, -contact.gap);
        pair.extent = std::min({pair.extent, of_a.largest, of_b.largest});
        pair.thickness = std::min({pair.thickness, of_a.half_smallest, of_b.half_smallest});
    }
    for (const auto& [key, pair] : pairs) overlaps.push_back(pair);
}

}  // namespace delassus
