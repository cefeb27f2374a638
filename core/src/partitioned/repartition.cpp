// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/repartition.hpp"

#include <fmt/format.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "delassus/error.hpp"
#include "partitioned/bytes.hpp"
#include "partitioned/halo.hpp"
#include "partitioned/route.hpp"
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
    const Halo halo(communicator, problem.column_start,
                    foreign_numbers(communicator, problem.column_start, {&problem.D}));
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

/// Edges of one process's bodies. Equal ones are added up now and then, so that they take memory once or twice.
class EdgeBag {
public:
    void add(const Edge& edge) {
        edges_.push_back(edge);
        if (edges_.size() >= 2 * merged_ + 65536) merge();
    }
    /// Sorts the edges and adds up the weights of equal ones.
    void merge() {
        std::sort(edges_.begin(), edges_.end(),
                  [](const Edge& l, const Edge& r) { return std::tie(l.from, l.to) < std::tie(r.from, r.to); });
        merged_ = 0;
        for (const Edge& edge : edges_) {
            if (merged_ > 0 && edges_[merged_ - 1].from == edge.from && edges_[merged_ - 1].to == edge.to) {
                edges_[merged_ - 1].weight += edge.weight;
            } else {
                edges_[merged_++] = edge;
            }
        }
        edges_.resize(merged_);
    }
    [[nodiscard]] const std::vector<Edge>& edges() const { return edges_; }
    void release() { std::vector<Edge>().swap(edges_); }

private:
    std::vector<Edge> edges_;
    std::size_t merged_ = 0;
};

/// The edges that the own cones and rows of H make, by the process that has the body they start at.
std::vector<EdgeBag> own_edges(const Communicator& communicator, const PartitionedProblem& problem,
                               const std::vector<std::int64_t>& bodies, const std::vector<std::int64_t>& body_first) {
    const auto own = rank_of(communicator);
    const Halo halo(communicator, problem.column_start,
                    foreign_numbers(communicator, problem.column_start, {&problem.D, &problem.H}));
    const auto own_body = body_of_columns(problem, bodies, body_first[own], problem.column_start[own]);
    const Numbers body(communicator, halo, own_body);

    std::vector<EdgeBag> bags(static_cast<std::size_t>(communicator.size()));
    const auto add = [&](const Edge& edge) {
        const auto p = std::upper_bound(body_first.begin(), body_first.end(), edge.from) - body_first.begin() - 1;
        bags[static_cast<std::size_t>(p)].add(edge);
    };
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
                add({some[i], some[j], weight});
                add({some[j], some[i], weight});
            }
    };
    together(communicator, [&] {
        each_cone(problem, [&](std::size_t, std::int64_t first, std::int64_t last) {
            bodies_among(columns_of(problem.D, first, last));
            // Rows count for the first body; a loop is kept as the carrier of this weight.
            if (!some.empty()) add({some[0], some[0], last - first});
            connect(1);
        });
        for (std::int64_t row = 0; row < problem.n(); ++row) {
            const auto from = own_body[static_cast<std::size_t>(row)];
            for (const auto column : columns_of(problem.H, row, row + 1))
                if (const auto to = body.of(column); to != from) add({from, to, 1});
        }
        for (EdgeBag& bag : bags) bag.merge();
    });
    return bags;
}

