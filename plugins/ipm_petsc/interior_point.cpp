// SPDX-License-Identifier: BSD-3-Clause
// The method of plugins/ipm (associated law) on the processes of a partitioned problem, with inexact steps (README.md).
#include "condensed_system.hpp"
#include "iteration.hpp"

namespace delassus::petsc {

namespace {

CondensedSettings settings_from(const sdk::OptionValues& options) {
    return {options.choice("preconditioner"),
            {options.integer("subdomain"), static_cast<int>(options.integer("overlap"))},
            options.real("regularization"),
            static_cast<int>(options.integer("refinements")),
            options.integer("inner_iterations"),
            options.integer("correctors")};
}

class PartitionedInteriorPoint : public sdk::PartitionedSolver, private ipm::Iteration<CondensedSystem> {
public:
    explicit PartitionedInteriorPoint(const sdk::OptionValues& options)
        : Iteration(options, CondensedSystem(settings_from(options))) {
        ensure_petsc();
    }
    ~PartitionedInteriorPoint() override {
        const Session session;
        system_ = CondensedSystem();
    }
    PartitionedInteriorPoint(const PartitionedInteriorPoint&) = delete;
    PartitionedInteriorPoint& operator=(const PartitionedInteriorPoint&) = delete;

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
    }
    sdk::Outcome solve(const sdk::LocalProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override {
        const Session session;
        CostMeter& meter = *system_.processes().meter();
        meter.begin(problem.raw->m_all, 0);
        sdk::Outcome outcome = Iteration::solve(problem, request, x, lambda);
        outcome.cost = meter.end();
        return outcome;
    }
    [[nodiscard]] std::int64_t analyses() const override { return system_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return system_.factorizations(); }
};

constexpr const char* preconditioners[] = {"auto", "mumps", "schwarz", "bjacobi", "hypre"};

constexpr delassus_option options[] = {
    sdk::choice_option(
        "preconditioner", "auto", preconditioners,
        "of H + D'TD: Cholesky factors by MUMPS, or conjugate gradients with the factors of overlapping domains "
        "(schwarz), incomplete Cholesky on each process, or hypre's BoomerAMG; auto: mumps up to 500 000 columns "
        "a process, then schwarz"),
    sdk::integer_option("subdomain", "3000", 1, 1e9, "columns", "of the domains of schwarz, before they overlap"),
    sdk::integer_option("overlap", "2", 0, 100, "layers", "of bodies by which the domains of schwarz grow"),
    sdk::integer_option("inner_iterations", "2000", 1, 1e9, "iterations", "of conjugate gradients in one linear solve"),
    sdk::integer_option("correctors", "3", 0, 100, "", "largest number of Gondzio's correctors of a step, with mumps"),
    ipm::step_fraction_option,
    ipm::regularization_option,
    ipm::refinements_option,
    sdk::integer_option("stall_iterations", "15", 0, 1e9, "iterations",
                        "give up after this many iterations without an improvement by 1 %; 0: never"),
};

constexpr sdk::PluginInfo info{
    .name = "ipm_petsc",
    .version = "0.1.0",
    .description = "interior point method for problems in parts, on PETSc's Krylov methods and factors under MPI",
    .licence = "BSD-3-Clause AND BSD-2-Clause AND CECILL-C AND GPL-2.0-or-later",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                    DELASSUS_CAN_WARM_START | DELASSUS_CAN_PARTITIONED,
    .flags = DELASSUS_FLAG_MPI,
};

}  // namespace

}  // namespace delassus::petsc

DELASSUS_SOLVER_PLUGIN(delassus::petsc::PartitionedInteriorPoint, delassus::petsc::info, delassus::petsc::options)
