// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "check/checks.hpp"
#include "check/raw_solver.hpp"
#include "problem/cone_kinds.hpp"

namespace delassus::check {

namespace {

/// There is no solution: every status but "solved" is honest, and x and λ stay finite (RawSolver sees to that).
std::string fail_honestly(const Subject& subject, const Problem& data) {
    const PreparedProblem problem(data);
    if (const auto missing = subject.info().missing(problem.needs()))
        throw Skip(fmt::format("it does not declare {}", fmt::join(capability_names(missing), ", ")));
    if (const auto reason = subject.solver().refusal(problem, SolveSettings{}); !reason.empty()) throw Skip(reason);
    RawSolver solver(subject);
    if (const auto status = solver.set_up(problem.raw()); status != DELASSUS_SOLVED) {
        const auto sentence = solver.last_error();
        expect(!sentence.empty(), "its set-up fails without a sentence");
        return fmt::format("set-up: {}", sentence);
    }
    auto settings = settings_of(fine_tolerance);
    settings.max_iterations = 5000;
    const auto result = solver.solve(problem.raw(), settings, nullptr);
    expect(result.status != DELASSUS_SOLVED, fmt::format("it says that \"{}\" is solved", data.name));
    return fmt::format("status {}", result.status);
}

std::string check_inconsistent(const Subject& subject) {
    return fail_honestly(subject, inconsistent_problem());
}

std::string check_singular(const Subject& subject) {
    return fail_honestly(subject, singular_problem());
}

/// After a failure the same solver solves what can be solved.
std::string check_recovery(const Subject& subject) {
    const auto problems = subject.problems();
    Solver solver = subject.solver();
    int failures = 0;
    for (const Problem& data : {inconsistent_problem(), singular_problem()}) {
        const PreparedProblem problem(data);
        if (!solver.refusal(problem, SolveSettings{}).empty()) continue;
        auto settings = settings_of(fine_tolerance);
        settings.max_iterations = 500;
        Solution solution;
        static_cast<void>(solver.solve(problem, solution, settings));
        ++failures;
        solve_known(solver, problems.front());
        solve_known(solver, problems.back());
    }
    if (failures == 0) throw Skip("it takes none of the problems without a solution");
    return {};
}

/// Units are the user's: the same problems with impulses and velocities 10⁶⁰ times larger and smaller.
std::string check_units(const Subject& subject) {
    int solved = 0, solves = 0;
    for (const double factor : {1e60, 1e-60}) {
        for (auto known : subject.problems()) {
            for (auto* values : {&known.problem.a, &known.problem.b})
                for (double& value : *values) value *= factor;
            for (auto& cone : known.problem.cones) {
                for (auto* bounds : {&cone.lo, &cone.hi})
                    for (double& bound : *bounds) bound *= factor;
                const auto parameters = operations_of(cone).named_parameters();
                for (std::size_t k = 0; k < parameters.size(); ++k)
                    if (parameters[k].is_reaction) cone.parameters[k] *= factor;
            }
            Solver solver = subject.solver();
            auto settings = settings_of(1e-6);
            settings.time_limit = 1.0;
            Solution solution;
            const auto report = solver.solve(PreparedProblem(known.problem), solution, settings);
            expect(report.status != Status::FalseClaim && report.status != Status::Error &&
                       report.message.find("not finite") == std::string::npos,
                   fmt::format("\"{}\" in units of {:.0e} ended with {}: {}", known.problem.name, factor,
                               name_of(report.status), report.message));
            solved += report.status == Status::Solved;
            ++solves;
        }
    }
    return fmt::format("{} of {} solved, no false claim", solved, solves);
}

}  // namespace

std::vector<Check> failure_checks() {
    return {{"failure/inconsistent", check_inconsistent},
            {"failure/singular", check_singular},
            {"failure/recovery", check_recovery},
            {"failure/units", check_units}};
}

}  // namespace delassus::check
