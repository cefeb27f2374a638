// SPDX-License-Identifier: BSD-3-Clause
// Nodes that bodies carry (attachment.hpp).
#include <algorithm>

#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::refuse_unless;
using mechanics::vector;
using mechanics::Vector3d;

void MultibodySystem::add_attachment(const AttachmentParameters& parameters) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    const std::string& name = parameters.name;
    self.check_body(parameters.body, name);
    refuse_unless(!parameters.nodes.empty(), "the attachment", name, "holds no node");
    for (const auto node : parameters.nodes) self.check_node(node, fmt::format("the attachment \"{}\"", name));
    if (const auto reduced = self.reduced_of(parameters.nodes, name); reduced >= 0)
        return self.attach_reduced(parameters, reduced);
    const auto placements = self.initial_placements();
    const auto& place = placements[parameters.body];
    for (const auto node : parameters.nodes) {
        const bool taken = std::any_of(self.attachments.begin(), self.attachments.end(),
                                       [&](const auto& other) { return other.node == node; });
        refuse_unless(!taken && !self.nodes[static_cast<std::size_t>(node)].parameters.fixed, "the attachment", name,
                      "holds a node that is fixed or attached already");
        if (parameters.body == world_body || self.bodies[static_cast<std::size_t>(parameters.body)].parameters.fixed) {
            self.nodes[static_cast<std::size_t>(node)].parameters.fixed = true;
            continue;
        }
        const Vector3d p = vector(self.nodes[static_cast<std::size_t>(node)].parameters.position);
        self.attachments.push_back({node, parameters.body, place.A.transpose() * (p - place.x)});
    }
}

void MultibodySystem::Implementation::carry_nodes(State& state) const {
    carry_reduced(state);
    if (attachments.empty()) return;
    place(state);
    for (const auto& one : attachments) {
        const auto& node = nodes[static_cast<std::size_t>(one.node)];
        Eigen::Map<Vector3d>(state.q.data() + node.position) = one.place(at[one.body]);
        Eigen::Map<Vector3d>(state.v.data() + node.column) = one.velocity(at[one.body]);
    }
}

}  // namespace delassus
