// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/islands.hpp"

#include <algorithm>
#include <numeric>

#include "problem/cone_kinds.hpp"
#include "problem/structure.hpp"

namespace delassus {

namespace {

/// Calls visit(position in values) for the entries of a row.
template <class Visitor>
void for_each_entry(const SparseMatrix& matrix, std::int32_t row, Visitor&& visit) {
    for (auto k = matrix.row_start[static_cast<std::size_t>(row)];
         k < matrix.row_start[static_cast<std::size_t>(row) + 1]; ++k)
        visit(static_cast<std::size_t>(k));
}

}  // namespace

// Paths are halved; the smaller number is the root.
std::int32_t Islands::root(std::int32_t column) {
    const auto up = [&](std::int32_t i) -> std::int32_t& { return parent_[static_cast<std::size_t>(i)]; };
    while (up(column) != column) column = up(column) = up(up(column));
    return column;
}

void Islands::join(std::int32_t first, std::int32_t second) {
    first = root(first);
    second = root(second);
    parent_[static_cast<std::size_t>(std::max(first, second))] = std::min(first, second);
}

Island& Islands::next_island() {
    if (count_ == islands_.size()) islands_.emplace_back();
    Island& island = islands_[count_++];
    island.columns.clear();
    island.cones.clear();
    return island;
}

namespace {

/// Whether all rows from `first` to the one before `last` have their entries in the same columns. Differences are
/// gathered, which needs no branch a column.
bool share_columns(const SparseMatrix& D, std::int32_t first, std::int32_t last) {
    const auto* start = D.row_start.data();
    const std::int32_t length = start[first + 1] - start[first];
    const std::int32_t* column = D.column.data() + start[first];
    for (auto row = first + 1; row < last; ++row) {
        if (start[row + 1] - start[row] != length) return false;
        const std::int32_t* other = D.column.data() + start[row];
        std::int32_t difference = 0;
        for (std::int32_t k = 0; k < length; ++k) difference |= column[k] ^ other[k];
        if (difference != 0) return false;
    }
    return true;
}

}  // namespace

// The root of all is found once a cone, and one look finds the columns that it has. A contact has the same columns in
// all of its rows: they are looked at once, and the rows' values only where a column is new.
void Islands::join_rows(const SparseMatrix& D) {
    const auto cones = first_row_.size() - 1;
    cone_column_.assign(cones, -1);  // any column of the cone's rows
    for (std::size_t c = 0; c < cones; ++c) {
        const auto first = first_row_[c], last = first_row_[c + 1];
        // The processor's own prefetching ends at each page.
        if (const auto ahead = D.row_start[static_cast<std::size_t>(first)] + 1024; ahead < D.entries())
            __builtin_prefetch(D.column.data() + ahead);
        std::int32_t top = -1;  // the root of the cone's columns
        const auto is_joined = [&](std::int32_t column) {
            return top >= 0 && parent_[static_cast<std::size_t>(column)] == top;
        };
        const auto take = [&](std::int32_t column) {
            if (top < 0) {
                cone_column_[c] = column;
                top = root(column);
                return;
            }
            join(top, column);
            top = root(top);
            parent_[static_cast<std::size_t>(column)] = top;
        };
        const auto begin = D.row_start[static_cast<std::size_t>(first)];
        const auto end = D.row_start[static_cast<std::size_t>(last)];
        if (share_columns(D, first, last)) {
            const auto length = D.row_start[static_cast<std::size_t>(first) + 1] - begin;
            for (auto k = begin; k < begin + length; ++k) {
                const auto column = D.column[static_cast<std::size_t>(k)];
                if (is_joined(column)) continue;
                bool zero = true;
                for (auto e = k; zero && e < end; e += length) zero = D.value[static_cast<std::size_t>(e)] == 0.0;
                if (!zero) take(column);
            }
            continue;
        }
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
            if (!is_joined(D.column[k]) && D.value[k] != 0.0) take(D.column[k]);
    }
}

void Islands::find(const Problem& problem, std::span<const std::int32_t> bodies) {
    problem_ = &problem;
    count_ = 0;
    const auto n = problem.n();
    first_row_.assign(1, 0);
    for (const Cone& cone : problem.cones) first_row_.push_back(first_row_.back() + cone.rows);
    parent_.resize(static_cast<std::size_t>(n));
    std::iota(parent_.begin(), parent_.end(), 0);
    for (std::int32_t i = 0; i < n; ++i)
        for_each_entry(problem.H, i, [&](std::size_t k) {
            if (problem.H.column[k] != i) join(i, problem.H.column[k]);
        });
    for (std::size_t i = 1; i < bodies.size(); ++i)
        if (bodies[i] == bodies[i - 1]) join(static_cast<std::int32_t>(i - 1), static_cast<std::int32_t>(i));
    join_rows(problem.D);

    touched_.assign(static_cast<std::size_t>(n), 0);  // by root
    for (const auto column : cone_column_)
        if (column >= 0) touched_[static_cast<std::size_t>(root(column))] = 1;
    number_.assign(static_cast<std::size_t>(n), -1);  // of the island, by root
    place_.resize(static_cast<std::size_t>(n));
    untouched_.columns.clear();
    std::int32_t last_root = -1;  // neighbouring columns are of one island as a rule
    Island* island = nullptr;
    for (std::int32_t i = 0; i < n; ++i) {
        if (const auto top = root(i); top != last_root) {
            last_root = top;
            const auto r = static_cast<std::size_t>(top);
            if (touched_[r] && number_[r] < 0) {
                number_[r] = static_cast<std::int32_t>(count_);
                next_island();
            }
            island = touched_[r] ? &islands_[static_cast<std::size_t>(number_[r])] : &untouched_;
        }
        place_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(island->columns.size());
        island->columns.push_back(i);
    }
    for (std::size_t c = 0; c < cone_column_.size(); ++c) {
        if (cone_column_[c] < 0) continue;
        const auto r = static_cast<std::size_t>(root(cone_column_[c]));
        islands_[static_cast<std::size_t>(number_[r])].cones.push_back(static_cast<std::int32_t>(c));
    }
    if (!untouched_.columns.empty()) next_island().columns = untouched_.columns;
}

std::int64_t Islands::rows(const Island& island) const {
    std::int64_t sum = 0;
    for (const auto c : island.cones) sum += problem_->cones[static_cast<std::size_t>(c)].rows;
    return sum;
}

bool Islands::can_part(const Problem& problem) {
    bool diagonal = true;
    for (std::int32_t row = 0; row < problem.E.rows; ++row)
        for_each_entry(problem.E, row, [&](std::size_t k) { diagonal = diagonal && problem.E.column[k] == row; });
    return diagonal;
}

namespace {

/// Makes a matrix absent; its memory stays.
void clear(SparseMatrix& matrix) {
    if (matrix.rows == 0) return;
    matrix.rows = matrix.columns = 0;
    matrix.row_start.assign(1, 0);
    matrix.column.clear();
    matrix.value.clear();
}

/// Makes `to` one row and column larger: by the entry of `from` on its diagonal in that row, if there is one.
void append_diagonal_row(const SparseMatrix& from, std::int32_t row, SparseMatrix& to) {
    for_each_entry(from, row, [&](std::size_t k) {
        to.column.push_back(to.rows);
        to.value.push_back(from.value[k]);
    });
    to.columns = ++to.rows;
    to.row_start.push_back(static_cast<std::int32_t>(to.value.size()));
}

}  // namespace

void Islands::part(const Island& island, Problem& part) const {
    const Problem& whole = *problem_;
    part.name = whole.name;
    part.law = whole.law;
    part.source = whole.source;
    part.a.clear();
    part.b.clear();
    // The arrays take all entries first, and are cut to what there is at the end.
    const auto begin = [&](SparseMatrix& matrix, std::int32_t entries) {
        matrix.rows = 0;
        matrix.columns = static_cast<std::int32_t>(island.columns.size());
        matrix.row_start.assign(1, 0);
        matrix.column.resize(static_cast<std::size_t>(entries));
        matrix.value.resize(static_cast<std::size_t>(entries));
    };
    const auto append_row = [&](const SparseMatrix& from, std::int32_t row, bool with_zeros, SparseMatrix& to) {
        auto next = static_cast<std::size_t>(to.row_start.back());
        for_each_entry(from, row, [&](std::size_t k) {
            if (from.value[k] == 0.0 && !with_zeros) return;
            to.column[next] = place_[static_cast<std::size_t>(from.column[k])];
            to.value[next++] = from.value[k];
        });
        to.row_start.push_back(static_cast<std::int32_t>(next));
        ++to.rows;
    };
    const auto end = [](SparseMatrix& matrix) {
        matrix.column.resize(static_cast<std::size_t>(matrix.row_start.back()));
        matrix.value.resize(static_cast<std::size_t>(matrix.row_start.back()));
    };
    const auto entries_between = [](const SparseMatrix& matrix, std::int32_t first, std::int32_t last) {
        return matrix.row_start[static_cast<std::size_t>(last)] - matrix.row_start[static_cast<std::size_t>(first)];
    };

    std::int32_t entries = 0;
    for (const auto column : island.columns) entries += entries_between(whole.H, column, column + 1);
    begin(part.H, entries);
    for (const auto column : island.columns) {
        append_row(whole.H, column, true, part.H);
        part.a.push_back(whole.a[static_cast<std::size_t>(column)]);
    }
    end(part.H);

    entries = 0;
    for (const auto c : island.cones) {
        const auto cone = static_cast<std::size_t>(c);
        entries += entries_between(whole.D, first_row_[cone], first_row_[cone + 1]);
    }
    begin(part.D, entries);
    part.cones.resize(island.cones.size());
    for (std::size_t k = 0; k < island.cones.size(); ++k) {
        const auto cone = static_cast<std::size_t>(island.cones[k]);
        part.cones[k] = whole.cones[cone];
        for (auto row = first_row_[cone]; row < first_row_[cone + 1]; ++row) {
            append_row(whole.D, row, false, part.D);  // an entry of zero may link to another part
            part.b.push_back(whole.b[static_cast<std::size_t>(row)]);
        }
    }
    end(part.D);

    clear(part.E);
    if (whole.E.rows == 0) return;
    for (const auto c : island.cones)
        for (auto row = first_row_[static_cast<std::size_t>(c)]; row < first_row_[static_cast<std::size_t>(c) + 1];
             ++row)
            append_diagonal_row(whole.E, row, part.E);
    if (part.E.value.empty()) clear(part.E);
}

std::uint64_t Islands::identity(const Island& island) const {
    const Problem& whole = *problem_;
    Hash hash;
    hash.add(island.columns);
    const auto add = [&](const auto& numbers, std::int32_t first, std::int32_t last) {
        hash.add(numbers.data() + first, static_cast<std::size_t>(last - first) * sizeof numbers[0]);
    };
    for (const auto column : island.columns) add(whole.a, column, column + 1);
    for (const auto c : island.cones) {
        const auto index = static_cast<std::size_t>(c);
        const Cone& cone = whole.cones[index];
        hash.add_size(static_cast<std::uint64_t>(cone.kind));
        hash.add_size(static_cast<std::uint64_t>(cone.rows));
        hash.add(cone.parameters.data(), parameter_bytes(cone));
        hash.add(cone.lo);
        hash.add(cone.hi);
        const auto first = first_row_[index], last = first_row_[index + 1];
        // Where the rows stand depends on other parts; how long they are does not.
        for (auto row = first; row < last; ++row)
            hash.add_size(static_cast<std::uint64_t>(whole.D.row_start[static_cast<std::size_t>(row) + 1] -
                                                     whole.D.row_start[static_cast<std::size_t>(row)]));
        const auto begin = whole.D.row_start[static_cast<std::size_t>(first)];
        const auto end = whole.D.row_start[static_cast<std::size_t>(last)];
        add(whole.D.column, begin, end);
        add(whole.D.value, begin, end);
        add(whole.b, first, last);
        if (whole.E.rows > 0)
            add(whole.E.value, whole.E.row_start[static_cast<std::size_t>(first)],
                whole.E.row_start[static_cast<std::size_t>(last)]);
    }
    return std::max<std::uint64_t>(hash.value(), 2);
}

void Islands::take(const Island& island, const Solution& whole, Solution& part) const {
    part.x.clear();
    part.lambda.clear();
    for (const auto column : island.columns) part.x.push_back(whole.x[static_cast<std::size_t>(column)]);
    for (const auto c : island.cones)
        part.lambda.insert(part.lambda.end(), whole.lambda.begin() + first_row_[static_cast<std::size_t>(c)],
                           whole.lambda.begin() + first_row_[static_cast<std::size_t>(c) + 1]);
}

void Islands::put(const Island& island, const Solution& part, Solution& whole) const {
    for (std::size_t i = 0; i < island.columns.size(); ++i)
        whole.x[static_cast<std::size_t>(island.columns[i])] = part.x[i];
    auto next = part.lambda.begin();
    for (const auto c : island.cones) {
        const auto rows = problem_->cones[static_cast<std::size_t>(c)].rows;
        std::copy(next, next + rows, whole.lambda.begin() + first_row_[static_cast<std::size_t>(c)]);
        next += rows;
    }
}

}  // namespace delassus
