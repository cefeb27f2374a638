// SPDX-License-Identifier: BSD-3-Clause
// A kept factorisation of a matrix that is not symmetric, or not definite (internal).
#pragma once

#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <cstdint>
#include <memory>

#include "delassus/sdk/problem_view.hpp"

namespace delassus {

/// x = H⁻¹ a by LU with partial pivoting: dense where H is small, else sparse.
class GeneralFactor {
public:
    /// x (n) ← H⁻¹ a of the problem. What was analysed is kept while pattern_id stays, the factors while values_id
    /// does. Throws InputError if H is singular.
    void solve(const sdk::ProblemView& problem, const delassus_problem& raw, std::vector<double>& x);

private:
    void factorize(const sdk::ProblemView& problem, const delassus_problem& raw);

    static constexpr Eigen::Index most_dense = 250;
    bool dense_ = false, made_ = false;
    std::uint64_t pattern_id_ = 0, values_id_ = 0;
    Eigen::MatrixXd matrix_;
    Eigen::PartialPivLU<Eigen::MatrixXd> dense_factor_;
    std::unique_ptr<Eigen::SparseLU<sdk::SparseColumns>> sparse_factor_;
};

}  // namespace delassus
