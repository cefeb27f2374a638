// SPDX-License-Identifier: BSD-3-Clause
#include "factor.hpp"

#include <umfpack.h>

#include <array>
#include <cmath>

#include "delassus/sdk/blas_threads.hpp"
#include "delassus/sdk/h_inverse.hpp"

namespace delassus::ssn {

using delassus_cholmod::Cholesky;

Factor::~Factor() {
    reset();
}

void Factor::reset() {
    free_numeric();
    if (symbolic_) umfpack_di_free_symbolic(&symbolic_);
    cholesky_.reset();
}

void Factor::free_numeric() {
    if (numeric_) umfpack_di_free_numeric(&numeric_);
}

bool Factor::factorize(const SparseColumns& A, bool symmetric) {
    A_ = &A;
    symmetric_ = symmetric;
    if (A.rows() <= largest_dense) {
        dense_ = A;
        if (symmetric) {
            llt_.compute(dense_);
            return llt_.info() == Eigen::Success;
        }
        lu_.compute(dense_);
        const double smallest = A.rows() > 0 ? lu_.matrixLU().diagonal().cwiseAbs().minCoeff() : 1.0;
        return smallest > 0.0 && std::isfinite(smallest);
    }
    if (!symmetric) return factorize_unsymmetric();
    if (!cholesky_) {
        cholesky_ = std::make_unique<Cholesky>(Cholesky::Kind::Definite, delassus_cholmod::Ordering::Automatic,
                                               delassus_cholmod::Method::Automatic);
        cholesky_->analyze(A);
        ++analyses_;
    }
    return cholesky_->factorize(A);
}

bool Factor::factorize_unsymmetric() {
    const auto size = static_cast<int>(A_->rows());
    std::array<double, UMFPACK_CONTROL> control;
    umfpack_di_defaults(control.data());
    control[UMFPACK_PRL] = 0;
    control[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;  // the pattern is
    const auto check = [](int status) {
        if (status == UMFPACK_ERROR_out_of_memory)
            throw sdk::NumericalFailure("the LU factorisation of the Newton matrix: out of memory");
        return status == UMFPACK_OK;
    };
    if (!symbolic_) {
        std::array<double, UMFPACK_INFO> info;
        if (!check(umfpack_di_symbolic(size, size, A_->outerIndexPtr(), A_->innerIndexPtr(), A_->valuePtr(), &symbolic_,
                                       control.data(), info.data())))
            return false;
        flops_ = info[UMFPACK_FLOPS_ESTIMATE];
        ++analyses_;
    }
    free_numeric();
    const sdk::BlasThreads threads(flops_);
    return check(umfpack_di_numeric(A_->outerIndexPtr(), A_->innerIndexPtr(), A_->valuePtr(), symbolic_, &numeric_,
                                    control.data(), nullptr));
}

void Factor::solve(Vector& v) {
    if (A_->rows() <= largest_dense) {
        if (symmetric_) {
            llt_.solveInPlace(v);
        } else {
            v = lu_.solve(v).eval();
        }
    } else if (symmetric_) {
        cholesky_->solve(v);
    } else {
        std::array<double, UMFPACK_CONTROL> control;
        umfpack_di_defaults(control.data());
        control[UMFPACK_IRSTEP] = 0;  // the caller refines, with N itself
        work_.resize(v.size());
        umfpack_di_solve(UMFPACK_A, A_->outerIndexPtr(), A_->innerIndexPtr(), A_->valuePtr(), work_.data(), v.data(),
                         numeric_, control.data(), nullptr);
        v = work_;
    }
}

}  // namespace delassus::ssn
