// SPDX-License-Identifier: BSD-3-Clause
// Projected Gauss–Seidel over blocks: see README.md.
#include <string>

#include "delassus/sdk/monitor.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/solver.hpp"
#include "delassus/sdk/team.hpp"
#include "iteration.hpp"
#include "model.hpp"
#include "options.hpp"

namespace delassus::pgs {
namespace {

using sdk::ProblemView;
using sdk::Request;
using sdk::Vector;

constexpr const char* forms[] = {"auto", "velocities", "operator"};

constexpr delassus_option option_table[] = {
    variant_option,
    local_solver_option,
    omega_option,
    sdk::choice_option(
        "form", "auto", forms,
        "sweep on velocities (H diagonal or of blocks, E diagonal) or on rows of N; auto: on velocities if possible"),
    ordering_option,
    acceleration_option,
    memory_option,
    check_every_option,
    stall_window_option,
};

class Pgs : public sdk::Solver {
public:
    explicit Pgs(const sdk::OptionValues& options)
        : form_(options.choice("form")), ordering_(ordering_of(options)), iteration_(options) {}

    std::string refusal(const ProblemView& problem) override {
        if (form_ == "velocities" && !can_sweep_on_velocities(problem))
            return "form = velocities needs a diagonal or block-diagonal H and a diagonal E";
        return {};
    }

    void analyze(const ProblemView& problem) override { operator_.analyze(problem); }

    void factorize(const ProblemView& problem) override {
        const bool on_velocities = form_ != "operator" && can_sweep_on_velocities(problem);
        model_.use(useful_team(problem));
        operator_.factorize(problem, !on_velocities, model_.team());
        model_.build(problem, operator_, on_velocities, iteration_.jacobi(), iteration_.exact(), ordering_);
        model_.use({});
    }

    sdk::Outcome solve(const ProblemView& problem, const Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override {
        sdk::Monitor monitor(request, iteration_.stall_window());
        model_.use(useful_team(problem));
        if (request.resume()) {
            monitor.go_on(lambda, best_error_);
        } else {
            operator_.free_velocity(problem, u_);
            residual_.assign(problem, operator_.diagonal(), u_);
            model_.set_right_hand_side(problem, operator_, residual_.scaling());
            lambda_.setZero(problem.m);
            if (request.warm_start() && lambda.allFinite()) lambda_ = lambda;
            for (const delassus_cone& cone : problem.cones) sdk::project(cone, lambda_.data() + cone.first_row);
        }
        iteration_.run(model_, operator_, residual_.reference(), problem.coulomb, request, monitor, lambda_,
                       [&](const Vector& reactions) { return measured(problem, reactions); });
        model_.use({});
        best_error_ = monitor.best_residual();
        lambda = monitor.best();
        x = operator_.velocity(problem, lambda);
        return monitor.outcome();
    }

    std::int64_t analyses() const override { return operator_.inverse().analyses(); }
    std::int64_t factorizations() const override { return operator_.inverse().factorizations(); }

private:
    // A sweep over fewer contacts is done before the others have come (docs/measurements.md).
    [[nodiscard]] sdk::Team useful_team(const ProblemView& problem) const {
        return team().if_worth(problem.m >= (ordering_ == Ordering::Coloured ? 6000 : 3000));
    }

    /// From u = D H⁻¹(a + Dᵀλ) + E λ + b.
    [[nodiscard]] double measured(const ProblemView& problem, const Vector& lambda) {
        u_ = problem.b;
        if (problem.n > 0) u_.noalias() += problem.D * operator_.velocity(problem, lambda);
        if (problem.E.nonZeros() > 0) u_.noalias() += problem.E * lambda;
        return residual_.natural(lambda, u_);
    }

    std::string form_;
    Ordering ordering_;
    Iteration iteration_;
    sdk::DelassusOperator operator_;
    Model model_;
    sdk::NaturalResidual residual_;
    Vector lambda_, u_;
    double best_error_ = 0.0;  // of the iterates since the start
};

constexpr std::uint64_t capabilities =
    DELASSUS_CAN_FREE | DELASSUS_CAN_NONNEGATIVE | DELASSUS_CAN_BOX | DELASSUS_CAN_FRICTION | DELASSUS_CAN_ASSOCIATED |
    DELASSUS_CAN_COULOMB | DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE |
    DELASSUS_CAN_REDUCED | DELASSUS_CAN_COMPLIANCE | DELASSUS_CAN_REDUNDANT | DELASSUS_CAN_WARM_START;

}  // namespace
}  // namespace delassus::pgs

DELASSUS_SOLVER_PLUGIN(delassus::pgs::Pgs,
                       (delassus::sdk::PluginInfo{.name = "pgs",
                                                  .version = "0.1.0",
                                                  .description = "projected Gauss-Seidel over blocks, on velocities or "
                                                                 "on rows of the Delassus operator",
                                                  .licence = "BSD-3-Clause AND MPL-2.0",
                                                  .capabilities = delassus::pgs::capabilities,
                                                  .flags = DELASSUS_FLAG_RESUMES}),
                       delassus::pgs::option_table)
