// SPDX-License-Identifier: BSD-3-Clause
// A saddle-point matrix with one row and one column more, factorised (internal).
#pragma once

#include <memory>

#include "dynamics/linear_problem.hpp"

namespace delassus {

/// Solves  (K + σ M) x − Dᵀ λ − p μ = a,   D x = b,   w · x + w_μ μ = c.  The whole may be regular where K and D alone
/// are singular.
class BorderedFactor {
public:
    BorderedFactor();
    ~BorderedFactor();
    BorderedFactor(const BorderedFactor&) = delete;
    BorderedFactor& operator=(const BorderedFactor&) = delete;

    struct Solution {
        Vector x, lambda;
        double load = 0.0;  ///< μ
    };

    /// root (n) and row_scale (m): rows of K are divided by root, its columns too, rows of D multiplied by row_scale.
    /// K need not be symmetric. False if the matrix is singular.
    bool factorise(const SparseMatrix& K, const SparseMatrix& M, double shift, const SparseMatrix& D,
                   const Vector& root, const Vector& row_scale, const Vector& p, const Vector& w, double w_mu);

    /// After factorise().
    [[nodiscard]] Solution solve(const Vector& a, const Vector& b, double c) const;
    /// x of the matrix without its border, μ = 0.
    [[nodiscard]] Vector solve_inside(const Vector& a, const Vector& b) const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
