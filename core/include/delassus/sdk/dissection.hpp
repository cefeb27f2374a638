// SPDX-License-Identifier: BSD-3-Clause
// An order of elimination by nested dissection.
#pragma once

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

namespace dissection {
using Nodes = std::vector<std::int32_t>;

inline constexpr std::size_t smallest_part = 48;  // nodes

/// An undirected graph without loops: the neighbours of each node, ascending.
using Graph = std::vector<Nodes>;

inline Graph graph_of(const Eigen::Ref<const SparseColumns>& lower) {
    Graph graph(static_cast<std::size_t>(lower.cols()));
    for (Eigen::Index j = 0; j < lower.cols(); ++j)
        for (Eigen::Ref<const SparseColumns>::InnerIterator entry(lower, j); entry; ++entry) {
            if (entry.row() <= j) continue;
            graph[static_cast<std::size_t>(j)].push_back(static_cast<std::int32_t>(entry.row()));
            graph[static_cast<std::size_t>(entry.row())].push_back(static_cast<std::int32_t>(j));
        }
    for (auto& neighbours : graph) std::sort(neighbours.begin(), neighbours.end());
    return graph;
}

/// Members of each node of a smaller graph: rows that have the same neighbours, themselves included.
inline std::vector<Nodes> alike(const Graph& graph) {
    std::map<Nodes, Nodes> members;
    for (std::size_t i = 0; i < graph.size(); ++i) {
        Nodes closed = graph[i];
        closed.insert(std::upper_bound(closed.begin(), closed.end(), static_cast<std::int32_t>(i)),
                      static_cast<std::int32_t>(i));
        members[std::move(closed)].push_back(static_cast<std::int32_t>(i));
    }
    std::vector<Nodes> result;
    for (auto& [closed, rows] : members) result.push_back(std::move(rows));
    std::sort(result.begin(), result.end());
    return result;
}

inline Graph quotient(const Graph& graph, const std::vector<Nodes>& members) {
    Nodes node_of(graph.size());
    for (std::size_t k = 0; k < members.size(); ++k)
        for (const auto row : members[k]) node_of[static_cast<std::size_t>(row)] = static_cast<std::int32_t>(k);
    Graph result(members.size());
    for (std::size_t k = 0; k < members.size(); ++k) {
        Nodes& neighbours = result[k];
        for (const auto row : graph[static_cast<std::size_t>(members[k].front())])
            if (const auto other = node_of[static_cast<std::size_t>(row)]; other != static_cast<std::int32_t>(k))
                neighbours.push_back(other);
        std::sort(neighbours.begin(), neighbours.end());
        neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    }
    return result;
}

class Dissection {
public:
    explicit Dissection(const Graph& graph) : graph_(graph), part_(graph.size(), 0), level_(graph.size(), -1) {}

    /// All nodes in their order of elimination.
    Nodes order() {
        Nodes all(graph_.size());
        for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<std::int32_t>(k);
        dissect(all);
        return std::move(order_);
    }

private:
    /// Appends these nodes, all those of one part, to the order.
    void dissect(const Nodes& nodes) {
        if (nodes.size() <= smallest_part) return order_small(nodes);
        if (const auto components = components_of(nodes); components.size() > 1) {
            for (const Nodes& component : components) {
                give_new_part(component);
                dissect(component);
            }
            return;
        }
        const Nodes reached = levels_from(far_node(nodes.front()));
        const auto [first, second, separator] = split(reached);
        forget(reached);
        if (first.empty() || second.empty()) return order_small(nodes);
        for (const Nodes* part : {&first, &second, &separator}) give_new_part(*part);
        dissect(first);
        dissect(second);
        order_small(separator);
    }

    [[nodiscard]] std::vector<Nodes> components_of(const Nodes& nodes) {
        std::vector<Nodes> components;
        for (const auto node : nodes)
            if (level_[static_cast<std::size_t>(node)] < 0) components.push_back(levels_from(node));
        forget(nodes);
        return components;
    }

    struct Split {
        Nodes first, second, separator;
    };

