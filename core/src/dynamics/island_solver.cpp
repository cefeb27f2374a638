// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/island_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "dynamics/step_tolerance.hpp"
#include "dynamics/trivial_answers.hpp"
#include "solver/auto_solver.hpp"
#include "solver/judgement.hpp"

namespace delassus {

namespace {

/// As well as rounding lets the rows hold, and balanced. The balance is relative to the momenta, whatever the reactions
/// are: a mechanism that falls freely has rows that hold at the speeds of the step before, too.
bool is_rounding(const Errors& error) {
    return rows_are_rounding(error) && error.balance <= rounding_limit_of_steps;
}

/// The tolerance that follows from the error of the method, where it is known.
std::optional<double> goal_for(const Prepared& problem, const IslandRequest& request, const IslandTraits& traits) {
    if (request.corrects) return least_goal(traits, static_cast<double>(problem.all_rows()));
    if (!request.method_error) return {};
    const std::span<const double> errors = *request.method_error;
    const Communicator& run = problem.communicator();
    double square = 0.0, of_solves = request.error_of_solves;
    for (std::size_t i = 0; i < errors.size(); ++i)
        if (errors[i] != 0.0) square += problem.diagonal(i) * errors[i] * errors[i];
    run.sum(std::span(&square, 1));
    run.max(std::span(&of_solves, 1));
    // What solves left is known as a bound: a quarter of what is seen counts as the method's in any case.
    const auto of_method = [of_solves](double all) {
        return std::max(0.25 * all, std::sqrt(std::max(0.0, (all - of_solves) * (all + of_solves))));
    };
    return goal_of({.in_masses = of_method(std::sqrt(std::abs(square))),
                    .in_rows = of_method(problem.norm_in_rows(errors)),
                    .reference = problem.reference(),
                    .rows = static_cast<double>(problem.all_rows()),
                    .gathered = request.gathered},
                   traits);
}

}  // namespace

IslandSolver::IslandSolver(const Registry& registry, const SolverConfig& config)
    : registry_(registry), config_(config), solver_(make_solver(registry, config)) {}

void IslandSolver::solve(const Prepared& problem, Solution& solution, const IslandRequest& request,
                         IslandResult& result) {
    constexpr double suspicious = 1e-5, rounding_of_motion = 1e-13;
    const double share = share_of_rows(problem);
    if (request.leaves_out && share < suspicious && rows_feel_nothing(problem, solution)) return;
    SolverEffort& spent = result.effort;
    SolveSettings settings = request.settings;
    const IslandTraits traits = traits_of(problem);
    set_step_tolerance(config_, traits, goal_for(problem, request, traits), request.share, settings);
    if (share < suspicious) {
        const double least = std::min(rounding_of_motion / share, 1.0);
        settings.tolerance = std::max(settings.tolerance, least);
        if (settings.loosest > 0.0) settings.loosest = std::max(settings.loosest, least);
    }
    settings.warm_start = request.warm_start;
    const bool may_repeat = config_.name != auto_name && !settings.fixed_iterations;
    if (may_repeat && settings.warm_start) before_ = solution;
    SolveReport report;
    try {
        report = run(solver_, problem, solution, settings, spent);
    } catch (const Unsupported& refusal) {
        // Of linear problems others may take such an H; the refusal names them.
        const bool linear = (problem.needs() & sdk::cones_not_linear) == 0;
        if (linear || (problem.needs() & DELASSUS_CAN_H_INDEFINITE) == 0) throw;
        throw IndefiniteStep(refusal.what());
    }
    ++spent.plugin_solves;
    const auto done = [&] {
        return report.status == Status::Solved || report.near_goal ||
               (settings.fixed_iterations && report.status == Status::IterationLimit);
    };
    // Beside reactions that grow without bound, as where two bodies squeeze a third, every velocity is rounding, and
    // all measures that add the two are small.
    const auto count_rounding = [&] {
        if (!done())
            report.error.balance = std::max(report.error.balance, problem.rounding_of_balance(solution).reactions);
    };
    count_rounding();
    if (!done() && (is_rounding(report.error) || moves_freely(problem, solution))) return;
    if (!done() && may_repeat) run_again(problem, settings, solution, report, spent);
    count_rounding();
    if (!done()) report.near_goal = last_resort(config_, traits, settings, report);
    result.natural = report.error.natural;
    result.in_masses = report.error.natural * problem.reference();
    spent.worst_natural = std::max(spent.worst_natural, report.error.natural);
    if (report.near_goal) ++spent.near_goal;
    if (done()) return;
    result.solved = false;
    spent.worst_miss =
        std::max(spent.worst_miss, worst_of(report.error) / std::max(settings.tolerance, rounding_limit_of_steps));
    if (!spent.unsolved.empty()) return;
    spent.unsolved = fmt::format("{} ended with {}", report.solver, name_of(report.status));
    if (std::isfinite(report.error.natural))
        spent.unsolved += fmt::format(" at a natural error of {:.1e}", report.error.natural);
    if (!report.message.empty()) spent.unsolved += ": " + report.message;
}

SolveReport IslandSolver::run(Solver& solver, const Prepared& problem, Solution& solution,
                              const SolveSettings& settings, SolverEffort& spent) {
    SolveReport report;
    if (settings.warm_start && (solver.info().capabilities & DELASSUS_CAN_WARM_START) == 0) {
        SolveSettings cold = settings;
        cold.warm_start = false;
        report = solver.solve(problem, solution, cold);
    } else {
        report = solver.solve(problem, solution, settings);
    }
    if (report.status == Status::Cancelled) throw StepInterrupted("the step was interrupted");
    spent.iterations += report.iterations;
    spent.seconds += report.seconds_setup + report.seconds_solve;
    if (report.stages.empty() && report.solver != auto_name) loaded_.insert(report.solver);
    for (const auto& stage : report.stages) loaded_.insert(stage.solver);
    return report;
}

void IslandSolver::run_again(const Prepared& problem, SolveSettings settings, Solution& solution, SolveReport& report,
                             SolverEffort& spent) {
    if (!fallback_) {
        SolverConfig other = config_;
        other.name = auto_name;
        other.options.clear();
        fallback_ = make_solver(registry_, other);
    }
    const bool failed = report.status == Status::Error || report.status == Status::NumericalFailure ||
                        report.status == Status::FalseClaim;
    if (failed && ++spent.failed == 1) spent.failure = report.message;
    settings.max_iterations = SolveSettings{}.max_iterations;
    Solution other = settings.warm_start ? before_ : Solution{};
    SolveReport second = run(*fallback_, problem, other, settings, spent);
    ++spent.repeated;
    if (second.status != Status::Solved && !(second.error.natural < report.error.natural)) return;
    solution = std::move(other);
    report = std::move(second);
}

}  // namespace delassus
