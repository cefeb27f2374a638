// SPDX-License-Identifier: BSD-3-Clause
#include "factor.hpp"

#include <cmath>

namespace delassus::ssn {

bool Factor::factorize(const SparseColumns& A, bool symmetric) {
    is_dense_ = A.rows() <= largest_dense;
    symmetric_ = symmetric;
    if (is_dense_) {
        dense_ = A;
        if (symmetric) {
            llt_.compute(dense_);
            return llt_.info() == Eigen::Success;
        }
        lu_.compute(dense_);
        const double smallest = A.rows() > 0 ? lu_.matrixLU().diagonal().cwiseAbs().minCoeff() : 1.0;
        return smallest > 0.0 && std::isfinite(smallest);
    }
    if (lower_.rows() != A.rows()) analyze(A);
    for (std::size_t k = 0; k < source_.size(); ++k) lower_.valuePtr()[k] = A.valuePtr()[source_[k]];
    if (symmetric) return factor_.factorize(lower_);
    upper_.resize(mirrored_.size());
    for (std::size_t k = 0; k < mirrored_.size(); ++k) upper_[k] = A.valuePtr()[mirrored_[k]];
    return factor_.factorize(lower_, upper_);
}

void Factor::analyze(const SparseColumns& A) {
    lower_ = A.triangularView<Eigen::Lower>();
    source_.clear();
    mirrored_.clear();
    // Entries (i, j) above the diagonal come by ascending j for each i: next[i] finds them in turn.
    std::vector<std::int32_t> next(A.outerIndexPtr(), A.outerIndexPtr() + A.cols());
    for (Eigen::Index j = 0; j < A.cols(); ++j)
        for (auto k = A.outerIndexPtr()[j]; k < A.outerIndexPtr()[j + 1]; ++k) {
            const auto i = A.innerIndexPtr()[k];
            if (i < j) continue;
            source_.push_back(static_cast<std::size_t>(k));
            mirrored_.push_back(static_cast<std::size_t>(next[static_cast<std::size_t>(i)]++));
        }
    if (factor_.analyze(lower_, A.cols())) ++analyses_;
}

void Factor::solve(Vector& v) const {
    if (!is_dense_) return factor_.solve(v);
    if (symmetric_) {
        llt_.solveInPlace(v);
    } else {
        v = lu_.solve(v).eval();
    }
}

}  // namespace delassus::ssn
