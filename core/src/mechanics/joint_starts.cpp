// SPDX-License-Identifier: BSD-3-Clause
// Bodies placed and moving as the starts of joints say: the kinematics of trees, with their coordinates replaced.
#include <fmt/format.h>

#include <algorithm>

#include "delassus/error.hpp"
#include "mechanics/kinematic_tree.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

bool mechanics::has_start(const JointParameters& joint) {
    return joint.slide.start || joint.slide.start_rate || joint.turn.start || joint.turn.start_rate;
}

State mechanics::with_joint_starts(const MultibodySystem& system, const State& drawn, const State& given,
                                   double share) {
    std::vector<std::int32_t> joints;
    for (std::int32_t k = 0; k < system.joint_count(); ++k)
        if (has_start(system.joint(k))) joints.push_back(k);
    if (joints.empty()) return given;
    if (system.node_count() > 0)
        throw InputError(fmt::format(
            "the joint \"{}\" has a start, which takes rigid bodies alone, and the system has nodes of elastic "
            "bodies or cables; place the bodies instead",
            system.joint(joints.front()).name));

    KinematicTree tree(system);
    State coordinates;
    tree.read(drawn, coordinates);
    const std::vector<double> rates = coordinates.v;
    tree.read(given, coordinates);
    coordinates.v = rates;
    for (const std::int32_t k : joints) {
        const JointParameters& joint = system.joint(k);
        const auto link =
            std::find_if(tree.links().begin(), tree.links().end(), [k](const Link& one) { return one.joint == k; });
        if (link == tree.links().end()) continue;
        const auto put = [&](const JointCoordinate& coordinate, std::int32_t place) {
            if (coordinate.start)
                coordinates.q[static_cast<std::size_t>(link->position + place)] = share * *coordinate.start;
            if (coordinate.start_rate)
                coordinates.v[static_cast<std::size_t>(link->column + place)] = *coordinate.start_rate;
        };
        if (joint.kind != JointKind::Revolute) put(joint.slide, 0);
        if (joint.kind != JointKind::Prismatic) put(joint.turn, joint.kind == JointKind::Cylindrical ? 1 : 0);
    }
    tree.place(coordinates.q.data(), coordinates.v.data());
    State result = given;
    tree.write(result);
    for (const Link& link : tree.links())
        if (const std::int32_t place = link.joint < 0 ? -1 : system.angle_position(link.joint); place >= 0) {
            if (const auto& start = system.joint(link.joint).turn.start)
                result.q[static_cast<std::size_t>(place)] = share * *start;
        }
    return result;
}

}  // namespace delassus
