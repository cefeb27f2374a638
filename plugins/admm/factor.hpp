// SPDX-License-Identifier: BSD-3-Clause
// A definite matrix of one pattern and changing values, factored.
#pragma once

#include <Eigen/Cholesky>
#include <memory>

#include "cholesky.hpp"

namespace delassus::admm {

/// Dense where it is small: in the steps of mechanisms most of CHOLMOD's time is not arithmetic. Else by CHOLMOD.
class Factor {
public:
    /// A: square, both triangles or the lower one; values are not read. Throws sdk::NumericalFailure if CHOLMOD cannot.
    void analyze(const sdk::SparseColumns& A) {
        constexpr Eigen::Index largest = 64;
        sparse_.reset();
        rows_ = static_cast<double>(A.rows());
        if (A.rows() <= largest) return;
        sparse_ = std::make_unique<delassus_cholmod::Cholesky>(delassus_cholmod::Cholesky::Kind::Definite,
                                                               delassus_cholmod::Ordering::Automatic,
                                                               delassus_cholmod::Method::Automatic);
        sparse_->analyze(A);
    }
    /// A as analysed. False if it is not definite.
    [[nodiscard]] bool factorize(const sdk::SparseColumns& A) {
        if (sparse_) return sparse_->factorize(A);
        matrix_ = A;
        dense_.compute(matrix_);
        return dense_.info() == Eigen::Success;
    }
    /// v ← A⁻¹ v.
    void solve(sdk::Vector& v) const {
        if (sparse_) return sparse_->solve(v);
        dense_.solveInPlace(v);
    }
    /// Of the factor of what was analysed.
    [[nodiscard]] double entries() const { return sparse_ ? sparse_->entries() : 0.5 * rows_ * (rows_ + 1.0); }

private:
    double rows_ = 0.0;
    Eigen::MatrixXd matrix_;
    Eigen::LLT<Eigen::MatrixXd> dense_;
    std::unique_ptr<delassus_cholmod::Cholesky> sparse_;
};

}  // namespace delassus::admm
