// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/SparseCholesky>
#include <memory>

#include "delassus/sdk/problem_view.hpp"

namespace delassus::ipm {

class SparseFactor {
public:
    void analyze(const sdk::SparseColumns& lower, Eigen::Index positive) {
        definite_ = positive == lower.rows();
        n_ = lower.rows();
        llt_ = std::make_unique<LLT>();
        ldlt_ = std::make_unique<LDLT>();
        if (n_ == 0) return;
        if (definite_)
            llt_->analyzePattern(lower);
        else
            ldlt_->analyzePattern(lower);
    }
    bool factorize(const sdk::SparseColumns& lower) {
        if (n_ == 0) return true;
        if (definite_) {
            llt_->factorize(lower);
            return llt_->info() == Eigen::Success;
        }
        ldlt_->factorize(lower);
        return ldlt_->info() == Eigen::Success;
    }
    void solve(sdk::Vector& v) {
        if (n_ == 0) return;
        if (definite_)
            v = llt_->solve(v).eval();
        else
            v = ldlt_->solve(v).eval();
    }
    double entries() const { return 0; }

private:
    using LLT = Eigen::SimplicialLLT<sdk::SparseColumns, Eigen::Lower, Eigen::AMDOrdering<std::int32_t>>;
    using LDLT = Eigen::SimplicialLDLT<sdk::SparseColumns, Eigen::Lower, Eigen::AMDOrdering<std::int32_t>>;
    bool definite_ = true;
    Eigen::Index n_ = 0;
    std::unique_ptr<LLT> llt_;
    std::unique_ptr<LDLT> ldlt_;
};

}  // namespace delassus::ipm
