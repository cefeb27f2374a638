// SPDX-License-Identifier: BSD-3-Clause
// A square matrix with a fixed pattern and changing values, factored: dense where it is small, else by sparse fronts.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <vector>

#include "delassus/sdk/problem_view.hpp"
#include "delassus/sdk/sparse_factor.hpp"

namespace delassus::ssn {

using sdk::SparseColumns;
using sdk::Vector;

/// Symmetric positive definite by Cholesky, unsymmetric of symmetric pattern by LU. One symbolic analysis serves all
/// values. The sparse LU exchanges no pivots: callers refine its solutions.
class Factor {
public:
    /// Forgets everything; the pattern may be another.
    void reset() { lower_.resize(0, 0); }

    /// A: square, both triangles stored, of one pattern since reset(). False if A is singular to working precision, or
    /// not definite.
    [[nodiscard]] bool factorize(const SparseColumns& A, bool symmetric);

    /// v ← A⁻¹ v.
    void solve(Vector& v) const;

    [[nodiscard]] std::int64_t analyses() const { return analyses_; }

    /// Up to this size a dense factorisation is taken.
    static constexpr Eigen::Index largest_dense = 100;

private:
    void analyze(const SparseColumns& A);

    bool is_dense_ = true, symmetric_ = true;
    Eigen::MatrixXd dense_;
    Eigen::LLT<Eigen::MatrixXd> llt_;
    Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
    sdk::SparseFactor factor_;
    SparseColumns lower_;                         // the lower triangle of A
    std::vector<std::size_t> source_, mirrored_;  // where its values and those across the diagonal lie in A
    std::vector<double> upper_;                   // the latter
    std::int64_t analyses_ = 0;
};

}  // namespace delassus::ssn
