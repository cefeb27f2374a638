// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/repartition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "delassus/error.hpp"
#include "partitioned/bytes.hpp"
#include "partitioned/cone_bytes.hpp"
#include "partitioned/halo.hpp"
#include "partitioned/scotch_module.hpp"
#include "problem/structure.hpp"
#include "support/module.hpp"

namespace delassus {

namespace {

std::size_t rank_of(const Communicator& communicator) {
    return static_cast<std::size_t>(communicator.rank());
}

/// Calls action(k, first row, last row) for each own cone.
template <class Action>
void each_cone(const PartitionedProblem& problem, Action&& action) {
    std::int64_t row = 0;
    for (std::size_t k = 0; k < problem.cones.size(); ++k) {
        action(k, row, row + problem.cones[k].rows);
        row += problem.cones[k].rows;
    }
}

std::span<const std::int64_t> columns_of(const LocalMatrix& matrix, std::int64_t first_row, std::int64_t last_row) {
    const auto first = matrix.row_start[static_cast<std::size_t>(first_row)],
               last = matrix.row_start[static_cast<std::size_t>(last_row)];
    return {matrix.column.data() + first, static_cast<std::size_t>(last - first)};
}

/// Values of the halo's numbers, own ones first, as integers: they are numbers below 2⁵³.
class Numbers {
public:
    Numbers(const Communicator& communicator, const Halo& halo, const std::vector<std::int64_t>& own) : halo_(halo) {
        values_.assign(own.begin(), own.end());
        values_.resize(halo.size());
        halo.fetch(communicator, values_);
    }
    [[nodiscard]] std::int64_t of(std::int64_t number) const {
        return static_cast<std::int64_t>(values_[halo_.place(number)]);
    }

private:
    const Halo& halo_;
    std::vector<double> values_;
};

}  // namespace

PartitionQuality measure_partition(const Communicator& communicator, const PartitionedProblem& problem) {
    const Halo halo(communicator, problem.column_start, problem.D.column);
    std::vector<std::int64_t> sums(3, 0), largest(2, 0);
    together(communicator, [&] {
        each_cone(problem, [&](std::size_t, std::int64_t first, std::int64_t last) {
            const auto columns = columns_of(problem.D, first, last);
            if (columns.empty()) return;
            const auto owner = halo.owner(columns[0]);
            const auto start = problem.column_start[owner], end = problem.column_start[owner + 1];
            if (std::any_of(columns.begin(), columns.end(), [&](auto j) { return j < start || j >= end; })) ++sums[1];
        });
        sums[0] = static_cast<std::int64_t>(problem.cones.size());
        sums[2] = largest[0] = halo.ghosts();
        largest[1] = problem.n() + problem.m();
    });
    communicator.sum(sums);
    communicator.max(largest);
    const auto total = static_cast<double>(problem.n_all() + problem.m_all());
    return {sums[0], sums[1], sums[2], largest[0],
            total > 0.0 ? static_cast<double>(largest[1]) * communicator.size() / total : 1.0};
}

Partitioning partitioning_of(std::string_view name) {
    for (const auto kind : {Partitioning::Automatic, Partitioning::FileOrder, Partitioning::Scotch})
        if (name == name_of(kind)) return kind;
    throw InputError(fmt::format("there is no partitioning \"{}\"; it must be auto, file or scotch", name));
}

std::string_view name_of(Partitioning partitioning) {
    return partitioning == Partitioning::Automatic   ? "auto"
           : partitioning == Partitioning::FileOrder ? "file"
                                                     : "scotch";
}

std::vector<std::int64_t> bodies_of(const Communicator& communicator, const PartitionedProblem& problem) {
    if (!problem.body_start.empty()) return problem.body_start;
    std::vector<std::int64_t> bodies;
    const std::int64_t first = problem.column_start[rank_of(communicator)];
    for (std::int64_t row = 0; row < problem.n();) {
        std::int64_t end = row + 1;
        for (auto next = row; next < end && end - row <= largest_inertia_block; ++next)
            for (const auto column : columns_of(problem.H, next, next + 1))
                end = std::max(end, std::min(column - first, problem.n() - 1) + 1);
        if (end - row > largest_inertia_block) end = row + 1;
        bodies.push_back(first + row);
        row = end;
    }
    return bodies;
}

Partitioning chosen_partitioning(const Communicator& communicator, const PartitionedProblem& problem) {
    const int processes = communicator.size();
    if (processes == 1) return Partitioning::FileOrder;
    const PartitionQuality quality = measure_partition(communicator, problem);
    std::vector<std::int64_t> bodies = {static_cast<std::int64_t>(bodies_of(communicator, problem).size())};
    communicator.sum(bodies);
    if (quality.cones == 0 || bodies[0] == 0) return Partitioning::FileOrder;
    const double compact = std::cbrt(static_cast<double>(processes)) *
                           std::pow(static_cast<double>(bodies[0]), 2.0 / 3.0) * static_cast<double>(quality.cones) /
                           static_cast<double>(bodies[0]);
    constexpr double uneven = 1.3;
    return static_cast<double>(quality.cut_cones) <= compact && quality.imbalance <= uneven ? Partitioning::FileOrder
                                                                                            : Partitioning::Scotch;
}

namespace {

/// The numbers of bodies through all processes of the own columns.
std::vector<std::int64_t> body_of_columns(const PartitionedProblem& problem, const std::vector<std::int64_t>& bodies,
                                          std::int64_t first_body, std::int64_t first_column) {
    std::vector<std::int64_t> body(static_cast<std::size_t>(problem.n()), 0);
    for (std::size_t k = 0; k < bodies.size(); ++k) {
        const auto end = k + 1 < bodies.size() ? bodies[k + 1] - first_column : problem.n();
        for (auto column = bodies[k] - first_column; column < end; ++column)
            body[static_cast<std::size_t>(column)] = first_body + static_cast<std::int64_t>(k);
    }
    return body;
}

struct Edge {
    std::int64_t from, to, weight;
};

/// Sorts the edges and adds up the weights of equal ones.
void merge(std::vector<Edge>& edges) {
    std::sort(edges.begin(), edges.end(),
              [](const Edge& l, const Edge& r) { return std::tie(l.from, l.to) < std::tie(r.from, r.to); });
    std::size_t kept = 0;
    for (const Edge& edge : edges) {
        if (kept > 0 && edges[kept - 1].from == edge.from && edges[kept - 1].to == edge.to) {
            edges[kept - 1].weight += edge.weight;
        } else {
            edges[kept++] = edge;
        }
    }
    edges.resize(kept);
}

/// The graph of bodies: an edge for each two that share a cone, as heavy as they share cones, or an entry of H; a body
/// is as heavy as its columns and its share of the rows.
VertexRange graph_of(const Communicator& communicator, const PartitionedProblem& problem,
                     const std::vector<std::int64_t>& bodies, std::vector<std::int64_t>& body_first) {
    const auto own = rank_of(communicator), processes = static_cast<std::size_t>(communicator.size());
    body_first = {0};
    for (const auto count : communicator.all(static_cast<std::int64_t>(bodies.size())))
        body_first.push_back(body_first.back() + count);
    std::vector<std::int64_t> wanted = problem.D.column;
    wanted.insert(wanted.end(), problem.H.column.begin(), problem.H.column.end());
    const Halo halo(communicator, problem.column_start, std::move(wanted));
    const auto own_body = body_of_columns(problem, bodies, body_first[own], problem.column_start[own]);
    const Numbers body(communicator, halo, own_body);

    std::vector<Edge> edges;
    std::vector<std::int64_t> some;
    const auto bodies_among = [&](std::span<const std::int64_t> columns) {
        some.clear();
        for (const auto column : columns) {
            const auto number = body.of(column);
            if (some.empty() || some.back() != number) some.push_back(number);
        }
        std::sort(some.begin(), some.end());
        some.erase(std::unique(some.begin(), some.end()), some.end());
    };
    // A cone of many bodies is a star around its first: all pairs would be too many.
    const auto connect = [&](std::int64_t weight) {
        constexpr std::size_t few = 4;
        for (std::size_t i = 0; i < some.size() && (i == 0 || some.size() <= few); ++i)
            for (std::size_t j = i + 1; j < some.size(); ++j) {
                edges.push_back({some[i], some[j], weight});
                edges.push_back({some[j], some[i], weight});
            }
    };
    each_cone(problem, [&](std::size_t, std::int64_t first, std::int64_t last) {
        bodies_among(columns_of(problem.D, first, last));
        // Rows count for the first body; a loop is kept as the carrier of this weight.
        if (!some.empty()) edges.push_back({some[0], some[0], last - first});
        connect(1);
    });
    for (std::int64_t row = 0; row < problem.n(); ++row) {
        const auto from = own_body[static_cast<std::size_t>(row)];
        for (const auto column : columns_of(problem.H, row, row + 1))
            if (const auto to = body.of(column); to != from) edges.push_back({from, to, 1});
    }
    merge(edges);
    std::vector<std::vector<Edge>> by_process(processes);
    for (const Edge& edge : edges) {
        const auto p = std::upper_bound(body_first.begin(), body_first.end(), edge.from) - body_first.begin() - 1;
        by_process[static_cast<std::size_t>(p)].push_back(edge);
    }
    std::vector<Bytes> to(processes);
    for (std::size_t p = 0; p < processes; ++p) put(to[p], by_process[p]);
    edges.clear();
    for (const Bytes& bytes : communicator.exchange(to)) ByteReader(bytes).append(edges);
    merge(edges);

    VertexRange graph;
    graph.vertices_all = body_first.back();
    for (std::size_t k = 0; k < bodies.size(); ++k)
        graph.weight.push_back((k + 1 < bodies.size() ? bodies[k + 1] : problem.column_start[own + 1]) - bodies[k]);
    graph.start.assign(bodies.size() + 1, 0);
    for (const Edge& edge : edges) {
        const auto k = static_cast<std::size_t>(edge.from - body_first[own]);
        if (edge.to == edge.from) {
            graph.weight[k] += edge.weight;
            continue;
        }
        ++graph.start[k + 1];
        graph.neighbour.push_back(edge.to);
        graph.edge_weight.push_back(edge.weight);
    }
    std::partial_sum(graph.start.begin(), graph.start.end(), graph.start.begin());
    return graph;
}

/// What goes to one process: rows of a matrix with new columns, ascending.
void put_rows(Bytes& bytes, const LocalMatrix& matrix, const std::vector<std::int64_t>& rows, const Numbers& place) {
    std::vector<std::int64_t> length, column;
    std::vector<double> value;
    std::vector<std::pair<std::int64_t, double>> entries;
    for (const auto row : rows) {
        entries.clear();
        for (auto k = matrix.row_start[static_cast<std::size_t>(row)];
             k < matrix.row_start[static_cast<std::size_t>(row) + 1]; ++k)
            entries.emplace_back(place.of(matrix.column[static_cast<std::size_t>(k)]),
                                 matrix.value[static_cast<std::size_t>(k)]);
        std::sort(entries.begin(), entries.end(), [](const auto& l, const auto& r) { return l.first < r.first; });
        length.push_back(static_cast<std::int64_t>(entries.size()));
        for (const auto& [j, number] : entries) {
            column.push_back(j);
            value.push_back(number);
        }
    }
    put(bytes, length);
    put(bytes, column);
    put(bytes, value);
}

void append_rows(ByteReader& reader, LocalMatrix& matrix) {
    for (const auto length : reader.next<std::int64_t>()) {
        matrix.row_start.push_back(matrix.row_start.back() + length);
        ++matrix.rows;
    }
    reader.append(matrix.column);
    reader.append(matrix.value);
}

template <class Value>
void put_chosen(Bytes& bytes, const std::vector<Value>& values, const std::vector<std::int64_t>& chosen) {
    std::vector<Value> some;
    some.reserve(chosen.size());
    for (const auto k : chosen) some.push_back(values[static_cast<std::size_t>(k)]);
    put(bytes, some);
}

/// Where each process begins when own things of which counts[q] go to q are moved, and where those of this process
/// that go to q begin.
std::vector<std::int64_t> new_starts(const Communicator& communicator, const std::vector<std::int64_t>& counts,
                                     std::vector<std::int64_t>& first) {
    const auto processes = static_cast<std::size_t>(communicator.size());
    std::vector<std::int64_t> start = {0};
    first.assign(processes, 0);
    for (std::size_t q = 0; q < processes; ++q) {
        const auto from = communicator.all(counts[q]);
        first[q] = start.back() + std::accumulate(from.begin(), from.begin() + communicator.rank(), std::int64_t{0});
        start.push_back(start.back() + std::accumulate(from.begin(), from.end(), std::int64_t{0}));
    }
    return start;
}

std::vector<std::int64_t> origin_or_own(const std::vector<std::int64_t>& origin, std::int64_t first,
                                        std::int64_t count) {
    if (!origin.empty()) return origin;
    std::vector<std::int64_t> own(static_cast<std::size_t>(count));
    std::iota(own.begin(), own.end(), first);
    return own;
}

}  // namespace

PartitionedProblem moved(const Communicator& communicator, const PartitionedProblem& problem,
                         const std::vector<std::int32_t>& target) {
    const auto own = rank_of(communicator), processes = static_cast<std::size_t>(communicator.size());
    const auto bodies = bodies_of(communicator, problem);
    together(communicator, [&] {
        if (target.size() != bodies.size() || std::any_of(target.begin(), target.end(), [&](std::int32_t p) {
                return p < 0 || p >= communicator.size();
            }))
            throw InputError(fmt::format("{} bodies need as many processes from 0 to {} to go to, not {} numbers",
                                         bodies.size(), processes - 1, target.size()));
    });
    const std::int64_t first_column = problem.column_start[own], first_row = problem.row_start[own];

    // Columns by the process that they go to, in their order.
    std::vector<std::vector<std::int64_t>> columns_to(processes), rows_to(processes), cones_to(processes),
        bodies_to(processes);
    std::vector<std::int64_t> goes_to(static_cast<std::size_t>(problem.n()));
    for (std::size_t k = 0; k < bodies.size(); ++k) {
        const auto end = k + 1 < bodies.size() ? bodies[k + 1] - first_column : problem.n();
        const auto q = static_cast<std::size_t>(target[k]);
        bodies_to[q].push_back(static_cast<std::int64_t>(k));
        for (auto column = bodies[k] - first_column; column < end; ++column) {
            goes_to[static_cast<std::size_t>(column)] = target[k];
            columns_to[q].push_back(column);
        }
    }
    const auto counts_of = [](const std::vector<std::vector<std::int64_t>>& to) {
        std::vector<std::int64_t> counts;
        for (const auto& list : to) counts.push_back(static_cast<std::int64_t>(list.size()));
        return counts;
    };
    PartitionedProblem result;
    result.name = problem.name;
    result.law = problem.law;
    result.source = problem.source;
    result.notes = problem.notes;
    std::vector<std::int64_t> first_new;
    result.column_start = new_starts(communicator, counts_of(columns_to), first_new);
    std::vector<std::int64_t> new_column(static_cast<std::size_t>(problem.n()));
    for (std::size_t q = 0; q < processes; ++q)
        for (const auto column : columns_to[q]) new_column[static_cast<std::size_t>(column)] = first_new[q]++;

    std::vector<std::int64_t> wanted = problem.D.column;
    wanted.insert(wanted.end(), problem.H.column.begin(), problem.H.column.end());
    const Halo halo(communicator, problem.column_start, std::move(wanted));
    const Numbers place(communicator, halo, new_column), process(communicator, halo, goes_to);

    // A cone goes where most of its entries' columns go; of equally many, to the smaller process.
    std::map<std::int64_t, std::int64_t> votes;
    each_cone(problem, [&](std::size_t k, std::int64_t first, std::int64_t last) {
        votes.clear();
        for (const auto column : columns_of(problem.D, first, last)) ++votes[process.of(column)];
        const auto most = std::max_element(votes.begin(), votes.end(),
                                           [](const auto& l, const auto& r) { return l.second < r.second; });
        const auto q = most == votes.end() ? own : static_cast<std::size_t>(most->first);
        cones_to[q].push_back(static_cast<std::int64_t>(k));
        for (auto row = first; row < last; ++row) rows_to[q].push_back(row);
    });
    result.row_start = new_starts(communicator, counts_of(rows_to), first_new);
    std::vector<std::int64_t> new_row(static_cast<std::size_t>(problem.m()));
    for (std::size_t q = 0; q < processes; ++q)
        for (const auto row : rows_to[q]) new_row[static_cast<std::size_t>(row)] = first_new[q]++;
    result.cone_start = new_starts(communicator, counts_of(cones_to), first_new);
    const Halo row_halo(communicator, problem.row_start, problem.E.column);
    const Numbers row_place(communicator, row_halo, new_row);
    std::vector<std::int64_t> has_E = {problem.E.columns > 0 ? 1 : 0};
    communicator.max(has_E);

    std::vector<Bytes> to(processes);
    together(communicator, [&] {
        const auto column_origin = origin_or_own(problem.column_origin, first_column, problem.n()),
                   row_origin = origin_or_own(problem.row_origin, first_row, problem.m());
        LocalMatrix no_E;
        no_E.row_start.assign(static_cast<std::size_t>(problem.m()) + 1, 0);
        for (std::size_t q = 0; q < processes; ++q) {
            std::vector<std::int64_t> body_columns;
            for (const auto k : bodies_to[q])
                body_columns.push_back(
                    new_column[static_cast<std::size_t>(bodies[static_cast<std::size_t>(k)] - first_column)]);
            put(to[q], body_columns);
            put_rows(to[q], problem.H, columns_to[q], place);
            put_rows(to[q], problem.D, rows_to[q], place);
            put_rows(to[q], problem.E.columns > 0 ? problem.E : no_E, rows_to[q], row_place);
            put_chosen(to[q], problem.a, columns_to[q]);
            put_chosen(to[q], problem.b, rows_to[q]);
            put_chosen(to[q], column_origin, columns_to[q]);
            put_chosen(to[q], row_origin, rows_to[q]);
            put_cones(to[q], problem.cones, cones_to[q]);
        }
    });
    auto from = communicator.exchange(to);
    to.clear();
    together(communicator, [&] {
        result.H.columns = result.D.columns = problem.n_all();
        result.E.columns = has_E[0] != 0 ? problem.m_all() : 0;
        for (Bytes& bytes : from) {
            ByteReader reader(bytes);
            reader.append(result.body_start);
            append_rows(reader, result.H);
            append_rows(reader, result.D);
            append_rows(reader, result.E);
            reader.append(result.a);
            reader.append(result.b);
            reader.append(result.column_origin);
            reader.append(result.row_origin);
            append_cones(reader, result.cones);
            Bytes().swap(bytes);
        }
        if (has_E[0] == 0) result.E = {};
    });
    return result;
}

PartitionedProblem repartition(const Communicator& communicator, PartitionedProblem problem, Partitioning how) {
    if (communicator.size() == 1 || problem.n_all() == 0) return problem;
    if (how == Partitioning::Automatic) how = chosen_partitioning(communicator, problem);
    if (how == Partitioning::FileOrder) return problem;
    DelassusScotch scotch = nullptr;
    together(communicator, [&] {
        scotch = reinterpret_cast<DelassusScotch>(module_symbol("delassus_scotch", "delassus_scotch",
                                                                "a problem cannot be partitioned", "PETSc",
                                                                "; keep the order of the file"));
    });
    const auto bodies = bodies_of(communicator, problem);
    std::vector<std::int64_t> body_first;
    const VertexRange graph = graph_of(communicator, problem, bodies, body_first);
    std::vector<std::int32_t> part;
    scotch(communicator.handle(), graph, part);
    return moved(communicator, problem, part);
}

}  // namespace delassus
