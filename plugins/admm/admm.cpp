// SPDX-License-Identifier: BSD-3-Clause
#include "iteration.hpp"
#include "scaled_system.hpp"

namespace delassus::admm {

namespace {

class Admm : public sdk::Solver {
public:
    explicit Admm(const sdk::OptionValues& options)
        : system_(options.choice("form") == "primal" ? Resolvent::Form::Primal
                  : options.choice("form") == "dual" ? Resolvent::Form::Dual
                                                     : Resolvent::Form::Automatic),
          iteration_(options) {}
    void analyze(const sdk::ProblemView& problem) override { system_.analyze(problem); }
    void factorize(const sdk::ProblemView& problem) override {
        system_.factorize(problem);
        system_.set_penalty(iteration_.initial_penalty());
    }
    sdk::Outcome solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override {
        if (!request.resume()) system_.load(problem);
        return iteration_.solve(system_, request, x, lambda);
    }
    [[nodiscard]] std::int64_t analyses() const override { return system_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const override { return system_.factorizations(); }

private:
    ScaledSystem system_;
    Iteration<ScaledSystem> iteration_;
};

constexpr const char* forms[] = {"auto", "primal", "dual"};

constexpr delassus_option options[] = {
    rho_option,
    over_relaxation_option,
    adaptive_option,
    acceleration_option,
    memory_option,
    sdk::choice_option("form", "auto", forms,
                       "what is factored: H + rho D'D or N + 1/rho; auto: the latter for n = 0 and for few rows"),
    stall_option,
};

constexpr sdk::PluginInfo info{
    .name = "admm",
    .version = "0.1.0",
    .description = "over-relaxed ADMM with one Cholesky factor, adaptive penalty and safeguarded acceleration",
    .licence = "BSD-3-Clause AND LGPL-2.1-or-later AND GPL-2.0-or-later",
    .capabilities = DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION |
                    DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS |
                    DELASSUS_CAN_H_DEFINITE | DELASSUS_CAN_H_SEMIDEFINITE | DELASSUS_CAN_REDUCED |
                    DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START,
    .flags = DELASSUS_FLAG_RESUMES,
};

}  // namespace

}  // namespace delassus::admm

DELASSUS_SOLVER_PLUGIN(delassus::admm::Admm, delassus::admm::info, delassus::admm::options)
