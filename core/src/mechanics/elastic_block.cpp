// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "delassus/error.hpp"
#include "mechanics/multibody_implementation.hpp"

namespace delassus {

namespace {

void check(const ElasticBlock& block) {
    double nodes = 1.0;
    for (std::size_t i = 0; i < 3; ++i) {
        if (!(block.edges[i] > 0.0) || !std::isfinite(block.edges[i]) || !std::isfinite(block.corner[i]))
            throw InputError(
                fmt::format("the edges of the elastic block \"{}\" must be positive and finite", block.name));
        if (block.cells[i] < 1)
            throw InputError(fmt::format("the elastic block \"{}\" has {} cells along an edge; it needs at least one",
                                         block.name, block.cells[i]));
        nodes *= block.cells[i] + 1.0;
    }
    if (3.0 * nodes > std::numeric_limits<std::int32_t>::max())
        throw InputError(
            fmt::format("the elastic block \"{}\" has {:.3g} nodes, which is too many", block.name, nodes));
}

// The six orders of the axes: a path from (0,0,0) to (1,1,1) along them is a tetrahedron; the odd ones turn it over.
constexpr std::array<std::array<std::size_t, 3>, 6> orders = {
    {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};

}  // namespace

std::int32_t MultibodySystem::add_elastic_block(const ElasticBlock& block) {
    check(block);
    const auto first = node_count();
    const auto& cells = block.cells;
    using Place = std::array<std::int32_t, 3>;
    const auto number = [&](const Place& at) {
        return first + (at[0] * (cells[1] + 1) + at[1]) * (cells[2] + 1) + at[2];
    };
    const auto for_each = [](const Place& end, auto&& visit) {
        for (std::int32_t i = 0; i < end[0]; ++i)
            for (std::int32_t j = 0; j < end[1]; ++j)
                for (std::int32_t k = 0; k < end[2]; ++k) visit(Place{i, j, k});
    };
    for_each({cells[0] + 1, cells[1] + 1, cells[2] + 1}, [&](const Place& at) {
        NodeParameters node;
        node.velocity = block.velocity;
        bool surface = false;
        for (std::size_t i = 0; i < 3; ++i) {
            node.position[i] = block.corner[i] + block.edges[i] * at[i] / cells[i];
            const bool low = at[i] == 0, high = at[i] == cells[i];
            surface = surface || low || high;
            node.fixed = node.fixed || (low && block.fixed_faces[2 * i]) || (high && block.fixed_faces[2 * i + 1]);
        }
        if (node.fixed) node.velocity = {0.0, 0.0, 0.0};
        const auto added = add_node(node);
        if (surface && block.contact_radius > 0.0)
            add_node_contact(added, block.contact_radius, block.contact_material);
    });
    for_each(cells, [&](const Place& brick) {
        for (std::size_t order = 0; order < orders.size(); ++order) {
            Place at = brick;
            std::array<std::int32_t, 4> nodes{number(at)};
            for (std::size_t step = 0; step < 3; ++step) {
                ++at[orders[order][step]];
                nodes[step + 1] = number(at);
            }
            if (order >= 3) std::swap(nodes[1], nodes[2]);
            add_tetrahedron(nodes, block.material, block.model);
        }
    });
    return first;
}

}  // namespace delassus
