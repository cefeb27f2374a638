// SPDX-License-Identifier: BSD-3-Clause
// The splitting of plugins/admm, for both friction laws, on the processes of a partitioned problem (README.md).
#include "iteration.hpp"
#include "scaled_part_system.hpp"

namespace delassus::petsc {

namespace {

class PartitionedAdmm : public sdk::PartitionedSolver {
public:
    explicit PartitionedAdmm(const sdk::OptionValues& options) : iteration_(options) { ensure_petsc(); }
    ~PartitionedAdmm() override {
        const Session session;
        system_ = {};
    }
    PartitionedAdmm(const PartitionedAdmm&) = delete;
    PartitionedAdmm& operator=(const PartitionedAdmm&) = delete;

    using sdk::PartitionedSolver::analyze, sdk::PartitionedSolver::factorize, sdk::PartitionedSolver::solve;
    [[nodiscard]] std::string refusal(const sdk::ProblemView& problem) override {
        return refusal_of_compliance(problem);
    }
    void analyze(const sdk::LocalProblemView& problem) override {
        const Session session;
        system_.analyze(problem);
    }
    void factorize(const sdk::LocalProblemView& problem) override {
        const Session session;
        system_.factorize(problem);
        system_.set_penalty(iteration_.initial_penalty());
    }
    sdk::Outcome solve(const sdk::LocalProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override {
        const Session session;
        CostMeter& meter = *system_.processes().meter();
        meter.begin(problem.raw->m_all, 300);
        system_.load(problem);
        sdk::Outcome outcome = iteration_.solve(system_, request, x, lambda);
        outcome.cost = meter.end();
        return outcome;
    }
    [[nodiscard]] std::int64_t analyses() const override { return system_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return system_.factorizations(); }

private:
    ScaledPartSystem system_;
    admm::Iteration<ScaledPartSystem> iteration_;
};

constexpr delassus_option options[] = {
    admm::rho_option,          admm::over_relaxation_option, admm::adaptive_option,
    admm::acceleration_option, admm::memory_option,          admm::stall_option,
};

constexpr sdk::PluginInfo info{
    .name = "admm_petsc",
    .version = "0.1.0",
    .description = "ADMM for problems in parts, for both friction laws, on factors by MUMPS through PETSc under MPI",
    .licence = "BSD-3-Clause AND BSD-2-Clause AND CECILL-C AND GPL-2.0-or-later",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                    DELASSUS_CAN_WARM_START | DELASSUS_CAN_PARTITIONED,
    .flags = DELASSUS_FLAG_MPI,
};

}  // namespace

}  // namespace delassus::petsc

DELASSUS_SOLVER_PLUGIN(delassus::petsc::PartitionedAdmm, delassus::petsc::info, delassus::petsc::options)
