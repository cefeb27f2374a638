// SPDX-License-Identifier: BSD-3-Clause
// The method of plugins/apgd on the processes of a partitioned problem (README.md).
#pragma once

#include <cstdint>
#include <string>

#include "delassus/sdk/monitor.hpp"
#include "scaled_part.hpp"

namespace delassus::petsc {

class PartitionedGradient : public sdk::PartitionedSolver {
public:
    explicit PartitionedGradient(const sdk::OptionValues& options);
    ~PartitionedGradient() override;
    PartitionedGradient(const PartitionedGradient&) = delete;
    PartitionedGradient& operator=(const PartitionedGradient&) = delete;

    using sdk::PartitionedSolver::analyze, sdk::PartitionedSolver::factorize, sdk::PartitionedSolver::solve;
    void analyze(const sdk::LocalProblemView& problem) override;
    void factorize(const sdk::LocalProblemView& problem) override;
    sdk::Outcome solve(const sdk::LocalProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t factorizations() const override { return factorizations_; }

private:
    struct Run;
    void iterate(Run& run);
    bool gradient_step(Run& run, double momentum);

    ScaledPart scaled_;
    double growth_, shrinkage_;
    bool restart_;
    std::int64_t stall_iterations_, factorizations_ = 0;

    double step_ = 1.0;                    // t
    sdk::Vector lambda_, velocity_;        // λ̂ of the latest iterate and its û
    sdk::Vector point_, point_velocity_;   // y, where the gradient is taken, and its û
    sdk::Vector next_, next_velocity_;     // the iterate that follows
    sdk::Vector change_, product_;         // d = next − y and N̂ d
    double natural_ = 0.0, uphill_ = 0.0;  // of next: its natural error, and dᵀ(next − λ̂)
};

}  // namespace delassus::petsc
