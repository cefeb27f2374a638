// SPDX-License-Identifier: BSD-3-Clause
// Contacts between meshes of a multibody system (mesh_contacts.hpp).
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "delassus/error.hpp"
#include "mechanics/mesh_contacts.hpp"
#include "mechanics/multibody_implementation.hpp"
#include "support/frames.hpp"

namespace delassus {

using mechanics::MeshContact;
using mechanics::MeshContacts;
using mechanics::vector;
using mechanics::Vector3d;

namespace {

/// Disjoint sets of nodes; the root of a set is its least node.
class NodeSets {
public:
    explicit NodeSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
    std::int32_t root(std::int32_t node) {
        auto& parent = parent_[static_cast<std::size_t>(node)];
        if (parent != node) parent = root(parent);
        return parent;
    }
    void join(std::int32_t a, std::int32_t b) {
        a = root(a);
        b = root(b);
        parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }

private:
    std::vector<std::int32_t> parent_;
};

}  // namespace

struct MultibodySystem::Implementation::MeshTouching {
    MeshContacts finder;
    std::vector<std::int32_t> shape_of_node;  ///< its sphere among the shapes, −1: none
    double envelope = 0.0;                    ///< as the user gave it; 0: by the radii
    // Work space of a step.
    std::vector<Vector3d> x, way;
    std::vector<MeshContact> contacts;
};

std::int32_t MultibodySystem::Implementation::first_node_of_surface(std::size_t surface) const {
    return mesh_touching->finder.surfaces()[surface].surface.nodes()[0];
}

// Elements that share nodes are one mesh. Its surface has the largest radius of its nodes and the material of the
// first.
void MultibodySystem::Implementation::make_mesh_contacts() {
    if (node_contacts.empty() || element_sides.empty()) return;
    NodeSets meshes(nodes.size());
    const auto join_all = [&](const auto& elements) {
        for (const auto& element : elements)
            for (const auto node : element.nodes()) meshes.join(element.nodes()[0], node);
    };
    join_all(linear_tetrahedra);
    join_all(quadratic_tetrahedra);
    join_all(bricks);
    std::vector<std::int32_t> shape_of_node(nodes.size(), -1);
    for (std::size_t k = 0; k < node_contacts.size(); ++k)
        shape_of_node[static_cast<std::size_t>(node_contacts[k].node)] = static_cast<std::int32_t>(shapes.size() + k);
    std::map<std::int32_t, std::vector<mechanics::ElementSide>> surfaces;
    std::int32_t of_modes = -1;  // a reduced body whose nodes touch
    bool several = false;
    for (const auto& side : mechanics::outer_sides(element_sides)) {
        bool touches = true;
        side.for_each_node(
            [&](std::int32_t node) { touches = touches && shape_of_node[static_cast<std::size_t>(node)] >= 0; });
        if (!touches) continue;
        if (const auto reduced_body = nodes[static_cast<std::size_t>(side.corners[0])].reduced; reduced_body >= 0) {
            several = several || (of_modes >= 0 && of_modes != reduced_body);
            of_modes = reduced_body;
            continue;
        }
        surfaces[meshes.root(side.corners[0])].push_back(side);
    }
    if (of_modes >= 0 && (several || !surfaces.empty()))
        throw InputError(fmt::format(
            "the elastic body \"{}\" has modes and contact, and so has another elastic body contact: with modes it "
            "touches rigid bodies, but no mesh; leave out its modes, or the contact of all elastic bodies but it",
            reduced[static_cast<std::size_t>(of_modes)].name));
    const auto moves = [&](std::int32_t node) { return nodes[static_cast<std::size_t>(node)].column >= 0; };
    bool any_moves = false;
    for (const auto& [root, sides] : surfaces)
        for (const auto& side : sides) side.for_each_node([&](std::int32_t node) { any_moves |= moves(node); });
    if (surfaces.size() < 2 || !any_moves) return;
    mesh_touching = std::make_shared<MeshTouching>();
    auto& [finder, node_shapes, given_envelope, x, way, contacts] = *mesh_touching;
    given_envelope = envelope;
    for (const auto& node : nodes) x.push_back(vector(node.parameters.position));
    const auto contact_of = [&](std::int32_t node) -> const NodeContact& {
        return node_contacts[static_cast<std::size_t>(shape_of_node[static_cast<std::size_t>(node)]) - shapes.size()];
    };
    for (const auto& [root, sides] : surfaces) {
        double radius = 0.0;
        std::int32_t first = sides[0].corners[0];
        for (const auto& side : sides)
            side.for_each_node([&](std::int32_t node) {
                radius = std::max(radius, contact_of(node).radius);
                first = std::min(first, node);
            });
        finder.add(sides, x, radius, contact_of(first).material);
    }
    node_shapes = std::move(shape_of_node);
    std::vector<std::int32_t> holds(nodes.size(), MeshContacts::free);
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (nodes[k].column < 0) holds[k] = MeshContacts::immovable;
    for (const auto& one : attachments)
        holds[static_cast<std::size_t>(one.node)] =
            bodies[static_cast<std::size_t>(one.body)].prescribed ? MeshContacts::immovable : one.body;
    finder.set_holds(std::move(holds));
}

// Nodes move on as in predict_displacements().
void MultibodySystem::Implementation::collect_mesh_contacts(const State& state, double h, UnilateralRows& rows) {
    auto& [finder, shape_of_node, given_envelope, x, way, contacts] = *mesh_touching;
    const Vector3d fall = h * load_factor * vector(gravity);
    x.resize(nodes.size());
    way.resize(nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const auto node = node_at(static_cast<std::int32_t>(k), state.q.data(), state.v.data());
        x[k] = node.x;
        way[k] = node.column < 0 ? Vector3d::Zero() : Vector3d(h * (node.v + fall));
    }
    finder.find(x, way, given_envelope, contacts);
    const auto first_surface = static_cast<std::int32_t>(shapes.size() + node_contacts.size());
    const auto shapes_of = [&, &shape_of = shape_of_node](const MeshContact& contact) {
        return std::pair(contact.kind == MeshContact::Kind::Vertex
                             ? shape_of[static_cast<std::size_t>(contact.a.nodes[0])]
                             : first_surface + contact.surface_a,
                         first_surface + contact.surface_b);
    };
    const auto by_shapes = [&](const MeshContact& a, const MeshContact& b) { return shapes_of(a) < shapes_of(b); };
    if (!std::is_sorted(contacts.begin(), contacts.end(), by_shapes))
        std::stable_sort(contacts.begin(), contacts.end(), by_shapes);
    std::uint32_t place = 0;  // among those of the same shapes
    std::pair<std::int32_t, std::int32_t> last{-1, -1};
    for (const MeshContact& contact : contacts) {
        const auto pair = shapes_of(contact);
        place = pair == last ? place + 1 : 0;
        last = pair;
        const auto& a = mesh_touching->finder.surfaces()[static_cast<std::size_t>(contact.surface_a)];
        const auto& b = mesh_touching->finder.surfaces()[static_cast<std::size_t>(contact.surface_b)];
        ContactPoint& point = rows.contacts().emplace_back();
        point.shape_a = pair.first;
        point.shape_b = pair.second;
        point.point_a = mechanics::array(a.surface.place_of(contact.a) + a.radius * contact.normal);
        point.point_b = mechanics::array(b.surface.place_of(contact.b) - b.radius * contact.normal);
        point.normal = mechanics::array(contact.normal);
        point.gap = contact.gap;
        point.feature = place;
        const auto put = [&](const mechanics::CarriedPoint& carried, const Vector3d& direction, double sign) {
            for (std::size_t k = 0; k < carried.count; ++k) {
                const std::int32_t column = nodes[static_cast<std::size_t>(carried.nodes[k])].column;
                const double weight = sign * carried.weights[k];
                if (column < 0 || weight == 0.0) continue;
                rows.entries(column, std::array{weight * direction[0], weight * direction[1], weight * direction[2]});
            }
        };
        const auto put_row = [&](const Vector3d& direction, double gap) {
            put(contact.a, direction, -1.0);
            put(contact.b, direction, 1.0);
            rows.end_row(gap);
        };
        const ContactMaterial material = material_between(a.material, b.material);
        const auto key = mesh_contact_key(static_cast<int>(contact.kind), contact.feature);
        put_row(contact.normal, contact.gap);
        if (material.friction == 0.0 && leaves_out) {
            rows.end_block(Cone::nonnegative(1), key, material.restitution);
            continue;
        }
        const mechanics::Matrix3d frame = contact_frame(contact.normal);
        for (int k = 1; k < 3; ++k) put_row(frame.col(k), 0.0);
        rows.end_block(Cone::friction(material.friction), key, material.restitution);
    }
}

}  // namespace delassus
