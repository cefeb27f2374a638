// SPDX-License-Identifier: BSD-3-Clause
// One solve: what is checked before it, and the judgement afterwards.
#include "delassus/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>

#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "solver/judgement.hpp"
#include "solver/solver_implementation.hpp"
#include "support/finite.hpp"
#include "support/trace.hpp"

namespace delassus {

std::string_view name_of(Status status) {
    switch (status) {
        case Status::Solved:
            return "solved";
        case Status::IterationLimit:
            return "iteration_limit";
        case Status::TimeLimit:
            return "time_limit";
        case Status::Stalled:
            return "stalled";
        case Status::Infeasible:
            return "infeasible";
        case Status::NumericalFailure:
            return "numerical_failure";
        case Status::Cancelled:
            return "cancelled";
        case Status::Error:
            return "error";
        case Status::FalseClaim:
            return "false_claim";
    }
    return "error";
}

std::string_view name_of(delassus_phase phase) {
    constexpr std::array<std::string_view, DELASSUS_PHASE_COUNT> names = {"products", "projections", "linear_systems",
                                                                          "exchange", "reductions",  "waiting"};
    return names.at(static_cast<std::size_t>(phase));
}

std::string quoted_name(const Prepared& problem) {
    return problem.name().empty() ? "the problem" : fmt::format("\"{}\"", problem.name());
}

std::uint64_t needs_of(const Prepared& problem, const SolveSettings& settings) {
    std::uint64_t needs = problem.needs();
    if (settings.warm_start) needs |= DELASSUS_CAN_WARM_START;
    if (problem.whole() && process_count() > 1) needs |= DELASSUS_CAN_DISTRIBUTED;
    return needs;
}

std::string who_can(const Registry& registry, std::uint64_t needs) {
    auto capable = registry.capable(needs);
    if ((needs & DELASSUS_CAN_DISTRIBUTED) != 0)  // a problem that is given whole to all may be shared among them
        for (auto& name : registry.capable((needs & ~static_cast<std::uint64_t>(DELASSUS_CAN_DISTRIBUTED)) |
                                           DELASSUS_CAN_PARTITIONED))
            if (std::find(capable.begin(), capable.end(), name) == capable.end()) capable.push_back(std::move(name));
    return capable.empty() ? ". No installed solver can" : fmt::format(". Can: {}", fmt::join(capable, ", "));
}

Solver::Solver(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

const PluginInfo& Solver::info() const {
    return implementation_->info();
}

std::string Solver::refusal(const Prepared& problem, const SolveSettings& settings) const {
    return implementation_->refusal(problem, settings);
}

SolveReport Solver::solve(const Prepared& problem, Solution& solution, const SolveSettings& settings) {
    check_settings(settings);
    TraceSpan span("solve", info().name);
    if (const std::string sentence = refusal(problem, settings); !sentence.empty()) throw Unsupported(sentence);

    const Communicator& run = problem.communicator();
    const std::size_t n = problem.a().size(), m = problem.b().size();
    const auto check_start = [&] {
        if (solution.x.size() != n || solution.lambda.size() != m)
            throw InputError(fmt::format("the warm start has {} and {} entries; the {} has n = {} and m = {}",
                                         solution.x.size(), solution.lambda.size(),
                                         problem.whole() ? "problem" : "part", n, m));
        if (!all_finite(solution.x) || !all_finite(solution.lambda))
            throw InputError("the warm start holds a value that is not finite");
    };
    if (settings.warm_start) {
        together(run, std::ref(check_start));  // a std::function that allocates nothing
    } else {
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }

    SolveReport report;
    report.problem = problem.name();
    report.solver = info().name;
    report.version = info().version;
    report.options = implementation_->options();
    report.law = problem.law();
    report.tolerance = settings.told_tolerance();
    if (std::isnan(problem.reference())) {
        refuse_to_judge(report);
        report.error = problem.measure(solution.x, solution.lambda);
        return report;
    }
    const std::optional<Errors> measured = implementation_->run(problem, solution, settings, report);
    const SetUpCounts counts = implementation_->counts();
    report.analyses = counts.analyses;
    report.factorizations = counts.factorizations;

    double broken = measured || (all_finite(solution.x) && all_finite(solution.lambda)) ? 0.0 : 1.0;
    run.max(std::span(&broken, 1));
    if (broken > 0.0) {
        report.status = Status::NumericalFailure;
        report.message =
            fmt::format("{} returned values that are not finite; they were replaced by zeros", info().name);
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }
    report.error = measured ? *measured : problem.measure(solution.x, solution.lambda);
    constexpr std::uint64_t no_cones = sdk::cones_that([](const sdk::ConeOperations& row) { return !row.is_cone; });
    const auto rounding = [&] { return problem.rounding_of_balance(solution); };
    judge(report, (problem.needs() & no_cones) == 0, std::ref(rounding));
    if (settings.record_curve && !report.curve.empty()) report.curve.back().natural = report.error.natural;
    span.say("problem", report.problem);
    span.say("status", name_of(report.status));
    span.say("iterations", static_cast<double>(report.iterations));
    span.say("natural", report.error.natural);
    return report;
}

}  // namespace delassus
