// SPDX-License-Identifier: BSD-3-Clause
// Projected Gauss–Seidel over blocks: see README.md.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "delassus/sdk/monitor.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/solver.hpp"
#include "delassus/sdk/team.hpp"
#include "extrapolation.hpp"
#include "model.hpp"

namespace delassus::pgs {
namespace {

using sdk::ProblemView;
using sdk::Request;
using sdk::Vector;

constexpr const char* variants[] = {"forward", "symmetric", "jacobi"};
constexpr const char* local_solvers[] = {"diagonal", "exact"};
constexpr const char* orderings[] = {"auto", "given", "spaced", "coloured", "domains"};
constexpr const char* accelerations[] = {"none", "anderson"};
constexpr const char* forms[] = {"auto", "velocities", "operator"};

constexpr delassus_option option_table[] = {
    sdk::choice_option("variant", "forward", variants,
                       "order of the blocks: forward, forward and back in one iteration, or all at once (damped)"),
    sdk::choice_option(
        "local_solver", "diagonal", local_solvers,
        "friction blocks: one projected step of length 1/largest eigenvalue, or the one-contact problem"),
    sdk::real_option("omega", "1.5", 1e-3, 1.999, "", "over- or underrelaxation of the local step"),
    sdk::choice_option(
        "form", "auto", forms,
        "sweep on velocities (H diagonal or of blocks, E diagonal) or on rows of N; auto: on velocities if possible"),
    sdk::choice_option("ordering", "auto", orderings,
                       "order of the blocks in a sweep: as in the problem; as in the problem, with neighbours kept a "
                       "little apart; by colours that share no body; inside of domains of bodies, then between them; "
                       "auto: domains where there are a thousand blocks, else spaced"),
    sdk::choice_option("acceleration", "anderson", accelerations, "extrapolation of the sweeps"),
    sdk::integer_option("memory", "5", 1, 100, "points", "differences that anderson keeps"),
    sdk::integer_option("check_every", "0", 0, 1e9, "iterations",
                        "iterations between measurements of the natural error; 0: five, or 5 % of the iterations done"),
    sdk::integer_option("stall_window", "1000000", 0, 1e15, "iterations",
                        "the solve ends as stalled after this many iterations without a gain of 1 %; 0: never"),
};

class Pgs : public sdk::Solver {
public:
    explicit Pgs(const sdk::OptionValues& options)
        : symmetric_(options.choice("variant") == "symmetric"),
          jacobi_(options.choice("variant") == "jacobi"),
          form_(options.choice("form")),
          memory_(options.choice("acceleration") == "anderson" ? static_cast<int>(options.integer("memory")) : 0),
          check_every_(options.integer("check_every")),
          stall_window_(options.integer("stall_window")) {
        rule_.local = options.choice("local_solver") == "exact" ? Local::Exact : Local::Diagonal;
        rule_.omega = options.real("omega");
        const std::string ordering = options.choice("ordering");
        ordering_ = ordering == "given"      ? Ordering::Given
                    : ordering == "spaced"   ? Ordering::Spaced
                    : ordering == "coloured" ? Ordering::Coloured
                    : ordering == "domains"  ? Ordering::Domains
                                             : Ordering::Auto;
    }

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
        model_.build(problem, operator_, on_velocities, jacobi_, rule_.local == Local::Exact, ordering_);
        model_.use({});
    }

    sdk::Outcome solve(const ProblemView& problem, const Request& request, sdk::MutableVectorView x,
                       sdk::MutableVectorView lambda) override {
        operator_.free_velocity(problem, u_);
        residual_.assign(problem, operator_.diagonal(), u_);
        model_.use(useful_team(problem));
        model_.set_right_hand_side(problem, operator_, residual_.scaling());
        rule_.coulomb = problem.coulomb;
        lambda_.setZero(problem.m);
        if (request.warm_start() && lambda.allFinite()) lambda_ = lambda;
        for (const delassus_cone& cone : problem.cones) sdk::project(cone, lambda_.data() + cone.first_row);

        sdk::Monitor monitor(request, stall_window_);
        iterate(problem, request, monitor);
        model_.use({});
        lambda = monitor.best();
        x = operator_.velocity(problem, lambda);
        return monitor.outcome();
    }

    std::int64_t analyses() const override { return operator_.inverse().analyses(); }
    std::int64_t factorizations() const override { return operator_.inverse().factorizations(); }

private:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::milliseconds patience{20};  // between two calls of progress
    static constexpr std::int64_t fewest_extrapolated = 30;
    static constexpr std::int64_t fewest_unchecked = 20;
    static constexpr double worth_a_look = 1.5;  // times the tolerance: an estimate that low

    // A sweep over fewer contacts is done before the others have come (docs/measurements.md).
    [[nodiscard]] sdk::Team useful_team(const ProblemView& problem) const {
        return team().if_worth(problem.m >= (ordering_ == Ordering::Coloured ? 6000 : 3000));
    }