/// The graph of bodies: an edge for each two that share a cone, as heavy as they share cones, or an entry of H; a body
/// is as heavy as its columns and its share of the rows.
VertexRange graph_of(const Communicator& communicator, const PartitionedProblem& problem,
                     const std::vector<std::int64_t>& bodies) {
    const auto own = rank_of(communicator);
    std::vector<std::int64_t> body_first = {0};
    for (const auto count : communicator.all(static_cast<std::int64_t>(bodies.size())))
        body_first.push_back(body_first.back() + count);
    auto bags = own_edges(communicator, problem, bodies, body_first);
    std::vector<Bytes> to(bags.size());
    together(communicator, [&] {
        for (std::size_t p = 0; p < to.size(); ++p) {
            if (p == own) continue;
            put(to[p], bags[p].edges());
            bags[p].release();
        }
    });
    auto from = communicator.exchange(to);
    to = {};
    VertexRange graph;
    together(communicator, [&] {
        for (std::size_t p = 0; p < from.size(); ++p) {
            if (p == own) continue;
            for (const Edge& edge : ByteReader(from[p]).next<Edge>()) bags[own].add(edge);
            Bytes().swap(from[p]);
        }
        bags[own].merge();
        graph.vertices_all = body_first.back();
        for (std::size_t k = 0; k < bodies.size(); ++k)
            graph.weight.push_back((k + 1 < bodies.size() ? bodies[k + 1] : problem.column_start[own + 1]) - bodies[k]);
        graph.start.assign(bodies.size() + 1, 0);
        for (const Edge& edge : bags[own].edges()) {
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
    });
    return graph;
}

/// Gives the entries the new numbers of their columns, ascending within each row.
void renumber(LocalMatrix& matrix, const Numbers& place) {
    std::vector<std::pair<std::int64_t, double>> entries;
    for (std::size_t row = 0; row < static_cast<std::size_t>(matrix.rows); ++row) {
        const auto begin = static_cast<std::size_t>(matrix.row_start[row]),
                   end = static_cast<std::size_t>(matrix.row_start[row + 1]);
        entries.clear();
        for (auto k = begin; k < end; ++k) entries.emplace_back(place.of(matrix.column[k]), matrix.value[k]);
        std::sort(entries.begin(), entries.end(), [](const auto& l, const auto& r) { return l.first < r.first; });
        for (auto k = begin; k < end; ++k) std::tie(matrix.column[k], matrix.value[k]) = entries[k - begin];
    }
}

void move_rows(const Route& rows, LocalMatrix& matrix) {
    rows.move(matrix.row_start, matrix.column, &matrix.value);
    matrix.rows = static_cast<std::int64_t>(matrix.row_start.size()) - 1;
}

void move_cones(const Communicator& communicator, const Route& route, std::vector<Cone>& cones) {
    struct Shape {
        std::int32_t kind, rows, bounds;
    };
    std::vector<Shape> shapes;
    std::vector<std::int64_t> start = {0};
    std::vector<double> numbers;  // of each cone: parameters, lower bounds, upper bounds
    together(communicator, [&] {
        shapes.reserve(cones.size());
        start.reserve(cones.size() + 1);
        for (const Cone& cone : cones) {
            shapes.push_back(
                {static_cast<std::int32_t>(cone.kind), cone.rows, static_cast<std::int32_t>(cone.lo.size())});
            for (const std::span<const double> some :
                 {std::span<const double>(cone.parameters), std::span(cone.lo), std::span(cone.hi)})
                numbers.insert(numbers.end(), some.begin(), some.end());
            start.push_back(static_cast<std::int64_t>(numbers.size()));
        }
        std::vector<Cone>().swap(cones);
    });
    route.move(shapes);
    route.move(start, numbers, static_cast<std::vector<double>*>(nullptr));
    together(communicator, [&] {
        cones.reserve(shapes.size());
        auto next = numbers.cbegin();
        for (const Shape& shape : shapes) {
            Cone& cone = cones.emplace_back();
            cone.kind = static_cast<ConeKind>(shape.kind);
            cone.rows = shape.rows;
            const auto take = [&](auto to, std::ptrdiff_t count) {
                std::copy(next, next + count, to);
                next += count;
            };
            take(cone.parameters.begin(), static_cast<std::ptrdiff_t>(cone.parameters.size()));
            cone.lo.resize(static_cast<std::size_t>(shape.bounds));
            cone.hi.resize(static_cast<std::size_t>(shape.bounds));
            take(cone.lo.begin(), shape.bounds);
            take(cone.hi.begin(), shape.bounds);
        }
    });
}

std::vector<std::int64_t> origin_or_own(const std::vector<std::int64_t>& origin, std::int64_t first,
                                        std::int64_t count) {
    if (!origin.empty()) return origin;
    std::vector<std::int64_t> own(static_cast<std::size_t>(count));
    std::iota(own.begin(), own.end(), first);
    return own;
}

/// The process of each cone: where most of its entries' columns go; of equally many, the smallest.
std::vector<std::int32_t> targets_of_cones(const Communicator& communicator, const PartitionedProblem& problem,
                                           const Numbers& process) {
    std::vector<std::int32_t> target(problem.cones.size(), communicator.rank());
    std::vector<std::int32_t> votes;
    each_cone(problem, [&](std::size_t k, std::int64_t first, std::int64_t last) {
        votes.clear();
        for (const auto column : columns_of(problem.D, first, last))
            votes.push_back(static_cast<std::int32_t>(process.of(column)));
        std::sort(votes.begin(), votes.end());
        std::ptrdiff_t most = 0;
        for (auto at = votes.begin(); at != votes.end();) {
            const auto end = std::upper_bound(at, votes.end(), *at);
            if (end - at > most) {
                most = end - at;
                target[k] = *at;
            }
            at = end;
        }
    });
    return target;
}

}  // namespace

