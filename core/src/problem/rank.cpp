// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/rank.hpp"

#include <Eigen/QR>
#include <Eigen/SparseQR>
#include <algorithm>

#include "delassus/sdk/problem_view.hpp"

namespace delassus {

namespace {

constexpr std::int32_t largest_dense = 3000;
constexpr double threshold = 1e-10;

void normalise_rows(Eigen::MatrixXd& matrix) {
    for (Eigen::Index i = 0; i < matrix.rows(); ++i)
        if (const double length = matrix.row(i).norm(); length > 0.0) matrix.row(i) /= length;
}

sdk::SparseRowsView view_of(const SparseMatrix& matrix) {
    return {matrix.rows,          matrix.columns,     matrix.entries(), matrix.row_start.data(),
            matrix.column.data(), matrix.value.data()};
}

std::int32_t dense_rank(Eigen::MatrixXd matrix) {
    normalise_rows(matrix);
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor;
    factor.setThreshold(threshold);
    factor.compute(matrix.transpose());
    return static_cast<std::int32_t>(factor.rank());
}

std::int32_t sparse_rank(const SparseMatrix& D) {
    sdk::SparseColumns columns = sdk::SparseRows(view_of(D)).transpose();
    for (Eigen::Index j = 0; j < columns.cols(); ++j)
        if (const double length = columns.col(j).norm(); length > 0.0) columns.col(j) /= length;
    columns.makeCompressed();
    Eigen::SparseQR<sdk::SparseColumns, Eigen::COLAMDOrdering<std::int32_t>> factor;
    factor.setPivotThreshold(threshold);
    factor.compute(columns);
    return static_cast<std::int32_t>(factor.rank());
}

}  // namespace

std::optional<std::int32_t> estimate_rank(const Problem& problem) {
    const auto n = problem.n();
    const auto m = problem.m();
    if (m == 0) return 0;
    const bool compliant = problem.E.entries() > 0;
    if (!compliant && (n == 0 || problem.D.entries() == 0)) return 0;
    if (!compliant && (m > largest_dense || n > largest_dense)) return sparse_rank(problem.D);
    if (m > largest_dense || n > largest_dense) return std::nullopt;
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(m, n + (compliant ? m : 0));
    if (n > 0 && problem.D.rows > 0) matrix.leftCols(n) = view_of(problem.D);
    if (compliant) {
        matrix.rightCols(m) = view_of(problem.E);
        // D and E may have different units: each half gets the same overall size.
        if (const double size = matrix.leftCols(n).norm(); size > 0.0) matrix.leftCols(n) /= size;
        matrix.rightCols(m) /= matrix.rightCols(m).norm();
    }
    return dense_rank(std::move(matrix));
}

}  // namespace delassus
