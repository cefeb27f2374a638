// SPDX-License-Identifier: BSD-3-Clause
#include "output/system_model.hpp"

#include <algorithm>

#include "output/surfaces.hpp"
#include "scene/joint_kinds.hpp"

namespace delassus {
namespace {

/// A point of the world, at the start, in the frame of the body.
Vector3 in_frame_of(const SceneSystem& system, BodyIndex body, const Vector3& point) {
    if (body == world_body) return point;
    const auto& [position, orientation] = system.bodies[static_cast<std::size_t>(body)].pose;
    const auto& [w, x, y, z] = orientation;
    return transformed({{}, {w, -x, -y, -z}}, {point[0] - position[0], point[1] - position[1], point[2] - position[2]});
}

TrajectoryLink link(const SceneSystem& system, const auto& joint, std::string_view kind, const Vector3& first_point,
                    const Vector3& second_point) {
    return {joint.name,
            std::string(kind),
            {joint.first, joint.second},
            {in_frame_of(system, joint.first, first_point), in_frame_of(system, joint.second, second_point)}};
}

}  // namespace

TrajectoryModel trajectory_model(const SceneSystem& system) {
    const MultibodySystem& mechanics = *system.system;
    TrajectoryModel model;
    model.gravity = mechanics.gravity();
    for (const auto& body : system.bodies) {
        model.bodies.push_back(body.name);
        model.fixed.push_back(body.fixed ? 1 : 0);
    }
    model.shapes = mechanics.shapes();
    // Positions of nodes follow those of moving bodies, which have 7 numbers in q for 6 in v.
    std::int32_t moving = 0;
    for (BodyIndex body = 0; body < mechanics.body_count(); ++body)
        if (mechanics.body_column(body) >= 0) ++moving;
    const State start = mechanics.initial_state();
    for (std::int32_t node = 0; node < mechanics.node_count(); ++node) {
        const auto column = mechanics.node_column(node);
        model.nodes.push_back(mechanics.node_position(start, node));
        model.node_entry.push_back(column < 0 ? -1 : column + moving);
    }
    for (const auto& body : mechanics.reduced_bodies())
        model.reduced.push_back({body.first_node, body.position, static_cast<std::int32_t>(body.frequencies.size()),
                                 body.places, body.shapes});
    model.loose = mechanics.loose_nodes();
    model.surface = mechanics.element_surface();
    model.cables = mechanics.cables();
    for (const auto& joint : system.joints) {
        if (joint.kind == JointKind::Gear) continue;
        const bool apart = joint.kind == JointKind::Distance;
        model.links.push_back(link(system, joint, scene::joint_kinds[static_cast<std::size_t>(joint.kind)].first,
                                   joint.point, apart ? joint.second_point : joint.point));
    }
    for (const auto& spring : system.springs)
        model.links.push_back(link(system, spring, "spring", spring.first_point, spring.second_point));
    for (const auto& bushing : system.bushings)
        model.links.push_back(link(system, bushing, "bushing", bushing.point, bushing.point));
    return model;
}

}  // namespace delassus
