// SPDX-License-Identifier: BSD-3-Clause
// The splitting of plugins/admm, for both friction laws, on the processes of a partitioned problem (README.md).
#pragma once

#include <memory>

#include "anderson_part.hpp"
#include "contact_law.hpp"
#include "delassus/sdk/monitor.hpp"
#include "penalty_rule.hpp"
#include "resolvent.hpp"

namespace delassus::petsc {

class PartitionedAdmm : public sdk::PartitionedSolver {
public:
    explicit PartitionedAdmm(const sdk::OptionValues& options);
    ~PartitionedAdmm() override;
    PartitionedAdmm(const PartitionedAdmm&) = delete;
    PartitionedAdmm& operator=(const PartitionedAdmm&) = delete;

    using sdk::PartitionedSolver::analyze, sdk::PartitionedSolver::factorize, sdk::PartitionedSolver::solve;
    [[nodiscard]] std::string refusal(const sdk::ProblemView& problem) override {
        return refusal_of_compliance(problem);
    }
    void analyze(const sdk::LocalProblemView& problem) override;
    void factorize(const sdk::LocalProblemView& problem) override;
    sdk::Outcome solve(const sdk::LocalProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override { return resolvent_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return resolvent_.factorizations(); }

private:
    struct Run;
    void find_scale(const sdk::LocalProblemView& problem);
    void iterate(Run& run);
    void project(const sdk::Vector& y, sdk::Vector& lambda);
    bool judge(Run& run);
    bool change_penalty(const Run& run);

    double initial_penalty_, over_relaxation_;
    bool adaptive_, anderson_wanted_;
    int memory_;
    std::int64_t stall_iterations_;

    PartSystem system_;
    Resolvent resolvent_;
    admm::ContactLaw law_;
    admm::PenaltyRule penalty_rule_;
    AndersonPart anderson_;
    sdk::Vector scale_;                       // the diagonal of P
    sdk::Vector y_, lambda_, z_, w_;          // the state and its λ̂; ẑ; 2λ̂ − ŷ
    sdk::Vector mu_, u_;                      // the equations' μ̂ and û
    sdk::Vector step_, plain_;                // α(μ̂ − λ̂), and ŷ after it
    sdk::Vector reactions_, velocities_, x_;  // of μ̂, in the problem's units
};

}  // namespace delassus::petsc
