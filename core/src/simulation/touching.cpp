// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/touching.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace delassus {

Touching::Touching(const SceneSystem& system) : system_(system), apart_(system.apart.begin(), system.apart.end()) {
    const auto& shapes = system.system->shapes();
    shape_moves_ = std::any_of(shapes.begin(), shapes.end(), [&](const Shape& shape) { return moves(shape.body); });
    // Shapes by material and body: equal ones behave equally.
    std::map<std::int32_t, std::set<BodyIndex>> bodies;
    for (std::size_t i = 0; i < shapes.size(); ++i) bodies[system.shape_material[i]].insert(shapes[i].body);
    // A mesh does not touch itself: each is as one more body.
    for (const auto material : system.node_contact_material) {
        nodes_touch_ = shape_moves_ = true;
        bodies[material].insert(static_cast<BodyIndex>(system.bodies.size()) + meshes_++);
    }
    for (auto first = bodies.begin(); first != bodies.end(); ++first)
        for (auto second = first; second != bodies.end(); ++second)
            if (any_pair(first->second, second->second, contact_of(first->first, second->first).touch))
                pairs_.push_back({first->first, second->first, contact_of(first->first, second->first).friction});
}

bool Touching::friction() const {
    return std::any_of(pairs_.begin(), pairs_.end(), [](const Pair& pair) { return pair.friction > 0.0; });
}

bool Touching::detects() const {
    const std::size_t shapes = system_.system->shapes().size();
    return shape_moves_ && (shapes >= 2 || (nodes_touch_ && shapes > 0));
}

bool Touching::moves(BodyIndex body) const {
    const auto index = static_cast<std::size_t>(body);
    return body != world_body &&
           (index >= system_.bodies.size() || (!system_.bodies[index].fixed && !system_.bodies[index].motion));
}

bool Touching::any_pair(const std::set<BodyIndex>& first, const std::set<BodyIndex>& second, bool touch) const {
    const auto bodies = static_cast<BodyIndex>(system_.bodies.size());
    for (const BodyIndex a : first)
        for (const BodyIndex b : second)
            if (a != b && (touch || a >= bodies || b >= bodies) && (moves(a) || moves(b)) &&
                !apart_.contains({std::min(a, b), std::max(a, b)}))
                return true;
    return false;
}

ContactMaterial Touching::contact_of(std::int32_t first, std::int32_t second) const {
    ContactMaterial result;
    result.friction = std::sqrt(system_.materials[static_cast<std::size_t>(first)].contact.friction *
                                system_.materials[static_cast<std::size_t>(second)].contact.friction);
    for (const auto& pair : system_.material_pairs)
        if (pair.first == std::min(first, second) && pair.second == std::max(first, second)) result = pair.contact;
    return result;
}

}  // namespace delassus
