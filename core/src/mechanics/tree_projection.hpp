// SPDX-License-Identifier: BSD-3-Clause
// Rows and matrices of bodies in the coordinates of a tree.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "delassus/matrix_assembler.hpp"
#include "mechanics/kinematic_tree.hpp"
#include "mechanics/tree_derivatives.hpp"

namespace delassus::mechanics {

/// By the Jacobian J of the bodies' velocities along those of the tree, at the state of the tree's last place().
class TreeProjection {
public:
    /// tree and derivatives outlive it. n: velocities of the bodies, six of each.
    TreeProjection(const KinematicTree& tree, const TreeDerivatives& derivatives, std::int32_t n);

    /// The link of the body that has this column.
    [[nodiscard]] std::size_t link_at(std::int32_t column) const {
        return link_at_[static_cast<std::size_t>(column / 6)];
    }

    struct Entry {
        std::int32_t column;
        double value;
    };
    /// Those of a row g J, in ascending columns, from the entries of g, whose columns ascend; valid until the next
    /// call. A row that only what links do to each other enters ends where their ways to the ground meet.
    std::span<const Entry> row(std::span<const std::int32_t> column, std::span<const double> value);

    /// H += factor · Jᵀ A J, with the products that A keeps.
    void add_matrix(MatrixAssembler& A, double factor, MatrixAssembler& H);
    /// H += factor · Jᵀ A ∂(J u)/∂q; after TreeDerivatives::set_motion().
    void add_matrix_along_velocities(const SparseMatrix& A, double factor, MatrixAssembler& H);

private:
    using Columns = std::vector<std::pair<std::int32_t, Vector6>>;

    struct Loaded {
        std::size_t link;
        Spatial wrench;
    };
    /// The forces on a link and on what it carries, by columns of J.
    struct Carried {
        std::vector<std::pair<std::int32_t, Spatial>> columns;
        std::vector<std::int32_t> place;  // in `columns`, by column; -1: none

        void clear();
        void add(std::int32_t column, const Spatial& more);
    };

    void add_matrix(const SparseMatrix& A, double factor, bool along_velocities, MatrixAssembler& H);
    /// blocks_ ← those of the six rows of a body, by the bodies of their columns.
    void find_blocks(const SparseMatrix& A, std::int32_t row);
    /// way_ ← the columns of J of a link's body, (v in the world, ω in the frame of the body), on its way to the
    /// ground.
    void find_way(std::size_t link);

    const KinematicTree& tree_;
    const TreeDerivatives& derivatives_;
    std::vector<std::size_t> link_at_;  // by the body's column / 6
    // Work space of the call that runs:
    std::vector<Loaded> loaded_;
    std::vector<Entry> entries_;
    Columns way_;
    std::vector<std::pair<std::int32_t, Matrix6>> blocks_;
    std::vector<Carried> carried_;
};

}  // namespace delassus::mechanics
