// SPDX-License-Identifier: BSD-3-Clause
// Projected Gauss–Seidel on the processes of a partitioned problem (README.md).
#pragma once

#include <string>

#include "delassus/sdk/residual.hpp"
#include "iteration.hpp"
#include "split_part.hpp"

namespace delassus::petsc {

class PartitionedGaussSeidel : public sdk::PartitionedSolver {
public:
    explicit PartitionedGaussSeidel(const sdk::OptionValues& options);
    ~PartitionedGaussSeidel() override;
    PartitionedGaussSeidel(const PartitionedGaussSeidel&) = delete;
    PartitionedGaussSeidel& operator=(const PartitionedGaussSeidel&) = delete;

    using sdk::PartitionedSolver::analyze, sdk::PartitionedSolver::factorize, sdk::PartitionedSolver::solve;
    [[nodiscard]] std::string refusal(const sdk::ProblemView& problem) override;
    void analyze(const sdk::LocalProblemView& problem) override;
    void factorize(const sdk::LocalProblemView& problem) override;
    sdk::Outcome solve(const sdk::LocalProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t factorizations() const override { return factorizations_; }

private:
    [[nodiscard]] double measured(const sdk::Vector& lambda);

    pgs::Ordering ordering_;
    pgs::Iteration iteration_;
    SplitPart part_;
    sdk::DelassusOperator operator_;  // of the split problem
    pgs::Model model_;                // of it
    sdk::Vector diagonal_;            // of N; blocks without mobility have the mean of the others
    sdk::NaturalResidual residual_;   // of own rows, but for its reference
    double reference_ = 1.0;          // ‖S r‖ of all rows
    sdk::Vector lambda_, u_;
    std::int64_t factorizations_ = 0;
};

}  // namespace delassus::petsc
