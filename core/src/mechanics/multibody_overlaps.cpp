// SPDX-License-Identifier: BSD-3-Clause
// How deep bodies of a multibody system lie in one another, and contacts on the way to where they came to do so.
#include <algorithm>
#include <map>

#include "mechanics/multibody_implementation.hpp"

namespace delassus {

namespace {

using mechanics::Quaterniond;

Quaterniond orientation(const Pose& pose) {
    return {pose.orientation[0], pose.orientation[1], pose.orientation[2], pose.orientation[3]};
}

/// From one pose to another: the shorter turn.
BodyDisplacement displacement(const Pose& from, const Pose& to) {
    return {mechanics::array(mechanics::vector(to.position) - mechanics::vector(from.position)),
            mechanics::array(mechanics::logarithm(orientation(to) * orientation(from).conjugate()))};
}

std::pair<std::int32_t, std::int32_t> shapes_of(const ContactPoint& contact) {
    return {contact.shape_a, contact.shape_b};
}

}  // namespace

void MultibodySystem::expect_end(const State& end) {
    auto& self = *implementation_;
    self.must_be_finished();
    if (!self.detector) return;
    self.place(end);
    self.place_shapes(end);
    self.expected.push_back(self.poses);
}

void MultibodySystem::expect_nothing() {
    implementation_->expected.clear();
}

void MultibodySystem::Implementation::add_expected(std::vector<ContactPoint>& contacts, const sdk::Team& team) const {
    std::vector<BodyDisplacement> ways(poses.size());
    std::vector<ContactPoint> met;
    const auto by_shapes = [](const ContactPoint& a, const ContactPoint& b) { return shapes_of(a) < shapes_of(b); };
    for (const auto& end : expected) {
        for (std::size_t k = 0; k < poses.size(); ++k) ways[k] = displacement(poses[k], end[k]);
        detector->detect(poses, envelope, met, team, ways);
        const std::size_t known = contacts.size();
        for (const ContactPoint& contact : met)
            if (!std::binary_search(contacts.begin(), contacts.begin() + static_cast<std::ptrdiff_t>(known), contact,
                                    by_shapes))
                contacts.push_back(contact);
        std::inplace_merge(contacts.begin(), contacts.begin() + static_cast<std::ptrdiff_t>(known), contacts.end(),
                           by_shapes);
    }
}

BodyOverlap MultibodySystem::overlap_of(const ContactPoint& contact) const {
    const auto& self = *implementation_;
    const auto shape_a = static_cast<std::size_t>(contact.shape_a), shape_b = static_cast<std::size_t>(contact.shape_b);
    if (!(contact.gap < 0.0) || std::max(shape_a, shape_b) >= self.shapes.size()) return {};
    const auto [a, b] = std::minmax(self.shapes[shape_a].body, self.shapes[shape_b].body);
    const auto &of_a = self.extents[shape_a], &of_b = self.extents[shape_b];
    return {a, b, -contact.gap, std::min(of_a.largest, of_b.largest), std::min(of_a.half_smallest, of_b.half_smallest)};
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
    std::map<std::pair<BodyIndex, BodyIndex>, BodyOverlap> pairs;
    for (const ContactPoint& contact : self.detect(team)) {
        const BodyOverlap own = overlap_of(contact);
        if (!(own.depth > 0.0)) continue;
        BodyOverlap& pair = pairs.try_emplace({own.a, own.b}, own).first->second;
        pair.depth = std::max(pair.depth, own.depth);
        pair.extent = std::min(pair.extent, own.extent);
        pair.thickness = std::min(pair.thickness, own.thickness);
    }
    for (const auto& [key, pair] : pairs) overlaps.push_back(pair);
}

}  // namespace delassus
