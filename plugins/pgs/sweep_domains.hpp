// SPDX-License-Identifier: BSD-3-Clause
// Domains of bodies whose contacts may be visited at the same time.
//
// A breadth-first search from a body at the border of a heap finds the bodies by layers, and a contact joins bodies of
// one layer or of two neighbouring ones. Bodies are counted in that order and cut into domains of about as many
// contacts each. So a domain touches only the one before and the one after it, as slices do, and the contacts between
// two domains share no body with those between the next two, unless a domain is a single layer thin.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "delassus/sdk/block_rows.hpp"

namespace delassus::pgs {

/// Blocks by the domains of what they touch. Lists of one vector share no column with one another. All by ascending
/// numbers, so that they do not depend on threads.
struct SweepDomains {
    std::vector<std::vector<std::int32_t>> inside;   ///< by domains
    std::vector<std::vector<std::int32_t>> between;  ///< of a domain and the next one
    std::vector<std::int32_t> rest;                  ///< the others: all, where no good cut was found
    /// New numbers of the ranges of columns k w … (k + 1) w − 1, w wide as a chunk, by which those of a domain stand
    /// together: threads then write to memory of their own. Empty where nothing was cut, or chunks begin elsewhere.
    std::vector<std::int32_t> range;

    /// As many domains as are worth it: powers of two, from 2 on.
    static SweepDomains of(const sdk::BlockRows& rows) {
        const auto blocks = static_cast<std::int32_t>(rows.groups().size());
        int count = 2;
        while (count < most && 2 * count * blocks_of_a_domain <= blocks) count *= 2;
        const Graph graph(rows);
        const std::vector<std::int32_t> layers = graph.by_layers();
        SweepDomains domains;
        domains.cut(graph, layers, count);
        if (4 * domains.longest() > 3 * static_cast<std::size_t>(blocks)) {
            domains.become_one(blocks);
        } else if (graph.aligned) {
            domains.range.resize(layers.size());
            for (std::size_t k = 0; k < layers.size(); ++k)
                domains.range[static_cast<std::size_t>(layers[k])] = static_cast<std::int32_t>(k);
        }
        return domains;
    }

private:
    static constexpr int most = 16;
    static constexpr std::int32_t blocks_of_a_domain = 1024;

    /// Which nodes a block touches. A node is a range of columns as wide as a chunk: a rigid body, where chunks are its
    /// six velocities; else a chunk may touch two nodes.
    struct Graph {
        std::vector<std::int32_t> start, node;         // of a block: node[start[k]] … node[start[k + 1] − 1]
        std::vector<std::int32_t> block_start, block;  // and the other way round

        bool aligned = true;  // chunks begin where nodes do

        explicit Graph(const sdk::BlockRows& rows) {
            std::int32_t nodes = 0;
            start.push_back(0);
            for (const auto& group : rows.groups()) {
                for (int c = 0; c < group.chunks; ++c) {
                    const std::int32_t first = rows.starts(group)[c];
                    aligned = aligned && first % rows.width() == 0;
                    add(first / rows.width());
                    add((first + rows.width() - 1) / rows.width());
                }
                start.push_back(static_cast<std::int32_t>(node.size()));
            }
            for (const std::int32_t n : node) nodes = std::max(nodes, n + 1);
            block_start.assign(static_cast<std::size_t>(nodes) + 1, 0);
            for (const std::int32_t n : node) ++block_start[static_cast<std::size_t>(n) + 1];
            for (std::size_t n = 1; n < block_start.size(); ++n) block_start[n] += block_start[n - 1];
            block.resize(node.size());
            std::vector<std::int32_t> at(block_start.begin(), block_start.end() - 1);
            for (std::size_t k = 0; k + 1 < start.size(); ++k)
                for (std::int32_t i = start[k]; i < start[k + 1]; ++i)
                    block[static_cast<std::size_t>(at[static_cast<std::size_t>(node[static_cast<std::size_t>(i)])]++)] =
                        static_cast<std::int32_t>(k);
        }

