// SPDX-License-Identifier: BSD-3-Clause
// L S Lᵀ of a symmetric sparse matrix with pivots of known signs S = diag(±1), or L U of an unsymmetric one of
// symmetric pattern, without pivoting, by dense fronts.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "delassus/sdk/dense_front.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// The multifrontal method (Duff and Reid 1983; Liu 1992): columns of L with nearly the same pattern form a supernode,
/// whose dense front takes the matrix's entries and the updates of its children in the elimination tree, is factored
/// as far as its own columns go, and leaves its Schur complement to its parent. Order: AMD, or nested
/// dissection by METIS where it is installed and takes fewer operations. Fronts are factored by Eigen, or by the
/// system's BLAS where the analysis foresees so much work that loading it pays.
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

    /// L U of an unsymmetric matrix, about twice the work. lower: as analysed, its lower triangle; upper: beside each
    /// of lower's values A_ij the value A_ji. Pivots are not exchanged: one that is tiny beside its neighbours is
    /// replaced (replaced_pivots), which refinement by the caller makes up for. False if entries are not finite, or a
    /// row and column vanish. half_solve and diagonal are for the symmetric factor only.
    [[nodiscard]] bool factorize(const Eigen::Ref<const SparseColumns>& lower, std::span<const double> upper);

    /// In the last unsymmetric factorisation.
    [[nodiscard]] std::int64_t replaced_pivots() const { return replaced_pivots_; }

    /// v ← A⁻¹ v.
    void solve(Vector& v) const;

    /// The absolute values of L's diagonal, in the order of the matrix's rows.
    [[nodiscard]] Vector diagonal() const;

    /// Entries of L, known after analyze.
    [[nodiscard]] double entries() const { return entries_; }

    /// What works on dense fronts, known after analyze.
    [[nodiscard]] bool uses_blas() const { return front_.blas() != nullptr; }
    [[nodiscard]] std::string kernels() const { return front_.blas() ? front_.blas()->description() : "Eigen"; }

    /// Where the half-solved rows D L⁻ᵀ have entries; the pattern of D (any rows, as many columns as the matrix).
    [[nodiscard]] Reach reach(const SparseRowsView& D) const;

    /// Z = L⁻¹ P Dᵀ in dense panels, of a matrix whose pivots are all positive: visit(first, rows, panel) for each
    /// supernode that a row of D reaches, where panel(i, k) is the entry first + i of Z's column rows[k].
    using Visitor =
        std::function<void(Eigen::Index first, std::span<const std::int32_t> rows, const Eigen::MatrixXd& panel)>;
    void half_solve(const SparseRowsView& D, const Reach& reach, const Visitor& visit) const;

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
        std::size_t update = 0;  // into stack_[depth % 2]: (height − columns)²; symmetric: lower triangle
    };
    struct Entry {
        std::int32_t source;  // into the values of the matrix
        std::int32_t row;     // of L
        std::size_t target;   // into the panel
        bool mirrored;        // above the diagonal in the order of L
    };

    /// Rows by columns, or columns by rows, without values.
    struct Pattern {
        std::vector<std::int32_t> start, index;
    };

    void find_supernodes(const Pattern& columns);
    void find_stacks();
    void find_places(const Eigen::Ref<const SparseColumns>& matrix);
    [[nodiscard]] DenseFront::Block update_of(const Supernode& node);
    void add_update(const Supernode& child);
    void add_upper_update(const Supernode& child);
    void gather_entries(std::size_t supernode, const double* lower, const double* upper,
                        std::vector<double>& panels) const;

    static std::vector<std::int32_t> minimum_degree(const Eigen::Ref<const SparseColumns>& matrix);
    static std::vector<std::int32_t> elimination_tree(const Pattern& rows);
    static std::vector<std::int32_t> postorder(const std::vector<std::int32_t>& parent);
    static Pattern permute(const Eigen::Ref<const SparseColumns>& matrix, const std::vector<std::int32_t>& position,
                           bool by_rows);

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
    std::vector<std::int32_t> run_end_;  // beside place_in_parent_: up to there the places follow one another
    std::vector<Entry> entry_;
    std::vector<double> value_;
    std::vector<double> upper_;  // Uᵀ beside value_ = L; empty: Uᵀ = L S
    std::int64_t replaced_pivots_ = 0;
    std::vector<std::size_t> child_;  // supernodes
    // Updates that wait for their parents, by the parity of the depth: the children of a supernode lie on top of one
    // stack when it puts its own update on the other.
    std::array<std::vector<double>, 2> stack_;
    std::array<std::size_t, 2> stack_size_{};
    Kernels kernels_;
    DenseFront front_;
    mutable Vector work_, gathered_;
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/sparse_factor_bodies.hpp"
#endif
