// SPDX-License-Identifier: BSD-3-Clause
// Elastic bodies of any mesh of tetrahedra, and the surface of tetrahedra.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::finite;
using mechanics::refuse_unless;

namespace {

bool inside(const AlignedBox& box, const Vector3& point) {
    for (std::size_t i = 0; i < 3; ++i)
        if (point[i] < box.lower[i] || point[i] > box.upper[i]) return false;
    return true;
}

}  // namespace

std::vector<std::array<std::int32_t, 3>> MultibodySystem::element_surface() const {
    std::vector<std::array<std::int32_t, 3>> triangles;
    for (const auto& [corners, middles] : mechanics::outer_sides(implementation_->element_sides)) {
        const auto [i, j, k] = corners;
        const auto [ij, jk, ki] = middles;
        if (ij < 0) {
            triangles.push_back(corners);
        } else {
            triangles.insert(triangles.end(), {{i, ij, ki}, {ij, j, jk}, {ki, jk, k}, {ij, jk, ki}});
        }
    }
    return triangles;
}

std::vector<std::int32_t> MultibodySystem::nodes_in(std::int32_t first, std::int32_t count,
                                                    const AlignedBox& box) const {
    std::vector<std::int32_t> result;
    for (auto node = first; node < first + count; ++node) {
        implementation_->check_node(node, "nodes_in()");
        if (inside(box, implementation_->nodes[static_cast<std::size_t>(node)].parameters.position))
            result.push_back(node);
    }
    return result;
}

void MultibodySystem::set_initial_velocity(const std::vector<std::int32_t>& nodes, const Vector3& velocity) {
    auto& self = *implementation_;
    self.must_not_be_finished();
    if (!finite(velocity)) throw InputError("an initial velocity is not finite");
    bool any = false;
    for (const auto number : nodes) {
        self.check_node(number, "an initial velocity");
        auto& node = self.nodes[static_cast<std::size_t>(number)].parameters;
        if (node.fixed) continue;
        node.velocity = velocity;
        any = true;
    }
    if (!any) throw InputError("an initial velocity has no node that moves");
}

// ∫ N_a over a side of area A: A/3 for each corner with linear displacements; with quadratic ones A/3 for each middle
// and nothing for the corners.
std::vector<NodeShare> MultibodySystem::spread_over_sides(std::int32_t first, std::int32_t count,
                                                          const AlignedBox& box) const {
    const auto position = [&](std::int32_t node) {
        return implementation_->nodes[static_cast<std::size_t>(node)].parameters.position;
    };
    const auto takes_part = [&](std::int32_t node) {
        return node >= first && node < first + count && inside(box, position(node));
    };
    std::map<std::int32_t, double> area;
    double whole = 0.0;
    for (const auto& side : mechanics::outer_sides(implementation_->element_sides)) {
        if (!std::all_of(side.corners.begin(), side.corners.end(), takes_part)) continue;
        const mechanics::Vector3d a = mechanics::vector(position(side.corners[0])),
                                  b = mechanics::vector(position(side.corners[1])),
                                  c = mechanics::vector(position(side.corners[2]));
        const double own = 0.5 * (b - a).cross(c - a).norm();
        for (const auto node : side.middles[0] < 0 ? side.corners : side.middles) area[node] += own / 3.0;
        whole += own;
    }
    if (whole == 0.0) throw InputError("no side of an element lies in the box");
    std::vector<NodeShare> shares;
    for (const auto& [node, own] : area) shares.push_back({node, own / whole});
    return shares;
}

void MultibodySystem::Implementation::spin_nodes(std::int32_t first, const Vector3& angular_velocity) {
    const mechanics::Vector3d omega = mechanics::vector(angular_velocity);
    if (omega.isZero(0.0)) return;
    mechanics::Vector3d moment = mechanics::Vector3d::Zero();
    double mass = 0.0;
    for (auto k = static_cast<std::size_t>(first); k < nodes.size(); ++k) {
        mass += nodes[k].parameters.mass;
        moment += nodes[k].parameters.mass * mechanics::vector(nodes[k].parameters.position);
    }
    for (auto k = static_cast<std::size_t>(first); k < nodes.size(); ++k) {
        auto& node = nodes[k].parameters;
        if (node.fixed) continue;
        const mechanics::Vector3d turning = omega.cross(mechanics::vector(node.position) - moment / mass);
        node.velocity = mechanics::array(mechanics::vector(node.velocity) + turning);
    }
}

std::int32_t MultibodySystem::add_elastic_mesh(const ElasticMeshParameters& body) {
    const auto& q = body.pose.orientation;
    refuse_unless(
        finite(body.pose.position) && std::abs(std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) - 1.0) < 1e-6,
        "the pose of the elastic mesh", body.name, "must be finite, with a quaternion of length 1");
    const auto vertices = static_cast<std::int32_t>(body.mesh.vertices.size());
    for (const auto& nodes : body.mesh.tetrahedra)
        for (const auto node : nodes)
            if (node < 0 || node >= vertices)
                throw InputError(fmt::format("a tetrahedron of the elastic mesh \"{}\" has the vertex {} of {}",
                                             body.name, node, vertices));
    const mechanics::Matrix3d A = mechanics::quaternion(q).toRotationMatrix();
    const auto first = node_count();
    const auto add = [&](const Vector3& position) {
        NodeParameters node;
        node.position = position;
        node.fixed = std::any_of(body.fixed_boxes.begin(), body.fixed_boxes.end(),
                                 [&](const AlignedBox& box) { return inside(box, node.position); });
        if (!node.fixed) node.velocity = body.velocity;
        return add_node(node);
    };
    for (const Vector3& vertex : body.mesh.vertices)
        add(mechanics::array(mechanics::vector(body.pose.position) + A * mechanics::vector(vertex)));
    const auto position = [&](std::int32_t node) {
        return mechanics::vector(implementation_->nodes[static_cast<std::size_t>(node)].parameters.position);
    };
    std::map<std::array<std::int32_t, 2>, std::int32_t> middles;
    const auto middle = [&](std::int32_t i, std::int32_t j) {
        const auto [found, is_new] = middles.try_emplace({std::min(i, j), std::max(i, j)}, -1);
        if (is_new) found->second = add(mechanics::array(0.5 * (position(i) + position(j))));
        return found->second;
    };
    const std::size_t sides_before = implementation_->element_sides.size();
    for (auto corners : body.mesh.tetrahedra) {
        for (auto& node : corners) node += first;
        if (body.order == ElementOrder::Linear) {
            add_tetrahedron(corners, body.material, body.model);
            continue;
        }
        std::array<std::int32_t, 10> nodes{corners[0], corners[1], corners[2], corners[3]};
        for (std::size_t e = 0; e < 6; ++e)
            nodes[4 + e] =
                middle(corners[mechanics::tetrahedron_edges[e][0]], corners[mechanics::tetrahedron_edges[e][1]]);
        add_quadratic_tetrahedron(nodes, body.material, body.model);
    }
    implementation_->spin_nodes(first, body.angular_velocity);
    if (!(body.contact_radius > 0.0)) return first;
    std::set<std::int32_t> touching;
    for (const auto& side : mechanics::outer_sides(std::span(implementation_->element_sides).subspan(sides_before)))
        side.for_each_node([&](std::int32_t node) { touching.insert(node); });
    for (const auto node : touching) add_node_contact(node, body.contact_radius, body.contact_material);
    return first;
}

}  // namespace delassus
