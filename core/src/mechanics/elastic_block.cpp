// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "delassus/error.hpp"
#include "mechanics/checks.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

namespace {

void check(const ElasticBlock& block) {
    double nodes = 1.0;
    mechanics::refuse_unless(mechanics::finite(block.angular_velocity), "the angular velocity of the elastic block",
                             block.name, "is not finite");
    for (std::size_t i = 0; i < 3; ++i) {
        if (!(block.edges[i] > 0.0) || !std::isfinite(block.edges[i]) || !std::isfinite(block.corner[i]))
            throw InputError(
                fmt::format("the edges of the elastic block \"{}\" must be positive and finite", block.name));
        if (block.cells[i] < 1)
            throw InputError(fmt::format("the elastic block \"{}\" has {} cells along an edge; it needs at least one",
                                         block.name, block.cells[i]));
        nodes *= static_cast<double>(block.order) * block.cells[i] + 1.0;
    }
    if (3.0 * nodes > std::numeric_limits<std::int32_t>::max())
        throw InputError(
            fmt::format("the elastic block \"{}\" has {:.3g} nodes, which is too many", block.name, nodes));
}

}  // namespace

std::int32_t MultibodySystem::add_elastic_block(const ElasticBlock& block) {
    check(block);
    const auto first = node_count();
    // Nodes along an edge of a brick, less one.
    const bool quadratic = block.order == ElementOrder::Quadratic;
    const std::int32_t parts = quadratic ? 2 : 1;
    using Place = std::array<std::int32_t, 3>;
    const Place steps = {parts * block.cells[0], parts * block.cells[1], parts * block.cells[2]};
    const auto number = [&](const Place& at) {
        return first + (at[0] * (steps[1] + 1) + at[1]) * (steps[2] + 1) + at[2];
    };
    const auto for_each = [](const Place& end, auto&& visit) {
        for (std::int32_t i = 0; i < end[0]; ++i)
            for (std::int32_t j = 0; j < end[1]; ++j)
                for (std::int32_t k = 0; k < end[2]; ++k) visit(Place{i, j, k});
    };
    for_each({steps[0] + 1, steps[1] + 1, steps[2] + 1}, [&](const Place& at) {
        NodeParameters node;
        node.velocity = block.velocity;
        bool surface = false;
        for (std::size_t i = 0; i < 3; ++i) {
            node.position[i] = block.corner[i] + block.edges[i] * at[i] / steps[i];
            const bool low = at[i] == 0, high = at[i] == steps[i];
            surface = surface || low || high;
            node.fixed = node.fixed || (low && block.fixed_faces[2 * i]) || (high && block.fixed_faces[2 * i + 1]);
        }
        if (node.fixed) node.velocity = {0.0, 0.0, 0.0};
        const auto added = add_node(node);
        if (surface && block.contact_radius > 0.0)
            add_node_contact(added, block.contact_radius, block.contact_material);
    });
    for_each(block.cells, [&](const Place& cell) {
        std::array<Place, 8> corners;
        for (std::int32_t c = 0; c < 8; ++c)
            corners[static_cast<std::size_t>(c)] = {parts * (cell[0] + c / 4), parts * (cell[1] + c / 2 % 2),
                                                    parts * (cell[2] + c % 2)};
        if (!quadratic) {
            std::array<std::int32_t, 8> nodes{};
            for (std::size_t c = 0; c < 8; ++c) nodes[c] = number(corners[c]);
            return add_brick(nodes, block.material, block.model);
        }
        for (const auto& tetrahedron : mechanics::brick_tetrahedra) {
            std::array<std::int32_t, 10> nodes{};
            for (std::size_t k = 0; k < 4; ++k) nodes[k] = number(corners[tetrahedron[k]]);
            for (std::size_t e = 0; e < 6; ++e) {
                const Place& from = corners[tetrahedron[mechanics::tetrahedron_edges[e][0]]];
                const Place& to = corners[tetrahedron[mechanics::tetrahedron_edges[e][1]]];
                nodes[4 + e] = number({(from[0] + to[0]) / 2, (from[1] + to[1]) / 2, (from[2] + to[2]) / 2});
            }
            add_quadratic_tetrahedron(nodes, block.material, block.model);
        }
    });
    implementation_->spin_nodes(first, block.angular_velocity);
    return first;
}

}  // namespace delassus
