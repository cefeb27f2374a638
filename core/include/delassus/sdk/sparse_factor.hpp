// SPDX-License-Identifier: BSD-3-Clause
// L S Lᵀ of a symmetric sparse matrix with pivots of known signs S = diag(±1), without pivoting, by dense fronts.
#pragma once

#include <Eigen/Core>
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "delassus/sdk/dense_front.hpp"
#include "delassus/sdk/dissection.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// The multifrontal method (Duff and Reid 1983; Liu 1992): columns of L with nearly the same pattern form a supernode,
/// whose dense front takes the matrix's entries and the updates of its children in the elimination tree, is factored
/// as far as its own columns go, and leaves its Schur complement to its parent. Order: AMD, or nested
/// dissection where that takes fewer operations. Fronts are factored by Eigen, or by the system's BLAS where the
/// analysis foretells so much work that loading it pays.
class SparseFactor {
public:
    enum class Kernels { Best, Eigen };

    explicit SparseFactor(Kernels kernels = Kernels::Best) : kernels_(kernels) {}

    /// The rows of a matrix by the supernodes that they reach in half solves.
    struct Reach {
        std::vector<std::vector<std::int32_t>> rows;  ///< of each supernode, ascending
        std::int64_t entries = 0;                     ///< that the half-solved rows have altogether
        std::int64_t coupled = 0;  ///< ordered pairs of rows that meet in a root, counted once for each root
    };

    /// matrix: its lower triangle is read, and only the pattern. The first `positive` pivots are positive, the others
    /// negative (a quasi-definite matrix). False where the pattern is the one analysed last: then nothing is done.
    bool analyze(const Eigen::Ref<const SparseColumns>& matrix, Eigen::Index positive);

    /// Whether the last analysis was of this pattern with so many positive pivots.
    [[nodiscard]] bool has_analyzed(const Eigen::Ref<const SparseColumns>& matrix, Eigen::Index positive) const;

    /// matrix: as analysed, with values. False if a pivot has the wrong sign, or is not finite.
    [[nodiscard]] bool factorize(const Eigen::Ref<const SparseColumns>& matrix);

    /// v ← A⁻¹ v.
    void solve(Vector& v) const;

    /// The absolute values of L's diagonal, in the order of the matrix's rows.
    [[nodiscard]] Vector diagonal() const;

    /// Entries of L, known after analyze.
    [[nodiscard]] double entries() const { return entries_; }

    /// What works on dense fronts, known after analyze.
    [[nodiscard]] std::string kernels() const { return front_.blas() ? front_.blas()->description() : "Eigen"; }

    /// Which half-solved rows D L⁻ᵀ have entries where; the pattern of D (any rows, as many columns as the matrix).
    [[nodiscard]] Reach reach(const SparseRowsView& D) const;

    /// Z = L⁻¹ P Dᵀ in dense panels, of a matrix whose pivots are all positive: visit(first, rows, panel) for each
    /// supernode that a row of D reaches, where panel(i, k) is the entry first + i of Z's column rows[k].
    template <class Visitor>
    void half_solve(const SparseRowsView& D, const Reach& reach, Visitor&& visit) const;

private:
    void analyze(const Eigen::Ref<const SparseColumns>& matrix, Eigen::Index positive,
                 std::vector<std::int32_t> position);

    struct Supernode {
        std::int32_t first = 0, columns = 0;  // of L
        std::int32_t height = 0;              // rows of the front: its columns, then those of the update
        std::int32_t parent = -1;             // supernode
        std::size_t row = 0;                  // into row_: height of them, ascending
        std::size_t panel = 0;                // into value_: height × columns
        std::size_t entry = 0;                // into entry_: up to that of the next supernode
        std::size_t child = 0, children = 0;  // into child_
        std::size_t depth = 0;                // below its root
        std::size_t update = 0;               // into stack_[depth % 2]: (height − columns)², lower triangle
    };
    struct Entry {
        std::int32_t source;  // into the values of the matrix
        std::size_t target;   // into the panel
    };

    void find_supernodes(const SparseColumns& permuted, const std::vector<std::int32_t>& parent);
    void find_stacks();
    void find_places(const Eigen::Ref<const SparseColumns>& matrix);
    [[nodiscard]] DenseFront::Block update_of(const Supernode& node);
    void add_update(const Supernode& child);

