// SPDX-License-Identifier: BSD-3-Clause
// One solve: what is checked before it, and the judgement afterwards.
#include "delassus/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "problem/cone_kinds.hpp"
#include "solver/judgement.hpp"
#include "solver/solver_implementation.hpp"
#include "support/finite.hpp"

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

std::string quoted_name(const PreparedProblem& problem) {
    const std::string& name = problem.problem().name;
    return name.empty() ? "the problem" : fmt::format("\"{}\"", name);
}

std::uint64_t needs_of(const PreparedProblem& problem, const SolveSettings& settings) {
    std::uint64_t needs = problem.needs();
    if (settings.warm_start) needs |= DELASSUS_CAN_WARM_START;
    if (process_count() > 1) needs |= DELASSUS_CAN_DISTRIBUTED;
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

std::string Solver::refusal(const PreparedProblem& problem, const SolveSettings& settings) const {
    return implementation_->refusal(problem, settings);
}

SolveReport Solver::solve(const PreparedProblem& problem, Solution& solution, const SolveSettings& settings) {
    check_settings(settings);
    if (const std::string sentence = refusal(problem, settings); !sentence.empty()) throw Unsupported(sentence);

    const auto n = static_cast<std::size_t>(problem.problem().n());
    const auto m = static_cast<std::size_t>(problem.problem().m());
    if (settings.warm_start) {
        if (solution.x.size() != n || solution.lambda.size() != m)
            throw InputError(fmt::format("the warm start has {} and {} entries; the problem has n = {} and m = {}",
                                         solution.x.size(), solution.lambda.size(), n, m));
        if (!all_finite(solution.x) || !all_finite(solution.lambda))
            throw InputError("the warm start holds a value that is not finite");
    } else {
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }

    SolveReport report;
    report.problem = problem.problem().name;
    report.solver = info().name;
    report.version = info().version;
    report.options = implementation_->options();
    report.law = problem.problem().law;
    report.tolerance = settings.tolerance;
    if (std::isnan(problem.meter().reference())) {
        refuse_to_judge(report);
        report.error = problem.meter().measure(solution.x, solution.lambda);
        return report;
    }
    const std::optional<Errors> measured = implementation_->run(problem, solution, settings, report);
    const SetUpCounts counts = implementation_->counts();
    report.analyses = counts.analyses;
    report.factorizations = counts.factorizations;

    if (!measured && (!all_finite(solution.x) || !all_finite(solution.lambda))) {
        report.status = Status::NumericalFailure;
        report.message =
            fmt::format("{} returned values that are not finite; they were replaced by zeros", info().name);
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }
    report.error = measured ? *measured : problem.meter().measure(solution.x, solution.lambda);
    const auto& cones = problem.problem().cones;
    const bool only_cones =
        std::all_of(cones.begin(), cones.end(), [](const Cone& cone) { return operations_of(cone).is_cone; });
    const auto rounding = [&] { return rounding_of_balance(problem.problem(), solution); };
    judge(report, only_cones, std::ref(rounding));  // a std::function that allocates nothing
    if (settings.record_curve && !report.curve.empty()) report.curve.back().natural = report.error.natural;
    return report;
}

}  // namespace delassus
