// SPDX-License-Identifier: BSD-3-Clause
// The problem that the host shows to a plugin, as Eigen maps. Nothing is copied; a view is valid as long as the
// delassus_problem behind it, that is, during one call.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>

#include "delassus/plugin.h"
#include "delassus/sdk/cones.hpp"

namespace delassus::sdk {

using Vector = Eigen::VectorXd;
using VectorView = Eigen::Map<const Eigen::VectorXd>;
using MutableVectorView = Eigen::Map<Eigen::VectorXd>;
using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor, std::int32_t>;
using SparseColumns = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int32_t>;
using SparseRowsView = Eigen::Map<const SparseRows>;

inline SparseRowsView view_of(const delassus_matrix& matrix) {
    return {matrix.rows, matrix.columns, matrix.entries, matrix.row_start, matrix.column, matrix.value};
}

/// H x − Dᵀλ = a, D x + E λ + b = u, λ ∈ Υ ⊥ u ∈ Υ*: see delassus/plugin.h for every field.
struct ProblemView {
    explicit ProblemView(const delassus_problem& problem)
        : n(problem.n),
          m(problem.m),
          H(view_of(problem.H)),
          D(view_of(problem.D)),
          E(view_of(problem.E)),
          a(problem.a, problem.n),
          b(problem.b, problem.m),
          cones(problem),
          h_block_start(problem.h_block_start, static_cast<std::size_t>(problem.h_block_count) + 1),
          h_block_index(problem.h_block_index, static_cast<std::size_t>(problem.n)),
          coulomb(problem.law == DELASSUS_LAW_COULOMB),
          needs(problem.needs),
          raw(&problem) {}

    [[nodiscard]] bool needs_any(std::uint64_t bits) const { return (needs & bits) != 0; }

    Eigen::Index n, m;
    SparseRowsView H;  ///< n × n, both triangles
    SparseRowsView D;  ///< m × n
    SparseRowsView E;  ///< m × m, both triangles; no entries if absent
    VectorView a;      ///< n
    VectorView b;      ///< m
    ConeRange cones;
    std::span<const std::int32_t> h_block_start, h_block_index;
    bool coulomb;         ///< exact Coulomb law; otherwise associated
    std::uint64_t needs;  ///< DELASSUS_CAN_* bits
    const delassus_problem* raw;
};

}  // namespace delassus::sdk
