// SPDX-License-Identifier: BSD-3-Clause
#include "iteration.hpp"

namespace delassus::apgd {

namespace {

class AcceleratedGradient : public sdk::Solver {
public:
    explicit AcceleratedGradient(const sdk::OptionValues& values) : iteration_(values) {}
    void analyze(const sdk::ProblemView& problem) override { scaled_.analyze(problem); }
    void factorize(const sdk::ProblemView& problem) override { scaled_.factorize(problem, team()); }
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override {
        if (!request.resume()) scaled_.load(problem);
        return iteration_.solve(problem, scaled_, request, sdk::ScaledProblem::useful(team(), problem), x, lambda);
    }
    [[nodiscard]] std::int64_t analyses() const override { return scaled_.unscaled().inverse().analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return scaled_.unscaled().inverse().factorizations(); }

private:
    sdk::ScaledProblem scaled_;
    Iteration<sdk::ScaledProblem> iteration_;
};

constexpr sdk::PluginInfo info{
    .name = "apgd",
    .version = "0.1.0",
    .description = "Nesterov's accelerated projected gradient with backtracking and adaptive restart",
    .licence = "BSD-3-Clause",
    .capabilities = sdk::all_cones | DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT |
                    DELASSUS_CAN_WARM_START,
    .flags = DELASSUS_FLAG_RESUMES,
};

}  // namespace

}  // namespace delassus::apgd

DELASSUS_SOLVER_PLUGIN(delassus::apgd::AcceleratedGradient, delassus::apgd::info, delassus::apgd::options)