    static std::vector<std::int32_t> minimum_degree(const Eigen::Ref<const SparseColumns>& matrix);
    static std::vector<std::int32_t> elimination_tree(const SparseColumns& lower);
    static std::vector<std::int32_t> postorder(const std::vector<std::int32_t>& parent);
    static SparseColumns permute(const Eigen::Ref<const SparseColumns>& matrix,
                                 const std::vector<std::int32_t>& position);

    using Matrix = Eigen::MatrixXd;
    using ConstPanel = Eigen::Map<const Matrix>;

    Eigen::Index size_ = 0, positive_ = 0;
    std::vector<std::int32_t> analyzed_start_, analyzed_row_;  // the pattern of the last analysis
    double entries_ = 0.0, flops_ = 0.0;                       // flops_: about, up to a factor
    std::vector<std::int32_t> position_;                       // of each row of the matrix, in L
    std::vector<std::int32_t> node_of_;                        // supernode of each column of L
    std::vector<double> sign_;                                 // of each pivot, in the order of L
    std::vector<Supernode> nodes_;                             // children before parents
    std::vector<std::int32_t> row_;
    // Beside row_, for the rows of the update: their rows in the parent's front.
    std::vector<std::int32_t> place_in_parent_;
    std::vector<Entry> entry_;
    std::vector<double> value_;
    std::vector<std::size_t> child_;      // supernodes
    // Updates that wait for their parents, by the parity of the depth: the children of a supernode lie on top of one
    // stack when it puts its own update on the other.
    std::array<std::vector<double>, 2> stack_;
    std::array<std::size_t, 2> stack_size_{};
    Kernels kernels_;
    DenseFront front_;
    mutable Vector work_, gathered_;
};

/// The lower triangle of the matrix with its rows and columns at new positions, columns sorted.
inline SparseColumns SparseFactor::permute(const Eigen::Ref<const SparseColumns>& matrix,
                                           const std::vector<std::int32_t>& position) {
    std::vector<std::int32_t> count(position.size(), 0);
    const auto visit = [&](auto&& take) {
        for (Eigen::Index j = 0; j < matrix.cols(); ++j)
            for (Eigen::Ref<const SparseColumns>::InnerIterator entry(matrix, j); entry; ++entry) {
                if (entry.row() < j) continue;
                const std::int32_t p = position[static_cast<std::size_t>(entry.row())];
                const std::int32_t q = position[static_cast<std::size_t>(j)];
                take(std::max(p, q), std::min(p, q));
            }
    };
    visit([&](std::int32_t, std::int32_t column) { ++count[static_cast<std::size_t>(column)]; });
    SparseColumns result(matrix.rows(), matrix.cols());
    const std::int32_t entries = std::accumulate(count.begin(), count.end(), 0);
    result.resizeNonZeros(entries);
    std::fill_n(result.valuePtr(), entries, 1.0);
    std::int32_t* start = result.outerIndexPtr();
    start[0] = 0;
    for (std::size_t j = 0; j < count.size(); ++j) start[j + 1] = start[j] + count[j];
    std::vector<std::int32_t> next(start, start + count.size());
    visit([&](std::int32_t row, std::int32_t column) {
        result.innerIndexPtr()[next[static_cast<std::size_t>(column)]++] = row;
    });
    for (std::size_t j = 0; j < count.size(); ++j)
        std::sort(result.innerIndexPtr() + start[j], result.innerIndexPtr() + start[j + 1]);
    return result;
}