    void iterate(const ProblemView& problem, const Request& request, sdk::Monitor& monitor) {
        model_.state_of(lambda_, state_);
        // A tolerance below rounding asks for all iterations: then only their end is measured. A few of them gain less
        // by extrapolation than it costs.
        const bool to_the_end = request.tolerance() < std::numeric_limits<double>::epsilon();
        const bool few = to_the_end && request.max_iterations() < fewest_extrapolated;
        extrapolation_.reset(model_, operator_, few ? 0 : memory_);
        // A warm start is a step of a simulation, whose sweeps are few: their own estimate says when to look.
        const bool estimates = request.warm_start() && check_every_ == 0 && !jacobi_;
        std::int64_t next_check = to_the_end ? request.max_iterations() : 0;
        Clock::time_point shown = Clock::now();
        for (std::int64_t iteration = 0;; ++iteration) {
            bool looks = false;
            double error = std::numeric_limits<double>::infinity();
            if (iteration > 0) {
                extrapolation_.before(model_, state_);
                looks = extrapolation_.looks();
                const bool records = estimates && (iteration == 1 || iteration % Extrapolation::period == 0);
                const double squares = advance(records);
                if (records) error = std::sqrt(squares) / residual_.reference();
                looks = looks && !records;
            }
            bool due = iteration >= next_check || iteration >= request.max_iterations() ||
                       error <= worth_a_look * request.tolerance();
            auto answer = DELASSUS_CONTINUE;
            if (!due && request.has_listener() && Clock::now() - shown > patience) {
                model_.reactions(state_, lambda_);
                answer = request.progress(iteration, nullptr, lambda_.data());
                shown = Clock::now();
                due = answer != DELASSUS_CONTINUE;  // the iterate may be better than the best that was measured
            }
            if (due || looks) error = look();
            if (due) {
                if (monitor.check(iteration, nullptr, lambda_, confirmed(error, problem, request))) return;
                if (answer != DELASSUS_CONTINUE) {
                    monitor.outcome().status = sdk::status_of(answer);
                    return;
                }
                shown = Clock::now();
                next_check =
                    estimates ? iteration + std::max(fewest_unchecked, iteration / 20) : next_check_after(iteration);
            }
            if (iteration > 0) extrapolation_.after(model_, state_);
        }
    }

    // Where the sweeps are extrapolated, the ends of its periods are looked at anyway.
    [[nodiscard]] std::int64_t next_check_after(std::int64_t iteration) const {
        if (check_every_ > 0) return iteration + check_every_;
        if (iteration < 2) return iteration + 1;
        if (!extrapolation_.works()) return iteration + 4 + iteration / 20;
        constexpr int period = Extrapolation::period;
        return (iteration + std::max<std::int64_t>(period, iteration / 20)) / period * period;
    }

    /// records: returns what Model::recorded_sweep returns, else 0.
    double advance(bool records) {
        if (jacobi_) {
            model_.jacobi_step(rule_, state_, next_);
            return 0.0;
        }
        const auto sweep = [&](Direction direction, bool last) {
            rule_.direction = direction;
            if (last && records) return model_.recorded_sweep(rule_, state_);
            model_.sweep_in_place(rule_, state_);
            return 0.0;
        };
        const double squares = sweep(Direction::Forward, !symmetric_);
        return symmetric_ ? sweep(Direction::Backward, true) : squares;
    }

    /// The natural error of the state.
    [[nodiscard]] double look() { return std::sqrt(model_.look(state_, rule_.coulomb)) / residual_.reference(); }

    // λ ← that of the state. Where its error would end the solve, v̂ is renewed from λ, which takes out the rounding of
    // all changes so far, and the error is measured again: sharp ones as the host does, from u = D H⁻¹(a + Dᵀλ) + E λ +
    // b, since rounding in another order would make a false claim of a true one.
    double confirmed(double error, const ProblemView& problem, const Request& request) {
        constexpr double sharp = 1e-8;
        model_.reactions(state_, lambda_);
        if (error > sdk::Monitor::aim * request.tolerance()) return error;
        model_.state_of(lambda_, state_);
        error = look();
        if (request.tolerance() > sharp || error > sdk::Monitor::aim * request.tolerance()) return error;
        u_ = problem.b;
        if (problem.n > 0) u_.noalias() += problem.D * operator_.velocity(problem, lambda_);
        if (problem.E.nonZeros() > 0) u_.noalias() += problem.E * lambda_;
        return residual_.natural(lambda_, u_);
    }

    bool symmetric_, jacobi_;
    std::string form_;
    int memory_;  // 0: no acceleration
    Ordering ordering_ = Ordering::Spaced;
    std::int64_t check_every_, stall_window_;
    SweepRule rule_;
    sdk::DelassusOperator operator_;
    Model model_;
    sdk::NaturalResidual residual_;
    SweepState state_;
    Extrapolation extrapolation_;
    Vector lambda_, next_, u_;
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
                                                  .capabilities = delassus::pgs::capabilities}),
                       delassus::pgs::option_table)
