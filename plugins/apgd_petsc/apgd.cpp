// SPDX-License-Identifier: BSD-3-Clause
// The method of plugins/apgd on the processes of a partitioned problem (README.md).
#include <cstdio>

#include "iteration.hpp"
#include "scaled_part.hpp"

namespace delassus::petsc {

namespace {

class PartitionedGradient : public sdk::PartitionedSolver {
public:
    explicit PartitionedGradient(const sdk::OptionValues& values) : iteration_(values) { ensure_petsc(); }
    ~PartitionedGradient() override {
        const Session session;
        scaled_ = {};
    }
    PartitionedGradient(const PartitionedGradient&) = delete;
    PartitionedGradient& operator=(const PartitionedGradient&) = delete;

    using sdk::PartitionedSolver::analyze, sdk::PartitionedSolver::factorize, sdk::PartitionedSolver::solve;
    void analyze(const sdk::LocalProblemView& problem) override {
        const Session session;
        scaled_ = {};
        scaled_.analyze(Processes(*problem.raw), problem);
    }
    void factorize(const sdk::LocalProblemView& problem) override {
        const Session session;
        ++factorizations_;
        scaled_.factorize(problem);
    }
    sdk::Outcome solve(const sdk::LocalProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override {
        const Session session;
        CostMeter& meter = *scaled_.processes().meter();
        meter.begin(problem.raw->m_all, 4000);
        scaled_.load(problem);
        // A copy: its vectors end with it.
        sdk::Outcome outcome = apgd::Iteration(iteration_).solve(problem, scaled_, request, {}, x, lambda);
        outcome.cost = meter.end();
        if (const int processes = scaled_.processes().size(); processes > 1 && outcome.message.empty()) {
            char text[96];
            std::snprintf(text, sizeof text, "%d processes together send %.3g MB an iteration", processes,
                          1e-6 * static_cast<double>(scaled_.bytes_a_product()));
            outcome.message = text;
        }
        return outcome;
    }
    [[nodiscard]] std::int64_t factorizations() const override { return factorizations_; }

private:
    ScaledPart scaled_;
    const apgd::Iteration<ScaledPart> iteration_;
    std::int64_t factorizations_ = 0;
};

constexpr sdk::PluginInfo info{
    .name = "apgd_petsc",
    .version = "0.1.0",
    .description = "accelerated projected gradient for problems in parts, on PETSc under MPI",
    .licence = "BSD-3-Clause AND BSD-2-Clause AND CECILL-C AND GPL-2.0-or-later",
    .capabilities = sdk::all_cones | DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START |
                    DELASSUS_CAN_PARTITIONED,
    .flags = DELASSUS_FLAG_MPI,
};

}  // namespace

}  // namespace delassus::petsc

DELASSUS_SOLVER_PLUGIN(delassus::petsc::PartitionedGradient, delassus::petsc::info, delassus::apgd::options)
