// SPDX-License-Identifier: BSD-3-Clause
#include "cholesky.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "delassus/sdk/blas_threads.hpp"
#include "delassus/sdk/h_inverse.hpp"

namespace delassus_cholmod {

using delassus::sdk::NumericalFailure;

namespace {

[[noreturn]] void fail(const char* what, const cholmod_common& common) {
    if (common.status == CHOLMOD_OUT_OF_MEMORY) throw NumericalFailure(std::string(what) + ": out of memory");
    if (common.status == CHOLMOD_TOO_LARGE)
        throw NumericalFailure(std::string(what) + ": the factor has more entries than 32-bit indices can count");
    throw NumericalFailure(std::string(what) + ": CHOLMOD failed with status " + std::to_string(common.status));
}

}  // namespace

Cholesky::Cholesky(Kind kind, Ordering ordering, Method method) : kind_(kind) {
    cholmod_start(&common_);
    common_.print = 0;
    common_.error_handler = nullptr;
    common_.quick_return_if_not_posdef = 1;
    common_.final_ll = kind == Kind::Definite ? 1 : 0;
    common_.supernodal = kind == Kind::QuasiDefinite || method == Method::Simplicial ? CHOLMOD_SIMPLICIAL
                         : method == Method::Supernodal                              ? CHOLMOD_SUPERNODAL
                                                                                     : CHOLMOD_AUTO;
    switch (ordering) {
        case Ordering::Automatic:  // AMD, and METIS too where AMD leaves much fill
            break;
        case Ordering::Amd:
            common_.nmethods = 1;
            common_.method[0].ordering = CHOLMOD_AMD;
            break;
        case Ordering::Metis:
            common_.nmethods = 1;
            common_.method[0].ordering = CHOLMOD_METIS;
            break;
        case Ordering::Best:
            common_.nmethods = 3;
            common_.method[0].ordering = CHOLMOD_AMD;
            common_.method[1].ordering = CHOLMOD_METIS;
            common_.method[2].ordering = CHOLMOD_NESDIS;
            break;
    }
}

Cholesky::~Cholesky() {
    cholmod_free_factor(&factor_, &common_);
    cholmod_free_dense(&solution_, &common_);
    cholmod_free_dense(&work_y_, &common_);
    cholmod_free_dense(&work_e_, &common_);
    cholmod_finish(&common_);
}

cholmod_sparse Cholesky::view(const SparseColumns& A) const {
    cholmod_sparse sparse{};
    sparse.nrow = static_cast<std::size_t>(A.rows());
    sparse.ncol = static_cast<std::size_t>(A.cols());
    sparse.nzmax = static_cast<std::size_t>(A.nonZeros());
    sparse.p = const_cast<std::int32_t*>(A.outerIndexPtr());
    sparse.i = const_cast<std::int32_t*>(A.innerIndexPtr());
    sparse.x = const_cast<double*>(A.valuePtr());
    sparse.stype = -1;  // the lower triangle counts
    sparse.itype = CHOLMOD_INT;
    sparse.xtype = CHOLMOD_REAL;
    sparse.dtype = CHOLMOD_DOUBLE;
    sparse.sorted = 1;
    sparse.packed = 1;
    return sparse;
}

void Cholesky::analyze(const SparseColumns& A) {
    cholmod_free_factor(&factor_, &common_);
    if (A.rows() == 0) return;  // CHOLMOD refuses empty matrices
    cholmod_sparse sparse = view(A);
    factor_ = cholmod_analyze(&sparse, &common_);
    if (!factor_) fail("symbolic analysis", common_);
    flops_ = common_.fl;
    entries_ = common_.lnz;
}

bool Cholesky::factorize(const SparseColumns& A, double shift) {
    if (A.rows() == 0) return true;
    cholmod_sparse sparse = view(A);
    double beta[2] = {shift, 0.0};
    const delassus::sdk::BlasThreads threads(flops_);
    cholmod_factorize_p(&sparse, beta, nullptr, 0, factor_, &common_);
    if (common_.status < CHOLMOD_OK) fail("numerical factorisation", common_);
    if (common_.status == CHOLMOD_NOT_POSDEF || factor_->minor < factor_->n) return false;
    const double reciprocal = reciprocal_condition();
    return reciprocal > 0.0 && std::isfinite(reciprocal);
}

void Cholesky::solve(Vector& v) const {
    if (v.size() == 0) return;
    cholmod_dense right{};
    right.nrow = right.nzmax = right.d = static_cast<std::size_t>(v.size());
    right.ncol = 1;
    right.x = v.data();
    right.xtype = CHOLMOD_REAL;
    right.dtype = CHOLMOD_DOUBLE;
    const delassus::sdk::BlasThreads threads(4.0 * entries_);
    if (!cholmod_solve2(CHOLMOD_A, factor_, &right, nullptr, &solution_, nullptr, &work_y_, &work_e_, &common_))
        fail("solve", common_);
    std::copy_n(static_cast<const double*>(solution_->x), v.size(), v.data());
}

double Cholesky::reciprocal_condition() const {
    return !factor_ ? 1.0 : cholmod_rcond(factor_, &common_);
}

void Cholesky::half_solve(const SparseRows& D, const Visitor& visit) const {
    if (!factor_) return;
    // The elimination tree and the columns of L are at hand in the simplicial form only.
    const auto release = [this](cholmod_factor* factor) { cholmod_free_factor(&factor, &common_); };
    std::unique_ptr<cholmod_factor, decltype(release)> simplicial(nullptr, release);
    const cholmod_factor* L = factor_;
    if (factor_->is_super) {
        simplicial.reset(cholmod_copy_factor(factor_, &common_));
        if (!simplicial || !cholmod_change_factor(CHOLMOD_REAL, 1, 0, 1, 1, simplicial.get(), &common_))
            fail("copy of the factor of H", common_);
        L = simplicial.get();
    }
    const auto* start = static_cast<const std::int32_t*>(L->p);
    const auto* count = static_cast<const std::int32_t*>(L->nz);
    const auto* row_index = static_cast<const std::int32_t*>(L->i);
    const auto* value = static_cast<const double*>(L->x);
    const auto* permutation = static_cast<const std::int32_t*>(L->Perm);
    std::vector<std::int32_t> position(L->n);
    for (std::size_t k = 0; k < L->n; ++k)
        position[static_cast<std::size_t>(permutation[k])] = static_cast<std::int32_t>(k);

    Vector work = Vector::Zero(static_cast<Eigen::Index>(L->n));
    std::vector<Eigen::Index> mark(L->n, -1);
    std::vector<std::int32_t> reach;
    for (Eigen::Index row = 0; row < D.rows(); ++row) {
        reach.clear();
        for (SparseRows::InnerIterator entry(D, row); entry; ++entry) {
            std::int32_t j = position[static_cast<std::size_t>(entry.col())];
            work[j] += entry.value();
            while (j >= 0 && mark[static_cast<std::size_t>(j)] != row) {
                mark[static_cast<std::size_t>(j)] = row;
                reach.push_back(j);
                // A column's first entry is its pivot, the second its parent in the tree.
                j = count[j] > 1 ? row_index[start[j] + 1] : -1;
            }
        }
        std::sort(reach.begin(), reach.end());
        for (const auto j : reach) {
            const double solved = work[j] / value[start[j]];
            work[j] = solved;
            for (std::int32_t k = start[j] + 1; k < start[j] + count[j]; ++k) work[row_index[k]] -= value[k] * solved;
        }
        visit(row, reach, work);
        for (const auto j : reach) work[j] = 0.0;
    }
}

}  // namespace delassus_cholmod
