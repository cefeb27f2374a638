// SPDX-License-Identifier: BSD-3-Clause
// The method of plugins/ipm (associated law) on the processes of a partitioned problem, with inexact steps (README.md).
#pragma once

#include "condensed_system.hpp"
#include "delassus/sdk/monitor.hpp"

namespace delassus::petsc {

class PartitionedInteriorPoint : public sdk::PartitionedSolver {
public:
    explicit PartitionedInteriorPoint(const sdk::OptionValues& options);
    ~PartitionedInteriorPoint() override;
    PartitionedInteriorPoint(const PartitionedInteriorPoint&) = delete;
    PartitionedInteriorPoint& operator=(const PartitionedInteriorPoint&) = delete;

    using sdk::PartitionedSolver::analyze, sdk::PartitionedSolver::factorize, sdk::PartitionedSolver::solve;
    [[nodiscard]] std::string refusal(const sdk::ProblemView& problem) override;
    void analyze(const sdk::LocalProblemView& problem) override;
    void factorize(const sdk::LocalProblemView& problem) override;
    sdk::Outcome solve(const sdk::LocalProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override { return kkt_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return kkt_.factorizations(); }

private:
    void find_scales(const sdk::LocalProblemView& problem);
    void start_cold(const sdk::LocalProblemView& problem);
    void start_warm(double error);
    void find_residuals();
    bool judge(const sdk::LocalProblemView& problem, sdk::Monitor& monitor, std::int64_t iteration);
    void iterate(const sdk::LocalProblemView& problem, sdk::Monitor& monitor);
    bool step(const sdk::LocalProblemView& problem);
    using Start = CondensedSystem::Start;
    void find_direction(double enough, Start start);
    void correct(double tau, double enough);
    [[nodiscard]] bool is_stuck(double error);
    [[nodiscard]] double proven_size() const;
    // Of all processes:
    [[nodiscard]] double mean_product(double step) const;
    [[nodiscard]] double longest_step() const { return processes().min(cones_.longest_step()); }
    [[nodiscard]] const Processes& processes() const { return system_.processes(); }

    PartSystem system_;
    CondensedSystem kkt_;
    Complementarity cones_;
    double step_fraction_;
    std::int64_t correctors_, stall_iterations_;

    ipm::ScaledSystem scales_;                      // only z_scale: ρP
    double degree_ = 0.0;                           // number of products of all processes
    sdk::Vector p_, a_, b_;                         // P, a/ρ, P b/ρ
    sdk::Vector x_;                                 // x/ρ
    sdk::Vector f_, g_;                             // what is left of the two equations
    sdk::Vector theta_, target_, right_, dx_, dz_;  // of a step
    sdk::Vector kept_x_, kept_z_;                   // δx and δz before a corrector
    sdk::Vector true_x_, true_lambda_;              // in the problem's units
    double least_error_ = 0.0, least_rest_ = 0.0;
    std::int64_t idle_iterations_ = 0;
};

}  // namespace delassus::petsc
