// SPDX-License-Identifier: BSD-3-Clause
// Nesterov's accelerated projected gradient method with backtracking, step growth and adaptive restart (README.md).
#pragma once

#include <cstdint>

#include "delassus/sdk/scaled_run.hpp"

namespace delassus::apgd {

class AcceleratedGradient : public sdk::Solver {
public:
    explicit AcceleratedGradient(const sdk::OptionValues& options);
    void analyze(const sdk::ProblemView& problem) override { scaled_.analyze(problem); }
    void factorize(const sdk::ProblemView& problem) override { scaled_.factorize(problem, team()); }
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override;
    [[nodiscard]] std::int64_t analyses() const override { return scaled_.unscaled().inverse().analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return scaled_.unscaled().inverse().factorizations(); }

private:
    void iterate(sdk::ScaledRun& run, const sdk::Team& team);
    bool gradient_step(sdk::ScaledRun& run, const sdk::Team& team, double momentum);

    sdk::ScaledProblem scaled_;
    double growth_, shrinkage_;
    bool restart_;
    std::int64_t stall_iterations_;

    double step_ = 1.0;                    // t
    sdk::Vector lambda_, velocity_;        // λ̂ of the latest iterate and its û
    sdk::Vector point_, point_velocity_;   // y, where the gradient is taken, and its û
    sdk::Vector next_, next_velocity_;     // the iterate that follows
    sdk::Vector change_, product_;         // d = next − y and N̂ d
    double natural_ = 0.0, uphill_ = 0.0;  // of next: its natural error, and dᵀ(next − λ̂)
};

}  // namespace delassus::apgd