// Columns are renumbered where they are. Then one array after another moves, and the old one is freed before the next:
// beside the part there are, at most, its largest array once more and the pieces that are on their way.
PartitionedProblem moved(const Communicator& communicator, PartitionedProblem problem,
                         const std::vector<std::int32_t>& target) {
    const auto own = rank_of(communicator);
    const auto bodies = bodies_of(communicator, problem);
    together(communicator, [&] {
        if (target.size() != bodies.size() || std::any_of(target.begin(), target.end(), [&](std::int32_t p) {
                return p < 0 || p >= communicator.size();
            }))
            throw InputError(fmt::format("{} bodies need as many processes from 0 to {} to go to, not {} numbers",
                                         bodies.size(), communicator.size() - 1, target.size()));
    });
    const std::int64_t first_column = problem.column_start[own], first_row = problem.row_start[own];
    std::vector<std::int64_t> has_E = {problem.E.columns > 0 ? 1 : 0};
    communicator.max(has_E);

    std::vector<std::int32_t> column_target(static_cast<std::size_t>(problem.n()));
    std::vector<std::int64_t> goes_to(column_target.size());
    for (std::size_t k = 0; k < bodies.size(); ++k) {
        const auto end = k + 1 < bodies.size() ? bodies[k + 1] - first_column : problem.n();
        for (auto column = bodies[k] - first_column; column < end; ++column)
            column_target[static_cast<std::size_t>(column)] = target[k];
    }
    goes_to.assign(column_target.begin(), column_target.end());
    const Route columns(communicator, column_target);
    std::vector<std::int32_t> cone_target, row_target;
    problem.body_start.clear();
    {
        const Halo halo(communicator, problem.column_start,
                        foreign_numbers(communicator, problem.column_start, {&problem.D, &problem.H}));
        const auto new_column = columns.numbers();
        const Numbers place(communicator, halo, new_column), process(communicator, halo, goes_to);
        together(communicator, [&] {
            cone_target = targets_of_cones(communicator, problem, process);
            each_cone(problem, [&](std::size_t k, std::int64_t first, std::int64_t last) {
                row_target.insert(row_target.end(), static_cast<std::size_t>(last - first), cone_target[k]);
            });
            renumber(problem.H, place);
            renumber(problem.D, place);
            for (const auto body : bodies)
                problem.body_start.push_back(new_column[static_cast<std::size_t>(body - first_column)]);
        });
    }
    const Route rows(communicator, row_target), cones(communicator, cone_target);
    if (has_E[0] != 0) {
        if (problem.E.columns == 0) problem.E.row_start.assign(static_cast<std::size_t>(problem.m()) + 1, 0);
        const Halo halo(communicator, problem.row_start,
                        foreign_numbers(communicator, problem.row_start, {&problem.E}));
        const Numbers place(communicator, halo, rows.numbers());
        renumber(problem.E, place);
    }
    together(communicator, [&] {
        problem.column_origin = origin_or_own(problem.column_origin, first_column, problem.n());
        problem.row_origin = origin_or_own(problem.row_origin, first_row, problem.m());
    });
    Route(communicator, target).move(problem.body_start);
    move_rows(rows, problem.D);
    move_rows(columns, problem.H);
    if (has_E[0] != 0) {
        move_rows(rows, problem.E);
        problem.E.columns = rows.start().back();
    }
    columns.move(problem.a);
    columns.move(problem.column_origin);
    rows.move(problem.b);
    rows.move(problem.row_origin);
    move_cones(communicator, cones, problem.cones);
    problem.H.columns = problem.D.columns = columns.start().back();
    problem.column_start = columns.start();
    problem.row_start = rows.start();
    problem.cone_start = cones.start();
    return problem;
}

namespace {

/// Gives pages that nothing uses back to the system: glibc keeps those of arrays below 32 MiB, of which the graph and
/// the messages were many, and a solver's arrays do not all fit where those were.
void release_pages() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

}  // namespace

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
    std::vector<std::int32_t> part;
    {
        VertexRange graph = graph_of(communicator, problem, bodies);
        scotch(communicator.handle(), graph, part);
    }
    release_pages();
    problem = moved(communicator, std::move(problem), part);
    release_pages();
    return problem;
}

}  // namespace delassus
