// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/sparse_factor.hpp (sdk/compiled_once.hpp).
#pragma once

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <numeric>
#include <utility>

#include "delassus/sdk/blas_threads.hpp"
#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/dissection.hpp"
#include "delassus/sdk/sparse_factor.hpp"

namespace delassus::sdk {

/// The strict lower triangle of the matrix with its rows and columns at new positions, in no order within a row or
/// column.
DELASSUS_SDK_FUNCTION SparseFactor::Pattern SparseFactor::permute(const Eigen::Ref<const SparseColumns>& matrix,
                                                                  const std::vector<std::int32_t>& position,
                                                                  bool by_rows) {
    const std::int32_t *start = matrix.outerIndexPtr(), *row = matrix.innerIndexPtr();
    const auto visit = [&](auto&& take) {
        for (std::int32_t j = 0; j < matrix.cols(); ++j)
            for (std::int32_t k = start[j]; k < start[j + 1]; ++k) {
                if (row[k] <= j) continue;
                const auto [low, high] =
                    std::minmax(position[static_cast<std::size_t>(row[k])], position[static_cast<std::size_t>(j)]);
                by_rows ? take(static_cast<std::size_t>(high), low) : take(static_cast<std::size_t>(low), high);
            }
    };
    Pattern result;
    result.start.assign(position.size() + 1, 0);
    visit([&](std::size_t outer, std::int32_t) { ++result.start[outer + 1]; });
    std::partial_sum(result.start.begin(), result.start.end(), result.start.begin());
    result.index.resize(static_cast<std::size_t>(result.start.back()));
    std::vector<std::int32_t> next = result.start;
    visit(
        [&](std::size_t outer, std::int32_t inner) { result.index[static_cast<std::size_t>(next[outer]++)] = inner; });
    return result;
}

/// The elimination tree (Liu 1986) of a matrix by the rows of its lower triangle: parent of each column, −1 at a root.
DELASSUS_SDK_FUNCTION std::vector<std::int32_t> SparseFactor::elimination_tree(const Pattern& rows) {
    const std::size_t n = rows.start.size() - 1;
    std::vector<std::int32_t> parent(n, -1), ancestor(n, -1);
    for (std::size_t row = 0; row < n; ++row) {
        const auto i = static_cast<std::int32_t>(row);
        for (std::int32_t k = rows.start[row]; k < rows.start[row + 1]; ++k) {
            std::int32_t j = rows.index[static_cast<std::size_t>(k)];
            while (j >= 0 && j < i) {
                const std::int32_t next = ancestor[static_cast<std::size_t>(j)];
                ancestor[static_cast<std::size_t>(j)] = i;
                if (next < 0) parent[static_cast<std::size_t>(j)] = i;
                j = next;
            }
        }
    }
    return parent;
}

/// New positions in which children come right before their parents.
DELASSUS_SDK_FUNCTION std::vector<std::int32_t> SparseFactor::postorder(const std::vector<std::int32_t>& parent) {
    const auto n = static_cast<std::int32_t>(parent.size());
    std::vector<std::int32_t> first_child(parent.size(), -1), sibling(parent.size(), -1), position(parent.size());
    for (std::int32_t j = n - 1; j >= 0; --j) {
        const std::int32_t p = parent[static_cast<std::size_t>(j)];
        if (p < 0) continue;
        sibling[static_cast<std::size_t>(j)] = first_child[static_cast<std::size_t>(p)];
        first_child[static_cast<std::size_t>(p)] = j;
    }
    std::int32_t count = 0;
    std::vector<std::int32_t> stack;
    for (std::int32_t root = 0; root < n; ++root) {
        if (parent[static_cast<std::size_t>(root)] >= 0) continue;
        stack.push_back(root);
        while (!stack.empty()) {
            const auto j = static_cast<std::size_t>(stack.back());
            if (const std::int32_t child = first_child[j]; child >= 0) {
                first_child[j] = sibling[static_cast<std::size_t>(child)];
                stack.push_back(child);
            } else {
                position[j] = count++;
                stack.pop_back();
            }
        }
    }
    return position;
}

/// New positions by approximate minimum degree.
DELASSUS_SDK_FUNCTION std::vector<std::int32_t> SparseFactor::minimum_degree(
    const Eigen::Ref<const SparseColumns>& matrix) {
    std::vector<std::int32_t> position(static_cast<std::size_t>(matrix.rows()));
    if (position.empty()) return position;
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, std::int32_t> order;
    Eigen::AMDOrdering<std::int32_t>()(matrix.selfadjointView<Eigen::Lower>(), order);
    for (Eigen::Index k = 0; k < matrix.rows(); ++k)
        position[static_cast<std::size_t>(order.indices()[k])] = static_cast<std::int32_t>(k);
    return position;
}

DELASSUS_SDK_FUNCTION bool SparseFactor::has_analyzed(const Eigen::Ref<const SparseColumns>& matrix,
                                                      Eigen::Index positive) const {
    const std::int32_t *start = matrix.outerIndexPtr(), *row = matrix.innerIndexPtr();
    return size_ == matrix.rows() && positive_ == positive &&
           std::equal(analyzed_start_.begin(), analyzed_start_.end(), start, start + matrix.cols() + 1) &&
           std::equal(analyzed_row_.begin(), analyzed_row_.end(), row, row + matrix.nonZeros());
}

DELASSUS_SDK_FUNCTION bool SparseFactor::analyze(const Eigen::Ref<const SparseColumns>& matrix, Eigen::Index positive) {
    constexpr Eigen::Index smallest_to_dissect = 1000;
    constexpr double least_flops_for_blas = 5e7;  // some 5 ms of Eigen
    if (has_analyzed(matrix, positive)) return false;
    const std::int32_t *start = matrix.outerIndexPtr(), *row = matrix.innerIndexPtr();
    analyze(matrix, positive, minimum_degree(matrix));
    // Dissection is worth its time where the fill is large.
    if (entries_ >= 10.0 * static_cast<double>(matrix.nonZeros()) && size_ >= smallest_to_dissect) {
        if (std::vector<std::int32_t> position = nested_dissection(matrix); !position.empty()) {
            SparseFactor other(kernels_);
            other.analyze(matrix, positive, std::move(position));
            if (other.flops_ < flops_) *this = std::move(other);
        }
    }
    front_ = DenseFront(kernels_ == Kernels::Best && flops_ >= least_flops_for_blas ? Blas::find() : nullptr);
    analyzed_start_.assign(start, start + matrix.cols() + 1);
    analyzed_row_.assign(row, row + matrix.nonZeros());
    return true;
}

DELASSUS_SDK_FUNCTION void SparseFactor::analyze(const Eigen::Ref<const SparseColumns>& matrix, Eigen::Index positive,
                                                 std::vector<std::int32_t> position) {
    size_ = matrix.rows();
    positive_ = positive;
    const auto n = static_cast<std::size_t>(size_);
    position_ = std::move(position);
    const std::vector<std::int32_t> post = postorder(elimination_tree(permute(matrix, position_, true)));
    for (auto& p : position_) p = post[static_cast<std::size_t>(p)];
    sign_.assign(n, 1.0);
    for (std::size_t i = 0; i < n; ++i)
        if (static_cast<Eigen::Index>(i) >= positive) sign_[static_cast<std::size_t>(position_[i])] = -1.0;
    find_supernodes(permute(matrix, position_, false));
    find_places(matrix);
}

// A column of L has the rows of the matrix's column and those of its children in the elimination tree: of the runs of
// columns so far whose first row below is this column. Where one run alone has it, and the matrix adds no row, the
// column joins that run without a look at its rows.
DELASSUS_SDK_FUNCTION void SparseFactor::find_supernodes(const Pattern& columns) {
    const auto n = static_cast<std::size_t>(size_);
    struct Run {
        std::int32_t first, columns;
        std::vector<std::int32_t> below;  // rows under the last column, ascending, from `begin` on
        std::size_t begin;
        double zeros;  // stored without need

        [[nodiscard]] std::size_t rows_below() const { return below.size() - begin; }
    };
    std::vector<Run> runs;
    std::vector<std::int32_t> first_waiting(n, -1), next_waiting;  // runs by their first row below
    std::vector<std::int32_t> mark(n, -1);                         // the column in whose turn the row was found
    std::int32_t marked = -1;                                      // the turn that found the rows of the last run
    for (std::size_t j = 0; j < n; ++j) {
        const auto column = static_cast<std::int32_t>(j);
        const auto* own = columns.index.data() + columns.start[j];
        const auto* own_end = columns.index.data() + columns.start[j + 1];
        const std::int32_t child = first_waiting[j];
        Run run{column, 1, {}, 0, 0.0};
        if (child >= 0 && next_waiting[static_cast<std::size_t>(child)] < 0 &&
            static_cast<std::size_t>(child) + 1 == runs.size() &&
            std::all_of(own, own_end, [&](std::int32_t i) { return mark[static_cast<std::size_t>(i)] == marked; })) {
            run = std::move(runs.back());
            runs.pop_back();
            ++run.begin;
            ++run.columns;
        } else {
            const auto take = [&](std::int32_t i) {
                if (i <= column || mark[static_cast<std::size_t>(i)] == column) return;
                mark[static_cast<std::size_t>(i)] = column;
                run.below.push_back(i);
            };
            std::for_each(own, own_end, take);
            for (std::int32_t r = child; r >= 0; r = next_waiting[static_cast<std::size_t>(r)]) {
                const Run& from = runs[static_cast<std::size_t>(r)];
                std::for_each(from.below.begin() + static_cast<std::ptrdiff_t>(from.begin), from.below.end(), take);
            }
            std::sort(run.below.begin(), run.below.end());
            marked = column;
        }
        // The run before joins in if this column is its parent and few zeros are stored for it.
        while (!runs.empty()) {
            const Run& before = runs.back();
            if (before.rows_below() == 0 || before.below[before.begin] > column) break;
            const double height = static_cast<double>(run.columns) + static_cast<double>(run.rows_below());
            const double extra = before.columns * (height - static_cast<double>(before.rows_below()));
            const double together = before.columns + run.columns;
            const double stored = together * (together + static_cast<double>(run.rows_below()));
            const double zeros = before.zeros + run.zeros + extra;
            if (extra > 0.0 && !(zeros <= 0.1 * stored || (together <= 12.0 && zeros <= 0.3 * stored))) break;
            run = {before.first, before.columns + run.columns, std::move(run.below), run.begin, zeros};
            runs.pop_back();
        }
        next_waiting.resize(runs.size() + 1, -1);
        if (run.rows_below() > 0) {
            const auto above = static_cast<std::size_t>(run.below[run.begin]);
            next_waiting[runs.size()] = first_waiting[above];
            first_waiting[above] = static_cast<std::int32_t>(runs.size());
        }
        runs.push_back(std::move(run));
    }

    nodes_.clear();
    row_.clear();
    entries_ = flops_ = 0.0;
    node_of_.resize(n);
    for (const Run& run : runs) {
        Supernode node;
        node.first = run.first;
        node.columns = run.columns;
        node.height = run.columns + static_cast<std::int32_t>(run.rows_below());
        node.row = row_.size();
        node.panel = static_cast<std::size_t>(entries_);
        for (std::int32_t c = 0; c < run.columns; ++c) {
            row_.push_back(run.first + c);
            node_of_[static_cast<std::size_t>(run.first + c)] = static_cast<std::int32_t>(nodes_.size());
        }
        row_.insert(row_.end(), run.below.begin() + static_cast<std::ptrdiff_t>(run.begin), run.below.end());
        entries_ += static_cast<double>(node.height) * node.columns;
        flops_ += static_cast<double>(node.height) * node.height * node.columns;
        nodes_.push_back(node);
    }
    for (Supernode& node : nodes_)
        if (node.height > node.columns)
            node.parent = node_of_[static_cast<std::size_t>(row_[node.row + static_cast<std::size_t>(node.columns)])];
    find_stacks();
}

DELASSUS_SDK_FUNCTION void SparseFactor::find_stacks() {
    std::vector<std::vector<std::size_t>> children(nodes_.size());
    for (std::size_t s = 0; s < nodes_.size(); ++s)
        if (nodes_[s].parent >= 0) children[static_cast<std::size_t>(nodes_[s].parent)].push_back(s);
    child_.clear();
    for (std::size_t s = nodes_.size(); s-- > 0;) {
        Supernode& node = nodes_[s];
        node.depth = node.parent < 0 ? 0 : nodes_[static_cast<std::size_t>(node.parent)].depth + 1;
        node.child = child_.size();
        node.children = children[s].size();
        child_.insert(child_.end(), children[s].begin(), children[s].end());
    }
    stack_size_ = {};
    std::array<std::size_t, 2> top{};
    for (Supernode& node : nodes_) {
        const auto rest = static_cast<std::size_t>(node.height - node.columns);
        if (node.children > 0) top[(node.depth + 1) % 2] = nodes_[child_[node.child]].update;
        const std::size_t own = node.depth % 2;
        node.update = top[own];
        top[own] += rest * rest;
        stack_size_[own] = std::max(stack_size_[own], top[own]);
    }
}

DELASSUS_SDK_FUNCTION void SparseFactor::find_places(const Eigen::Ref<const SparseColumns>& matrix) {
    // The entries of the matrix by supernodes: their counts, then their places in L for the time being.
    const std::int32_t *start = matrix.outerIndexPtr(), *row = matrix.innerIndexPtr();
    const auto visit = [&](auto&& take) {
        for (std::int32_t j = 0; j < matrix.cols(); ++j)
            for (std::int32_t k = start[j]; k < start[j + 1]; ++k) {
                if (row[k] < j) continue;
                const auto [low, high] =
                    std::minmax(position_[static_cast<std::size_t>(row[k])], position_[static_cast<std::size_t>(j)]);
                take(k, low, high, low != position_[static_cast<std::size_t>(j)],
                     static_cast<std::size_t>(node_of_[static_cast<std::size_t>(low)]));
            }
    };
    std::vector<std::size_t> next(nodes_.size() + 1, 0);
    visit([&](std::int32_t, std::int32_t, std::int32_t, bool, std::size_t s) { ++next[s + 1]; });
    std::partial_sum(next.begin(), next.end(), next.begin());
    entry_.resize(next.back());
    for (std::size_t s = 0; s < nodes_.size(); ++s) nodes_[s].entry = next[s];
    visit([&](std::int32_t k, std::int32_t low, std::int32_t high, bool swapped, std::size_t s) {
        const auto column = static_cast<std::size_t>(low - nodes_[s].first);
        entry_[next[s]++] = {k, high, column * static_cast<std::size_t>(nodes_[s].height), swapped};
    });
    place_in_parent_.resize(row_.size());
    run_end_.resize(row_.size());
    std::vector<std::int32_t> place(static_cast<std::size_t>(size_));
    for (std::size_t s = 0; s < nodes_.size(); ++s) {
        const Supernode& node = nodes_[s];
        for (std::int32_t i = 0; i < node.height; ++i)
            place[static_cast<std::size_t>(row_[node.row + static_cast<std::size_t>(i)])] = i;
        for (std::size_t k = node.entry; k < next[s]; ++k)
            entry_[k].target += static_cast<std::size_t>(place[static_cast<std::size_t>(entry_[k].row)]);
        for (std::size_t c = 0; c < node.children; ++c) {
            const Supernode& child = nodes_[child_[node.child + c]];
            for (std::int32_t i = child.columns; i < child.height; ++i) {
                const std::size_t k = child.row + static_cast<std::size_t>(i);
                place_in_parent_[k] = place[static_cast<std::size_t>(row_[k])];
            }
            for (std::int32_t i = child.height - 1; i >= child.columns; --i) {
                const std::size_t k = child.row + static_cast<std::size_t>(i);
                const bool last = i + 1 == child.height || place_in_parent_[k + 1] != place_in_parent_[k] + 1;
                run_end_[k] = last ? i + 1 - child.columns : run_end_[k + 1];
            }
        }
    }
}

DELASSUS_SDK_FUNCTION bool SparseFactor::factorize(const Eigen::Ref<const SparseColumns>& matrix) {
    const BlasThreads threads(front_.blas() ? flops_ : 0.0);
    value_.assign(static_cast<std::size_t>(entries_), 0.0);
    upper_.clear();
    for (std::size_t k = 0; k < 2; ++k) stack_[k].resize(stack_size_[k]);
    for (std::size_t s = 0; s < nodes_.size(); ++s) {
        const Supernode& node = nodes_[s];
        gather_entries(s, matrix.valuePtr(), matrix.valuePtr(), value_);
        DenseFront::Block update = update_of(node);
        for (Eigen::Index j = 0; j < update.cols(); ++j) update.col(j).tail(update.rows() - j).setZero();
        for (std::size_t k = 0; k < node.children; ++k) add_update(nodes_[child_[node.child + k]]);
        const DenseFront::Block panel(value_.data() + node.panel, node.height, node.columns,
                                      Eigen::OuterStride<>(node.height));
        if (!front_.factor(panel, sign_.data() + node.first, update)) return false;
    }
    return true;
}

// Pivots below this part of the largest entry beside them are replaced.
inline constexpr double smallest_pivot = 1e-14;

DELASSUS_SDK_FUNCTION bool SparseFactor::factorize(const Eigen::Ref<const SparseColumns>& lower,
                                                   std::span<const double> upper) {
    value_.assign(static_cast<std::size_t>(entries_), 0.0);
    upper_.assign(static_cast<std::size_t>(entries_), 0.0);
    replaced_pivots_ = 0;
    for (std::size_t k = 0; k < 2; ++k) stack_[k].resize(stack_size_[k]);
    for (std::size_t s = 0; s < nodes_.size(); ++s) {
        const Supernode& node = nodes_[s];
        gather_entries(s, lower.valuePtr(), upper.data(), value_);
        gather_entries(s, upper.data(), lower.valuePtr(), upper_);
        DenseFront::Block update = update_of(node);
        update.setZero();
        for (std::size_t k = 0; k < node.children; ++k) {
            add_update(nodes_[child_[node.child + k]]);
            add_upper_update(nodes_[child_[node.child + k]]);
        }
        const auto panel = [&node](std::vector<double>& values) {
            return DenseFront::Block(values.data() + node.panel, node.height, node.columns,
                                     Eigen::OuterStride<>(node.height));
        };
        const int replaced = front_.factor(panel(value_), panel(upper_), smallest_pivot, update);
        if (replaced < 0) return false;
        replaced_pivots_ += replaced;
    }
    return true;
}

// The entries on one side of the diagonal; lower and upper are the sides in the order of the matrix.
DELASSUS_SDK_FUNCTION void SparseFactor::gather_entries(std::size_t supernode, const double* lower, const double* upper,
                                                        std::vector<double>& panels) const {
    const std::size_t end = supernode + 1 < nodes_.size() ? nodes_[supernode + 1].entry : entry_.size();
    for (std::size_t k = nodes_[supernode].entry; k < end; ++k)
        panels[nodes_[supernode].panel + entry_[k].target] += (entry_[k].mirrored ? upper : lower)[entry_[k].source];
}

DELASSUS_SDK_FUNCTION DenseFront::Block SparseFactor::update_of(const Supernode& node) {
    const Eigen::Index rest = node.height - node.columns;
    return {stack_[node.depth % 2].data() + node.update, rest, rest, Eigen::OuterStride<>(rest)};
}

// Adds the update of a supernode to its parent's front.
DELASSUS_SDK_FUNCTION void SparseFactor::add_update(const Supernode& child) {
    const Supernode& parent = nodes_[static_cast<std::size_t>(child.parent)];
    const DenseFront::Block from = update_of(child);
    DenseFront::Block update = update_of(parent);
    const Eigen::Index rest = from.rows();
    const std::int32_t* place = place_in_parent_.data() + child.row + child.columns;
    const std::int32_t* run_end = run_end_.data() + child.row + child.columns;
    for (Eigen::Index j = 0; j < rest; ++j) {
        const bool own = place[j] < parent.columns;
        double* target = own ? value_.data() + parent.panel +
                                   static_cast<std::size_t>(place[j]) * static_cast<std::size_t>(parent.height)
                             : update.col(place[j] - parent.columns).data() - parent.columns;
        const double* source = from.col(j).data();
        for (Eigen::Index i = j; i < rest;) {
            const Eigen::Index end = run_end[i];
            for (double* t = target + place[i]; i < end; ++i) *t++ += source[i];
        }
    }
}

// Adds what is above the diagonal of a supernode's update to its parent's front: the transposed rows of its panel, then
// the update. Columns go in strips, so that the rows of the panel are filled in pieces.
DELASSUS_SDK_FUNCTION void SparseFactor::add_upper_update(const Supernode& child) {
    constexpr Eigen::Index strip = 8;
    const Supernode& parent = nodes_[static_cast<std::size_t>(child.parent)];
    const DenseFront::Block from = update_of(child);
    DenseFront::Block update = update_of(parent);
    const Eigen::Index rest = from.rows();
    const std::int32_t* place = place_in_parent_.data() + child.row + child.columns;
    const Eigen::Index own = std::lower_bound(place, place + rest, parent.columns) - place;
    for (Eigen::Index begin = 0; begin < rest; begin += strip) {
        const Eigen::Index end = std::min(begin + strip, rest);
        for (Eigen::Index i = 0; i < std::min(own, end); ++i) {
            double* target = upper_.data() + parent.panel +
                             static_cast<std::size_t>(place[i]) * static_cast<std::size_t>(parent.height);
            for (Eigen::Index j = std::max(begin, i); j < end; ++j) target[place[j]] += from(i, j);
        }
        for (Eigen::Index j = begin; j < end; ++j)
            if (place[j] >= parent.columns)
                for (Eigen::Index i = own; i < j; ++i)
                    update(place[i] - parent.columns, place[j] - parent.columns) += from(i, j);
    }
}

DELASSUS_SDK_FUNCTION void SparseFactor::solve(Vector& v) const {
    work_.resize(size_);
    for (Eigen::Index i = 0; i < size_; ++i) work_[position_[static_cast<std::size_t>(i)]] = v[i];
    for (const Supernode& node : nodes_) {
        const Eigen::Index k = node.columns, rest = node.height - k;
        const ConstPanel panel(value_.data() + node.panel, node.height, k);
        auto own = work_.segment(node.first, k);
        panel.topRows(k).triangularView<Eigen::Lower>().solveInPlace(own);
        if (rest == 0) continue;
        gathered_.noalias() = panel.bottomRows(rest) * own;
        const std::int32_t* row = row_.data() + node.row + k;
        for (Eigen::Index i = 0; i < rest; ++i) work_[row[i]] -= gathered_[i];
    }
    const std::vector<double>& upper = upper_.empty() ? value_ : upper_;
    if (upper_.empty()) work_.array() *= Eigen::Map<const Vector>(sign_.data(), size_).array();
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
        const Eigen::Index k = node->columns, rest = node->height - k;
        const ConstPanel panel(upper.data() + node->panel, node->height, k);
        auto own = work_.segment(node->first, k);
        if (rest > 0) {
            gathered_.resize(rest);
            const std::int32_t* row = row_.data() + node->row + k;
            for (Eigen::Index i = 0; i < rest; ++i) gathered_[i] = work_[row[i]];
            own.noalias() -= panel.bottomRows(rest).transpose() * gathered_;
        }
        panel.topRows(k).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
    }
    for (Eigen::Index i = 0; i < size_; ++i) v[i] = work_[position_[static_cast<std::size_t>(i)]];
}

