// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/general_factor.hpp"

#include "delassus/error.hpp"

namespace delassus {

void GeneralFactor::solve(const sdk::ProblemView& problem, const delassus_problem& raw, std::vector<double>& x) {
    if (!made_ || values_id_ != raw.values_id) factorize(problem, raw);
    x.resize(static_cast<std::size_t>(problem.n));
    Eigen::Map<Eigen::VectorXd> result(x.data(), problem.n);
    if (dense_)
        result = dense_factor_.solve(problem.a);
    else
        result = sparse_factor_->solve(problem.a);
}

void GeneralFactor::factorize(const sdk::ProblemView& problem, const delassus_problem& raw) {
    const bool same_pattern = made_ && pattern_id_ == raw.pattern_id;
    made_ = false;
    bool regular = true;
    dense_ = problem.n <= most_dense;
    if (dense_) {
        matrix_.setZero(problem.n, problem.n);
        for (Eigen::Index i = 0; i < problem.n; ++i)
            for (sdk::SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
                matrix_(i, entry.col()) = entry.value();
        dense_factor_.compute(matrix_);
        const auto pivots = dense_factor_.matrixLU().diagonal().cwiseAbs();
        regular = problem.n == 0 || pivots.minCoeff() > 0.0;  // false for a pivot that is not a number
    } else {
        if (!same_pattern || !sparse_factor_) {
            sparse_factor_ = std::make_unique<Eigen::SparseLU<sdk::SparseColumns>>();
            sparse_factor_->analyzePattern(sdk::SparseColumns(problem.H));
        }
        sparse_factor_->factorize(sdk::SparseColumns(problem.H));
        regular = sparse_factor_->info() == Eigen::Success;
    }
    if (!regular) throw InputError("H is singular, and no constraint holds what it leaves free");
    pattern_id_ = raw.pattern_id;
    values_id_ = raw.values_id;
    made_ = true;
}

}  // namespace delassus