        [[nodiscard]] std::size_t blocks() const { return start.size() - 1; }
        [[nodiscard]] std::size_t nodes() const { return block_start.size() - 1; }

        /// The nodes, each connected part from one of its ends.
        [[nodiscard]] std::vector<std::int32_t> by_layers() const {
            std::vector<std::int32_t> order, trial;
            std::vector<char> seen(nodes(), 0), tried(nodes(), 0);
            for (std::size_t n = 0; n < nodes(); ++n) {
                if (seen[n]) continue;
                trial.clear();
                search(static_cast<std::int32_t>(n), tried, trial);
                search(trial.back(), seen, order);
            }
            return order;
        }

    private:
        void add(std::int32_t n) {
            if (node.size() == static_cast<std::size_t>(start.back()) || node.back() < n) node.push_back(n);
        }

        // Appends what can be reached from a node, breadth first.
        void search(std::int32_t from, std::vector<char>& seen, std::vector<std::int32_t>& order) const {
            std::size_t next = order.size();
            seen[static_cast<std::size_t>(from)] = 1;
            for (order.push_back(from); next < order.size(); ++next) {
                const auto n = static_cast<std::size_t>(order[next]);
                for (std::int32_t b = block_start[n]; b < block_start[n + 1]; ++b) {
                    const auto k = static_cast<std::size_t>(block[static_cast<std::size_t>(b)]);
                    for (std::int32_t i = start[k]; i < start[k + 1]; ++i) {
                        const std::int32_t other = node[static_cast<std::size_t>(i)];
                        if (std::exchange(seen[static_cast<std::size_t>(other)], 1) == 0) order.push_back(other);
                    }
                }
            }
        }
    };

    void cut(const Graph& graph, const std::vector<std::int32_t>& order, int count) {
        std::vector<std::int32_t> domain(graph.nodes(), 0);
        const auto touches = static_cast<std::int64_t>(graph.node.size());
        std::int64_t passed = 0;
        for (const std::int32_t n : order) {
            const auto at = static_cast<std::size_t>(n);
            domain[at] = static_cast<std::int32_t>(passed * count / touches);
            passed += graph.block_start[at + 1] - graph.block_start[at];
        }
        inside.resize(static_cast<std::size_t>(count));
        between.resize(static_cast<std::size_t>(count) - 1);
        std::vector<std::int32_t> user(graph.nodes(), -1);  // the list of `between` that touches a node
        for (std::size_t k = 0; k < graph.blocks(); ++k) {
            const auto first = graph.node.begin() + graph.start[k], last = graph.node.begin() + graph.start[k + 1];
            std::int32_t low = count - 1, high = 0;
            for (auto n = first; n != last; ++n) {
                low = std::min(low, domain[static_cast<std::size_t>(*n)]);
                high = std::max(high, domain[static_cast<std::size_t>(*n)]);
            }
            const auto is_free = [&](std::int32_t n) {
                const std::int32_t by = user[static_cast<std::size_t>(n)];
                return by < 0 || by == low;
            };
            if (low >= high) {
                inside[static_cast<std::size_t>(low)].push_back(static_cast<std::int32_t>(k));
            } else if (high == low + 1 && std::all_of(first, last, is_free)) {
                for (auto n = first; n != last; ++n) user[static_cast<std::size_t>(*n)] = low;
                between[static_cast<std::size_t>(low)].push_back(static_cast<std::int32_t>(k));
            } else {
                rest.push_back(static_cast<std::int32_t>(k));
            }
        }
    }

    /// Blocks that must be visited one after another, with a thread for each list.
    [[nodiscard]] std::size_t longest() const {
        std::size_t sum = rest.size();
        for (const auto* phase : {&inside, &between}) {
            std::size_t most_members = 0;
            for (const auto& members : *phase) most_members = std::max(most_members, members.size());
            sum += most_members;
        }
        return sum;
    }

    void become_one(std::int32_t blocks) {
        inside.clear();
        between.clear();
        rest.resize(static_cast<std::size_t>(blocks));
        std::iota(rest.begin(), rest.end(), 0);
    }
};

}  // namespace delassus::pgs