    /// The smallest level among those that leave at least a third of the nodes on either side, less its nodes that do
    /// not touch the far side.
    [[nodiscard]] Split split(const Nodes& reached) const {
        const auto depth = static_cast<std::size_t>(level_[static_cast<std::size_t>(reached.back())]) + 1;
        std::vector<std::size_t> width(depth, 0);
        for (const auto node : reached) ++width[static_cast<std::size_t>(level_[static_cast<std::size_t>(node)])];
        std::size_t before = 0, best = depth;
        for (std::size_t l = 0; l < depth; ++l) {
            const bool even = 3 * before <= 2 * reached.size() && 3 * (before + width[l]) >= reached.size();
            if (even && (best == depth || width[l] < width[best])) best = l;
            before += width[l];
        }
        Split result;
        for (const auto node : reached) {
            const auto level = static_cast<std::size_t>(level_[static_cast<std::size_t>(node)]);
            if (level > best) {
                result.second.push_back(node);
            } else if (level == best && touches(node, static_cast<std::int32_t>(best) + 1)) {
                result.separator.push_back(node);
            } else {
                result.first.push_back(node);
            }
        }
        return result;
    }
    [[nodiscard]] bool touches(std::int32_t node, std::int32_t level) const {
        const auto& neighbours = graph_[static_cast<std::size_t>(node)];
        return std::any_of(neighbours.begin(), neighbours.end(),
                           [&](std::int32_t other) { return level_[static_cast<std::size_t>(other)] == level; });
    }

    /// A node at an end of the part that holds this one: the last of the levels from the last of its levels.
    std::int32_t far_node(std::int32_t node) {
        for (int k = 0; k < 2; ++k) {
            const Nodes reached = levels_from(node);
            node = reached.back();
            forget(reached);
        }
        return node;
    }

    /// Breadth-first levels within the part of this node; what is reached, level by level.
    Nodes levels_from(std::int32_t start) {
        Nodes reached{start};
        level_[static_cast<std::size_t>(start)] = 0;
        for (std::size_t k = 0; k < reached.size(); ++k) {
            const auto node = static_cast<std::size_t>(reached[k]);
            for (const auto other : graph_[node]) {
                const auto index = static_cast<std::size_t>(other);
                if (part_[index] != part_[node] || level_[index] >= 0) continue;
                level_[index] = level_[node] + 1;
                reached.push_back(other);
            }
        }
        return reached;
    }
    void forget(const Nodes& nodes) {
        for (const auto node : nodes) level_[static_cast<std::size_t>(node)] = -1;
    }
    void give_new_part(const Nodes& nodes) {
        ++parts_;
        for (const auto node : nodes) part_[static_cast<std::size_t>(node)] = parts_;
    }

    void order_small(const Nodes& nodes) {
        std::map<std::int32_t, std::int32_t> local;
        for (std::size_t k = 0; k < nodes.size(); ++k) local[nodes[k]] = static_cast<std::int32_t>(k);
        std::vector<Eigen::Triplet<double, std::int32_t>> entries;
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            entries.emplace_back(static_cast<std::int32_t>(k), static_cast<std::int32_t>(k), 1.0);
            for (const auto other : graph_[static_cast<std::size_t>(nodes[k])])
                if (const auto found = local.find(other); found != local.end())
                    entries.emplace_back(static_cast<std::int32_t>(k), found->second, 1.0);
        }
        const auto size = static_cast<Eigen::Index>(nodes.size());
        SparseColumns matrix(size, size);
        matrix.setFromTriplets(entries.begin(), entries.end());
        Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, std::int32_t> order;
        Eigen::AMDOrdering<std::int32_t>()(matrix, order);
        for (Eigen::Index k = 0; k < size; ++k) order_.push_back(nodes[static_cast<std::size_t>(order.indices()[k])]);
    }

    const Graph& graph_;
    Nodes part_, level_, order_;
    std::int32_t parts_ = 0;
};
}  // namespace dissection

/// New positions of the rows of a symmetric matrix, of which the lower triangle's pattern is read: rows of a separator
/// come after the two parts that it keeps apart, down to small parts, each ordered by AMD (George and Liu, An automatic
/// nested dissection algorithm for irregular finite element problems, SIAM J. Numer. Anal. 15, 1978). Rows with equal
/// patterns, such as those of one body, stay together.
[[nodiscard]] inline std::vector<std::int32_t> nested_dissection(const Eigen::Ref<const SparseColumns>& lower) {
    using namespace dissection;
    const Graph rows = graph_of(lower);
    const std::vector<Nodes> members = alike(rows);
    const Graph graph = quotient(rows, members);
    std::vector<std::int32_t> position(rows.size());
    std::int32_t next = 0;
    for (const auto node : Dissection(graph).order())
        for (const auto row : members[static_cast<std::size_t>(node)]) position[static_cast<std::size_t>(row)] = next++;
    return position;
}

}  // namespace delassus::sdk
