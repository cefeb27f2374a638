// SPDX-License-Identifier: BSD-3-Clause
// What Eigen computes of small dense matrices, those without rows or columns included: its own pivoted factorisations
// and its maxCoeff() read beyond the end of these.
#pragma once

#include <Eigen/QR>
#include <cstddef>
#include <numeric>
#include <vector>

namespace delassus {

/// The largest |entry|; 0 of none.
template <class Derived>
double largest_entry(const Eigen::MatrixBase<Derived>& A) {
    return A.size() > 0 ? A.cwiseAbs().maxCoeff() : 0.0;
}

/// A P = Q R with pivots that do not grow.
class PivotedQr {
public:
    explicit PivotedQr(const Eigen::MatrixXd& A) : rows_(A.rows()), columns_(A.cols()) {
        if (A.size() > 0) factor_.compute(A);
    }

    /// Columns of A, the most independent first.
    [[nodiscard]] std::vector<std::size_t> order() const {
        std::vector<std::size_t> columns(static_cast<std::size_t>(columns_));
        std::iota(columns.begin(), columns.end(), 0);
        for (std::size_t i = 0; !empty() && i < columns.size(); ++i)
            columns[i] = static_cast<std::size_t>(factor_.colsPermutation().indices()[static_cast<Eigen::Index>(i)]);
        return columns;
    }
    /// |R_ii|
    [[nodiscard]] Eigen::VectorXd pivots() const {
        if (empty()) return {};
        return factor_.matrixQR().diagonal().cwiseAbs();
    }
    /// The number of pivots above this share of the first one.
    [[nodiscard]] Eigen::Index rank(double threshold) const {
        const Eigen::VectorXd sizes = pivots();
        return (sizes.array() > threshold * largest_entry(sizes)).count();
    }
    /// Square; its columns from the rank on are a basis of what is normal to all columns of A.
    [[nodiscard]] Eigen::MatrixXd Q() const { return Q(rows_); }
    /// The first columns of Q.
    [[nodiscard]] Eigen::MatrixXd Q(Eigen::Index columns) const {
        const auto identity = Eigen::MatrixXd::Identity(rows_, columns);
        if (empty()) return identity;
        return factor_.householderQ() * identity;
    }

private:
    [[nodiscard]] bool empty() const { return rows_ == 0 || columns_ == 0; }

    Eigen::Index rows_, columns_;
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor_;
};

/// The least x of all that make |A x − b| least; directions below this share of the largest pivot are left alone.
inline Eigen::VectorXd least_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold) {
    if (A.size() == 0) return Eigen::VectorXd::Zero(A.cols());
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factor;
    factor.setThreshold(threshold);
    factor.compute(A);
    return factor.solve(b);
}

}  // namespace delassus