/// The elimination tree (Liu 1986): parent of each column, −1 at a root.
inline std::vector<std::int32_t> SparseFactor::elimination_tree(const SparseColumns& lower) {
    const auto n = static_cast<std::size_t>(lower.cols());
    std::vector<std::int32_t> parent(n, -1), ancestor(n, -1);
    const Eigen::SparseMatrix<double, Eigen::RowMajor, std::int32_t> rows = lower;
    for (std::int32_t i = 0; i < lower.rows(); ++i) {
        for (decltype(rows)::InnerIterator entry(rows, i); entry; ++entry) {
            auto j = static_cast<std::int32_t>(entry.col());
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
inline std::vector<std::int32_t> SparseFactor::postorder(const std::vector<std::int32_t>& parent) {
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
inline std::vector<std::int32_t> SparseFactor::minimum_degree(const Eigen::Ref<const SparseColumns>& matrix) {
    std::vector<std::int32_t> position(static_cast<std::size_t>(matrix.rows()));
    if (position.empty()) return position;
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, std::int32_t> order;
    Eigen::AMDOrdering<std::int32_t>()(matrix.selfadjointView<Eigen::Lower>(), order);
    for (Eigen::Index k = 0; k < matrix.rows(); ++k)
        position[static_cast<std::size_t>(order.indices()[k])] = static_cast<std::int32_t>(k);
    return position;
}

inline bool SparseFactor::has_analyzed(const Eigen::Ref<const SparseColumns>& matrix, Eigen::Index positive) const {
    const std::int32_t *start = matrix.outerIndexPtr(), *row = matrix.innerIndexPtr();
    return size_ == matrix.rows() && positive_ == positive &&
           std::equal(analyzed_start_.begin(), analyzed_start_.end(), start, start + matrix.cols() + 1) &&
           std::equal(analyzed_row_.begin(), analyzed_row_.end(), row, row + matrix.nonZeros());
}

inline bool SparseFactor::analyze(const Eigen::Ref<const SparseColumns>& matrix, Eigen::Index positive) {
    constexpr Eigen::Index smallest_to_dissect = 1000;
    constexpr double least_flops_for_blas = 1e8;  // some 15 ms of Eigen
    if (has_analyzed(matrix, positive)) return false;
    const std::int32_t *start = matrix.outerIndexPtr(), *row = matrix.innerIndexPtr();
    analyze(matrix, positive, minimum_degree(matrix));
    // Dissection is worth its time where the fill is large.
    if (entries_ >= 10.0 * static_cast<double>(matrix.nonZeros()) && size_ >= smallest_to_dissect) {
        SparseFactor other(kernels_);
        other.analyze(matrix, positive, nested_dissection(matrix));
        if (other.flops_ < flops_) *this = std::move(other);
    }
    front_ = DenseFront(kernels_ == Kernels::Best && flops_ >= least_flops_for_blas ? Blas::find() : nullptr);
    analyzed_start_.assign(start, start + matrix.cols() + 1);
    analyzed_row_.assign(row, row + matrix.nonZeros());
    return true;
}

inline void SparseFactor::analyze(const Eigen::Ref<const SparseColumns>& matrix, Eigen::Index positive,
                                  std::vector<std::int32_t> position) {
    size_ = matrix.rows();
    positive_ = positive;
    const auto n = static_cast<std::size_t>(size_);
    position_ = std::move(position);
    const std::vector<std::int32_t> parent = elimination_tree(permute(matrix, position_));
    const std::vector<std::int32_t> post = postorder(parent);
    std::vector<std::int32_t> moved(n, -1);
    for (std::size_t j = 0; j < n; ++j)
        if (parent[j] >= 0) moved[static_cast<std::size_t>(post[j])] = post[static_cast<std::size_t>(parent[j])];
    for (auto& p : position_) p = post[static_cast<std::size_t>(p)];
    sign_.assign(n, 1.0);
    for (std::size_t i = 0; i < n; ++i)
        if (static_cast<Eigen::Index>(i) >= positive) sign_[static_cast<std::size_t>(position_[i])] = -1.0;
    find_supernodes(permute(matrix, position_), moved);
    find_places(matrix);
}

inline void SparseFactor::find_supernodes(const SparseColumns& permuted, const std::vector<std::int32_t>& parent) {
    const auto n = static_cast<std::size_t>(size_);
    // The pattern of each column of L: its own entries and those of its children below themselves.
    std::vector<std::vector<std::int32_t>> pattern(n), children(n);
    for (std::size_t j = 0; j < n; ++j)
        if (parent[j] >= 0) children[static_cast<std::size_t>(parent[j])].push_back(static_cast<std::int32_t>(j));
    std::vector<std::int32_t> mark(n, -1);
    struct Run {
        std::int32_t first, columns;
        std::vector<std::int32_t> below;  // rows under the last column
        double zeros;                     // stored without need
    };
    std::vector<Run> runs;
    for (std::size_t j = 0; j < n; ++j) {
        const auto column = static_cast<std::int32_t>(j);
        std::vector<std::int32_t>& rows = pattern[j];
        mark[j] = column;
        const auto take = [&](std::int32_t i) {
            if (i <= column || mark[static_cast<std::size_t>(i)] == column) return;
            mark[static_cast<std::size_t>(i)] = column;
            rows.push_back(i);
        };
        for (SparseColumns::InnerIterator entry(permuted, column); entry; ++entry)
            take(static_cast<std::int32_t>(entry.row()));
        for (const auto child : children[j]) {
            for (const auto i : pattern[static_cast<std::size_t>(child)]) take(i);
            pattern[static_cast<std::size_t>(child)] = {};
        }
        std::sort(rows.begin(), rows.end());
        Run run{column, 1, rows, 0.0};
        // The run before joins in if this column is its parent and few zeros are stored for it.
        while (!runs.empty()) {
            const Run& before = runs.back();
            if (before.below.empty() || before.below.front() > column) break;
            const double height = static_cast<double>(run.columns) + static_cast<double>(run.below.size());
            const double extra = before.columns * (height - static_cast<double>(before.below.size()));
            const double columns = before.columns + run.columns;
            const double stored = columns * (columns + static_cast<double>(run.below.size()));
            const double zeros = before.zeros + run.zeros + extra;
            if (extra > 0.0 && !(zeros <= 0.1 * stored || (columns <= 12.0 && zeros <= 0.3 * stored))) break;
            run = {before.first, before.columns + run.columns, std::move(run.below), zeros};
            runs.pop_back();
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
        node.height = run.columns + static_cast<std::int32_t>(run.below.size());
        node.row = row_.size();
        node.panel = static_cast<std::size_t>(entries_);
        for (std::int32_t c = 0; c < run.columns; ++c) {
            row_.push_back(run.first + c);
            node_of_[static_cast<std::size_t>(run.first + c)] = static_cast<std::int32_t>(nodes_.size());
        }
        row_.insert(row_.end(), run.below.begin(), run.below.end());
        entries_ += static_cast<double>(node.height) * node.columns;
        flops_ += static_cast<double>(node.height) * node.height * node.columns;
        nodes_.push_back(node);
    }
    for (Supernode& node : nodes_)
        if (node.height > node.columns)
            node.parent = node_of_[static_cast<std::size_t>(row_[node.row + static_cast<std::size_t>(node.columns)])];
    find_stacks();
}

inline void SparseFactor::find_stacks() {
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

inline void SparseFactor::find_places(const Eigen::Ref<const SparseColumns>& matrix) {
    const auto place = [this](const Supernode& node, std::int32_t row) {
        const auto begin = row_.begin() + static_cast<std::ptrdiff_t>(node.row);
        return static_cast<std::int32_t>(std::lower_bound(begin, begin + node.height, row) - begin);
    };
    place_in_parent_.assign(row_.size(), 0);
    for (const Supernode& node : nodes_)
        for (std::int32_t i = node.columns; i < node.height; ++i)
            place_in_parent_[node.row + static_cast<std::size_t>(i)] =
                place(nodes_[static_cast<std::size_t>(node.parent)], row_[node.row + static_cast<std::size_t>(i)]);
    std::vector<std::vector<Entry>> entries(nodes_.size());
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
        for (std::int32_t k = matrix.outerIndexPtr()[j]; k < matrix.outerIndexPtr()[j + 1]; ++k) {
            if (matrix.innerIndexPtr()[k] < j) continue;
            const std::int32_t p = position_[static_cast<std::size_t>(matrix.innerIndexPtr()[k])];
            const std::int32_t q = position_[static_cast<std::size_t>(j)];
            const auto s = static_cast<std::size_t>(node_of_[static_cast<std::size_t>(std::min(p, q))]);
            const Supernode& node = nodes_[s];
            const auto column = static_cast<std::size_t>(std::min(p, q) - node.first);
            entries[s].push_back({k, column * static_cast<std::size_t>(node.height) +
                                         static_cast<std::size_t>(place(node, std::max(p, q)))});
        }
    }
    entry_.clear();
    for (std::size_t s = 0; s < nodes_.size(); ++s) {
        nodes_[s].entry = entry_.size();
        entry_.insert(entry_.end(), entries[s].begin(), entries[s].end());
    }
}

inline bool SparseFactor::factorize(const Eigen::Ref<const SparseColumns>& matrix) {
    value_.assign(static_cast<std::size_t>(entries_), 0.0);
    for (std::size_t k = 0; k < 2; ++k) stack_[k].resize(stack_size_[k]);
    for (std::size_t s = 0; s < nodes_.size(); ++s) {
        const Supernode& node = nodes_[s];
        const std::size_t end = s + 1 < nodes_.size() ? nodes_[s + 1].entry : entry_.size();
        for (std::size_t k = node.entry; k < end; ++k)
            value_[node.panel + entry_[k].target] += matrix.valuePtr()[entry_[k].source];
        DenseFront::Block update = update_of(node);
        for (Eigen::Index j = 0; j < update.cols(); ++j) update.col(j).tail(update.rows() - j).setZero();
        for (std::size_t k = 0; k < node.children; ++k) add_update(nodes_[child_[node.child + k]]);
        const DenseFront::Block panel(value_.data() + node.panel, node.height, node.columns,
                                      Eigen::OuterStride<>(node.height));
        if (!front_.factor(panel, sign_.data() + node.first, update)) return false;
    }
    return true;
}

inline DenseFront::Block SparseFactor::update_of(const Supernode& node) {
    const Eigen::Index rest = node.height - node.columns;
    return {stack_[node.depth % 2].data() + node.update, rest, rest, Eigen::OuterStride<>(rest)};
}

// Adds the update of a supernode to its parent's front.
inline void SparseFactor::add_update(const Supernode& child) {
    const Supernode& parent = nodes_[static_cast<std::size_t>(child.parent)];
    const DenseFront::Block from = update_of(child);
    DenseFront::Block update = update_of(parent);
    const Eigen::Index rest = from.rows();
    const std::int32_t* place = place_in_parent_.data() + child.row + child.columns;
    for (Eigen::Index j = 0; j < rest; ++j) {
        if (place[j] < parent.columns) {
            double* target = value_.data() + parent.panel +
                             static_cast<std::size_t>(place[j]) * static_cast<std::size_t>(parent.height);
            for (Eigen::Index i = j; i < rest; ++i) target[place[i]] += from(i, j);
        } else {
            double* target = update.col(place[j] - parent.columns).data();
            for (Eigen::Index i = j; i < rest; ++i) target[place[i] - parent.columns] += from(i, j);
        }
    }
}

inline void SparseFactor::solve(Vector& v) const {
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
    work_.array() *= Eigen::Map<const Vector>(sign_.data(), size_).array();
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
        const Eigen::Index k = node->columns, rest = node->height - k;
        const ConstPanel panel(value_.data() + node->panel, node->height, k);
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

inline Vector SparseFactor::diagonal() const {
    Vector ordered(size_), result(size_);
    for (const Supernode& node : nodes_)
        ordered.segment(node.first, node.columns) =
            ConstPanel(value_.data() + node.panel, node.height, node.columns).diagonal().cwiseAbs();
    for (Eigen::Index i = 0; i < size_; ++i) result[i] = ordered[position_[static_cast<std::size_t>(i)]];
    return result;
}

// A row of D reaches the supernodes of its columns and all their ancestors.
inline SparseFactor::Reach SparseFactor::reach(const SparseRowsView& D) const {
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
template <class Visitor>
void SparseFactor::half_solve(const SparseRowsView& D, const Reach& reach, Visitor&& visit) const {
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
        panel.topRows(k).template triangularView<Eigen::Lower>().solveInPlace(own);
        if (rest > 0) {
            passed[s].noalias() -= panel.bottomRows(rest) * own;
            children[static_cast<std::size_t>(node.parent)].push_back(s);
        }
        visit(static_cast<Eigen::Index>(node.first), std::span<const std::int32_t>(rows), std::as_const(own));
    }
}

}  // namespace delassus::sdk
