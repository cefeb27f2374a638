// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/islands.hpp"

#include <algorithm>
#include <numeric>

namespace delassus {

namespace {

/// Disjoint sets of columns (Tarjan), with halving of paths; the smaller number is the root.
class Sets {
public:
    explicit Sets(std::int32_t count) : parent_(static_cast<std::size_t>(count)) {
        std::iota(parent_.begin(), parent_.end(), 0);
    }
    std::int32_t root(std::int32_t i) {
        while (at(i) != i) i = at(i) = at(at(i));
        return i;
    }
    void join(std::int32_t a, std::int32_t b) {
        a = root(a);
        b = root(b);
        at(std::max(a, b)) = std::min(a, b);
    }

private:
    std::int32_t& at(std::int32_t i) { return parent_[static_cast<std::size_t>(i)]; }
    std::vector<std::int32_t> parent_;
};

/// Calls visit(position in values) for the entries of a row.
template <class Visitor>
void for_each_entry(const SparseMatrix& matrix, std::int32_t row, Visitor&& visit) {
    for (auto k = matrix.row_start[static_cast<std::size_t>(row)];
         k < matrix.row_start[static_cast<std::size_t>(row) + 1]; ++k)
        visit(static_cast<std::size_t>(k));
}

}  // namespace

Islands::Islands(const Problem& problem) : problem_(problem), first_row_{0} {
    const auto n = problem.n();
    for (const Cone& cone : problem.cones) first_row_.push_back(first_row_.back() + cone.rows);
    Sets sets(n);
    for (std::int32_t i = 0; i < n; ++i)
        for_each_entry(problem.H, i, [&](std::size_t k) { sets.join(i, problem.H.column[k]); });
    std::vector<std::int32_t> cone_column(problem.cones.size(), -1);  // any column of the cone's rows
    for (std::size_t c = 0; c < problem.cones.size(); ++c)
        for (auto row = first_row_[c]; row < first_row_[c + 1]; ++row)
            for_each_entry(problem.D, row, [&](std::size_t k) {
                if (problem.D.value[k] == 0.0) return;
                if (cone_column[c] < 0) cone_column[c] = problem.D.column[k];
                sets.join(cone_column[c], problem.D.column[k]);
            });

    std::vector<bool> touched(static_cast<std::size_t>(n), false);  // by root
    for (const auto column : cone_column)
        if (column >= 0) touched[static_cast<std::size_t>(sets.root(column))] = true;
    std::vector<std::int32_t> number(static_cast<std::size_t>(n), -1);  // of the island, by root
    place_.resize(static_cast<std::size_t>(n));
    Island untouched;
    for (std::int32_t i = 0; i < n; ++i) {
        const auto root = static_cast<std::size_t>(sets.root(i));
        if (touched[root] && number[root] < 0) {
            number[root] = static_cast<std::int32_t>(islands_.size());
            islands_.emplace_back();
        }
        Island& island = touched[root] ? islands_[static_cast<std::size_t>(number[root])] : untouched;
        place_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(island.columns.size());
        island.columns.push_back(i);
    }
    for (std::size_t c = 0; c < cone_column.size(); ++c) {
        if (cone_column[c] < 0) continue;
        const auto root = static_cast<std::size_t>(sets.root(cone_column[c]));
        islands_[static_cast<std::size_t>(number[root])].cones.push_back(static_cast<std::int32_t>(c));
    }
    if (!untouched.columns.empty()) islands_.push_back(std::move(untouched));
}

Problem Islands::part(const Island& island) const {
    Problem part;
    part.name = problem_.name;
    part.law = problem_.law;
    part.source = problem_.source;
    const auto append_row = [&](const SparseMatrix& from, std::int32_t row, SparseMatrix& to) {
        for_each_entry(from, row, [&](std::size_t k) {
            if (from.value[k] == 0.0 && &to == &part.D) return;  // it may link to another part
            to.column.push_back(place_[static_cast<std::size_t>(from.column[k])]);
            to.value.push_back(from.value[k]);
        });
        to.row_start.push_back(to.entries());
        ++to.rows;
    };
    part.H.columns = part.D.columns = static_cast<std::int32_t>(island.columns.size());
    for (const auto column : island.columns) {
        append_row(problem_.H, column, part.H);
        part.a.push_back(problem_.a[static_cast<std::size_t>(column)]);
    }
    for (const auto c : island.cones) {
        const auto cone = static_cast<std::size_t>(c);
        part.cones.push_back(problem_.cones[cone]);
        for (auto row = first_row_[cone]; row < first_row_[cone + 1]; ++row) {
            append_row(problem_.D, row, part.D);
            part.b.push_back(problem_.b[static_cast<std::size_t>(row)]);
        }
    }
    return part;
}

Solution Islands::take(const Island& island, const Solution& whole) const {
    Solution part;
    for (const auto column : island.columns) part.x.push_back(whole.x[static_cast<std::size_t>(column)]);
    for (const auto c : island.cones)
        part.lambda.insert(part.lambda.end(), whole.lambda.begin() + first_row_[static_cast<std::size_t>(c)],
                           whole.lambda.begin() + first_row_[static_cast<std::size_t>(c) + 1]);
    return part;
}

void Islands::put(const Island& island, const Solution& part, Solution& whole) const {
    for (std::size_t i = 0; i < island.columns.size(); ++i)
        whole.x[static_cast<std::size_t>(island.columns[i])] = part.x[i];
    auto next = part.lambda.begin();
    for (const auto c : island.cones) {
        const auto rows = problem_.cones[static_cast<std::size_t>(c)].rows;
        std::copy(next, next + rows, whole.lambda.begin() + first_row_[static_cast<std::size_t>(c)]);
        next += rows;
    }
}

}  // namespace delassus
