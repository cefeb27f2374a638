// SPDX-License-Identifier: BSD-3-Clause
// Elastic bodies of any mesh of tetrahedra, and the surface of tetrahedra.
#include <algorithm>
#include <cmath>
#include <set>

#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

using mechanics::finite;
using mechanics::refuse_unless;

namespace {

using Tetrahedron = std::array<std::int32_t, 4>;
using Face = std::array<std::int32_t, 3>;

// A face that two tetrahedra share is inside. Faces seen from outside, for nodes in the order of a positive volume.
std::vector<Face> boundary(const std::vector<Tetrahedron>& tetrahedra) {
    constexpr std::array<std::array<std::size_t, 3>, 4> sides = {{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
    std::vector<std::pair<Face, Face>> faces;  // sorted nodes, and as seen from outside
    for (const auto& nodes : tetrahedra)
        for (const auto& side : sides) {
            const Face face = {nodes[side[0]], nodes[side[1]], nodes[side[2]]};
            Face sorted = face;
            std::sort(sorted.begin(), sorted.end());
            faces.emplace_back(sorted, face);
        }
    std::sort(faces.begin(), faces.end());
    std::vector<Face> surface;
    for (std::size_t i = 0; i < faces.size();) {
        std::size_t end = i + 1;
        while (end < faces.size() && faces[end].first == faces[i].first) ++end;
        if (end == i + 1) surface.push_back(faces[i].second);
        i = end;
    }
    return surface;
}

bool inside(const AlignedBox& box, const Vector3& point) {
    for (std::size_t i = 0; i < 3; ++i)
        if (point[i] < box.lower[i] || point[i] > box.upper[i]) return false;
    return true;
}

}  // namespace

std::vector<Face> MultibodySystem::element_surface() const {
    std::vector<Tetrahedron> all;
    for (const auto& element : implementation_->tetrahedra) all.push_back(element.nodes());
    return boundary(all);
}

std::int32_t MultibodySystem::add_elastic_mesh(const ElasticMeshParameters& body) {
    const auto& q = body.pose.orientation;
    refuse_unless(
        finite(body.pose.position) && std::abs(std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) - 1.0) < 1e-6,
        "the pose of the elastic mesh", body.name, "must be finite, with a quaternion of length 1");
    std::set<std::int32_t> touching;
    if (body.contact_radius > 0.0)
        for (const auto& face : boundary(body.mesh.tetrahedra)) touching.insert(face.begin(), face.end());
    const mechanics::Matrix3d A = mechanics::quaternion(q).toRotationMatrix();
    const auto first = node_count();
    for (std::size_t i = 0; i < body.mesh.vertices.size(); ++i) {
        NodeParameters node;
        node.position =
            mechanics::array(mechanics::vector(body.pose.position) + A * mechanics::vector(body.mesh.vertices[i]));
        node.fixed = std::any_of(body.fixed_boxes.begin(), body.fixed_boxes.end(),
                                 [&](const AlignedBox& box) { return inside(box, node.position); });
        if (!node.fixed) node.velocity = body.velocity;
        const auto added = add_node(node);
        if (touching.contains(static_cast<std::int32_t>(i)))
            add_node_contact(added, body.contact_radius, body.contact_material);
    }
    for (auto nodes : body.mesh.tetrahedra) {
        for (auto& node : nodes) {
            if (node < 0 || node >= static_cast<std::int32_t>(body.mesh.vertices.size()))
                throw InputError(fmt::format("a tetrahedron of the elastic mesh \"{}\" has the vertex {} of {}",
                                             body.name, node, body.mesh.vertices.size()));
            node += first;
        }
        add_tetrahedron(nodes, body.material, body.model);
    }
    return first;
}

}  // namespace delassus
