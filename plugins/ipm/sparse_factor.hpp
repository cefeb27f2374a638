// SPDX-License-Identifier: BSD-3-Clause
// L S Lᵀ of a symmetric sparse matrix with pivots of known signs S = diag(±1), without pivoting, by dense fronts.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::ipm {

/// The multifrontal method (Duff and Reid 1983; Liu 1992): columns of L with nearly the same pattern form a supernode,
/// whose dense front takes the matrix's entries and the updates of its children in the elimination tree, is factored
/// as far as its own columns go, and leaves its Schur complement to its parent. Order: AMD, or nested
/// dissection where that takes fewer operations.
class SparseFactor {
public:
    /// lower: the lower triangle with all of the diagonal; only its pattern is read. The first `positive` pivots are
    /// positive, the others negative (a quasi-definite matrix).
    void analyze(const sdk::SparseColumns& lower, Eigen::Index positive);

    /// lower: as analysed, with values. False if a pivot has the wrong sign, or is not finite.
    [[nodiscard]] bool factorize(const sdk::SparseColumns& lower);

    /// v ← A⁻¹ v.
    void solve(sdk::Vector& v);

    /// Entries of L, known after analyze.
    [[nodiscard]] double entries() const { return entries_; }

private:
    void analyze(const sdk::SparseColumns& lower, Eigen::Index positive, std::vector<std::int32_t> position);

    struct Supernode {
        std::int32_t first = 0, columns = 0;  // of L
        std::int32_t height = 0;              // rows of the front: its columns, then those of the update
        std::int32_t parent = -1;             // supernode
        std::size_t row = 0;                  // into row_: height of them, ascending
        std::size_t panel = 0;                // into value_: height × columns
        std::size_t entry = 0;                // into entry_: up to that of the next supernode
        bool definite = true;                 // all pivots positive
    };
    struct Entry {
        std::int32_t source;  // into the values of the matrix
        std::size_t target;   // into the panel
    };

    void find_supernodes(const sdk::SparseColumns& permuted, const std::vector<std::int32_t>& parent);
    void find_places(const sdk::SparseColumns& lower);
    void add_update(std::size_t child);
    [[nodiscard]] bool eliminate(std::size_t node);

    Eigen::Index size_ = 0;
    double entries_ = 0.0, flops_ = 0.0;  // flops_: about, up to a factor
    std::vector<std::int32_t> position_;  // of each row of the matrix, in L
    std::vector<double> sign_;            // of each pivot, in the order of L
    std::vector<Supernode> nodes_;        // children before parents
    std::vector<std::int32_t> row_;
    std::vector<std::int32_t>
        place_in_parent_;  // beside row_, for the rows of the update: their rows in the parent's front
    std::vector<Entry> entry_;
    std::vector<double> value_;
    std::vector<Eigen::MatrixXd> update_;  // one a supernode, while its parent waits for it; lower triangle
    sdk::Vector work_, gathered_;
};

}  // namespace delassus::ipm