DELASSUS_SDK_FUNCTION Vector SparseFactor::diagonal() const {
    Vector ordered(size_), result(size_);
    for (const Supernode& node : nodes_)
        ordered.segment(node.first, node.columns) =
            ConstPanel(value_.data() + node.panel, node.height, node.columns).diagonal().cwiseAbs();
    for (Eigen::Index i = 0; i < size_; ++i) result[i] = ordered[position_[static_cast<std::size_t>(i)]];
    return result;
}

// A row of D reaches the supernodes of its columns and all their ancestors.
DELASSUS_SDK_FUNCTION SparseFactor::Reach SparseFactor::reach(const SparseRowsView& D) const {
    Reach result;
    result.rows.resize(nodes_.size());
    std::vector<Eigen::Index> mark(nodes_.size(), -1);
    for (Eigen::Index row = 0; row < D.rows(); ++row)
        for (SparseRowsView::InnerIterator entry(D, row); entry; ++entry) {
            const std::int32_t column = position_[static_cast<std::size_t>(entry.col())];
            for (auto s = node_of_[static_cast<std::size_t>(column)]; s >= 0;
                 s = nodes_[static_cast<std::size_t>(s)].parent) {
                const auto node = static_cast<std::size_t>(s);
                if (mark[node] == row) break;
                mark[node] = row;
                result.rows[node].push_back(static_cast<std::int32_t>(row));
                result.entries += nodes_[node].columns;
            }
        }
    for (std::size_t s = 0; s < nodes_.size(); ++s) {
        const auto rows = static_cast<std::int64_t>(result.rows[s].size());
        if (nodes_[s].parent < 0) result.coupled += rows * rows;
    }
    return result;
}

