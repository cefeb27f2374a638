// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/rank.hpp"

#include <Eigen/SparseQR>
#include <algorithm>

#include "delassus/sdk/problem_view.hpp"
#include "problem/rank_module.hpp"
#include "support/module.hpp"
#include "support/pivoted_qr.hpp"

namespace delassus {

namespace {

constexpr double dense_work = 6e9;         // multiplications, some seconds; beyond, sparse
constexpr double dense_threshold = 1e-10;  // pivoting reveals the rank
constexpr double sparse_threshold = 1e-8;  // without it, the rounding of ill-conditioned columns must not count
constexpr const char* module = "delassus_sparse_rank";

sdk::SparseRowsView view_of(const SparseMatrix& matrix) {
    return {matrix.rows,          matrix.columns,     matrix.entries(), matrix.row_start.data(),
            matrix.column.data(), matrix.value.data()};
}

/// D and E side by side, transposed: one column for each row of the problem. D and E may have different units, so both
/// are scaled to the same overall size where both are present.
sdk::SparseColumns columns_of(const SparseMatrix& D, const SparseMatrix& E, std::int32_t m) {
    std::vector<Eigen::Triplet<double, std::int32_t>> entries;
    entries.reserve(D.value.size() + E.value.size());
    const auto add = [&](const SparseMatrix& matrix, std::int32_t first) {
        if (matrix.entries() == 0) return;
        const auto view = view_of(matrix);
        const double size = view.norm();
        if (!(size > 0.0)) return;
        for (std::int32_t i = 0; i < matrix.rows; ++i)
            for (sdk::SparseRowsView::InnerIterator entry(view, i); entry; ++entry)
                entries.emplace_back(first + static_cast<std::int32_t>(entry.col()), i, entry.value() / size);
    };
    add(D, 0);
    add(E, D.columns);
    sdk::SparseColumns columns(D.columns + (E.entries() > 0 ? E.columns : 0), m);
    columns.setFromTriplets(entries.begin(), entries.end());
    for (Eigen::Index j = 0; j < columns.cols(); ++j)
        if (const double length = columns.col(j).norm(); length > 0.0) columns.col(j) /= length;
    return columns;
}

std::int32_t dense_rank(const sdk::SparseColumns& columns) {
    return static_cast<std::int32_t>(PivotedQr(Eigen::MatrixXd(columns)).rank(dense_threshold));
}

std::optional<std::int32_t> sparse_rank(const sdk::SparseColumns& columns) {
    if (has_module(module)) {
        const auto rank = reinterpret_cast<DelassusSparseRank>(
            module_symbol(module, "delassus_sparse_rank", "the rank cannot be found", "SuiteSparseQR"))(
            columns.rows(), columns.cols(), columns.outerIndexPtr(), columns.innerIndexPtr(), columns.valuePtr(),
            sparse_threshold);
        if (rank < 0) return std::nullopt;
        return static_cast<std::int32_t>(rank);
    }
    Eigen::SparseQR<sdk::SparseColumns, Eigen::COLAMDOrdering<std::int32_t>> factor;
    factor.setPivotThreshold(sparse_threshold);
    factor.compute(columns);
    return static_cast<std::int32_t>(factor.rank());
}

}  // namespace

std::optional<std::int32_t> estimate_rank(const Problem& problem) {
    const sdk::SparseColumns columns = columns_of(problem.D, problem.E, problem.m());
    if (columns.nonZeros() == 0) return 0;
    const auto [small, large] = std::minmax({static_cast<double>(columns.rows()), static_cast<double>(columns.cols())});
    return small * small * large <= dense_work ? dense_rank(columns) : sparse_rank(columns);
}

}  // namespace delassus
