// SPDX-License-Identifier: BSD-3-Clause
// A square matrix with a fixed pattern and changing values, factored: dense where it is small, else by SuiteSparse.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <memory>

#include "cholesky.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::ssn {

using sdk::SparseColumns;
using sdk::Vector;

/// Symmetric positive definite by Cholesky (Eigen's LLᵀ, or CHOLMOD), unsymmetric by LU (Eigen's, or UMFPACK). One
/// symbolic analysis serves all values. Quiet. Not copyable.
class Factor {
public:
    Factor() = default;
    ~Factor();
    Factor(const Factor&) = delete;
    Factor& operator=(const Factor&) = delete;

    /// Forgets everything; the pattern may be another.
    void reset();

    /// A: square, both triangles stored, of one pattern since reset(); it must stay until the last solve.
    /// False if A is singular to working precision, or not definite. Throws sdk::NumericalFailure if memory runs out.
    [[nodiscard]] bool factorize(const SparseColumns& A, bool symmetric);

    /// v ← A⁻¹ v.
    void solve(Vector& v);

    [[nodiscard]] std::int64_t analyses() const { return analyses_; }

    /// Up to this size a dense factorisation is taken.
    static constexpr Eigen::Index largest_dense = 100;

private:
    bool factorize_unsymmetric();
    void free_numeric();

    const SparseColumns* A_ = nullptr;
    bool symmetric_ = true;
    Eigen::MatrixXd dense_;
    Eigen::LLT<Eigen::MatrixXd> llt_;
    Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
    std::unique_ptr<delassus_cholmod::Cholesky> cholesky_;
    void* symbolic_ = nullptr;  // UMFPACK's
    void* numeric_ = nullptr;
    double flops_ = 0.0;  // of UMFPACK's factorisation, an upper bound
    Vector work_;
    std::int64_t analyses_ = 0;
};

}  // namespace delassus::ssn