// As in factorize, with the rows of D for further rows of each front: the panel of a supernode is what D and its
// children leave in its own columns, solved with L11; L21 times it goes to the parent. All products are of matrices.
DELASSUS_SDK_FUNCTION void SparseFactor::half_solve(const SparseRowsView& D, const Reach& reach,
                                                    const Visitor& visit) const {
    struct Item {
        std::int32_t row, column;
        double value;
    };
    std::vector<std::vector<Item>> entries(nodes_.size());
    std::vector<std::vector<std::size_t>> children(nodes_.size());
    for (Eigen::Index row = 0; row < D.rows(); ++row)
        for (SparseRowsView::InnerIterator entry(D, row); entry; ++entry) {
            const std::int32_t column = position_[static_cast<std::size_t>(entry.col())];
            entries[static_cast<std::size_t>(node_of_[static_cast<std::size_t>(column)])].push_back(
                {static_cast<std::int32_t>(row), column, entry.value()});
        }
    std::vector<Matrix> passed(nodes_.size());  // to the parent: rows of the update × rows of D
    std::vector<std::int32_t> place(static_cast<std::size_t>(D.rows()));
    Matrix own;
    for (std::size_t s = 0; s < nodes_.size(); ++s) {
        const auto& rows = reach.rows[s];
        if (rows.empty()) continue;
        const Supernode& node = nodes_[s];
        const Eigen::Index k = node.columns, rest = node.height - k, width = static_cast<Eigen::Index>(rows.size());
        for (std::size_t j = 0; j < rows.size(); ++j)
            place[static_cast<std::size_t>(rows[j])] = static_cast<std::int32_t>(j);
        own.setZero(k, width);
        passed[s].setZero(rest, width);
        for (const Item& entry : entries[s])
            own(entry.column - node.first, place[static_cast<std::size_t>(entry.row)]) += entry.value;
        for (const std::size_t child : children[s]) {
            const Supernode& from = nodes_[child];
            const std::int32_t* target = place_in_parent_.data() + from.row + from.columns;
            for (std::size_t j = 0; j < reach.rows[child].size(); ++j) {
                const Eigen::Index column = place[static_cast<std::size_t>(reach.rows[child][j])];
                for (Eigen::Index i = 0; i < passed[child].rows(); ++i) {
                    const double value = passed[child](i, static_cast<Eigen::Index>(j));
                    (target[i] < k ? own(target[i], column) : passed[s](target[i] - k, column)) += value;
                }
            }
            passed[child].resize(0, 0);
        }
        const ConstPanel panel(value_.data() + node.panel, node.height, k);
        panel.topRows(k).triangularView<Eigen::Lower>().solveInPlace(own);
        if (rest > 0) {
            passed[s].noalias() -= panel.bottomRows(rest) * own;
            children[static_cast<std::size_t>(node.parent)].push_back(s);
        }
        visit(static_cast<Eigen::Index>(node.first), rows, own);
    }
}

}  // namespace delassus::sdk
