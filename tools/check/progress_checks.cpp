// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "check/checks.hpp"
#include "check/raw_solver.hpp"

namespace delassus::check {

namespace {

constexpr const char* silent = "it never called progress in this run";
/// Enough for a solver to be heard in; the tower is slow for simple methods.
constexpr std::int64_t heard_iterations = 2000;

std::string check_iterates(const Subject& subject) {
    const auto known = subject.tower();
    const PreparedProblem problem(known.problem);
    const auto n = known.problem.a.size(), m = known.problem.b.size();
    RawSolver solver(subject);
    expect(solver.set_up(problem.raw()) == DELASSUS_SOLVED, solver.last_error());
    std::int64_t calls = 0, last = -1;
    std::string fault;
    const auto listen = [&](std::int64_t iteration, const double* x, const double* lambda) -> std::int32_t {
        ++calls;
        if (iteration < last) fault = fmt::format("progress was given iteration {} after {}", iteration, last);
        last = iteration;
        if (!lambda) fault = "progress was given no λ";
        for (std::size_t i = 0; lambda && i < m; ++i)
            if (!std::isfinite(lambda[i])) fault = "progress was given a λ that is not finite";
        for (std::size_t i = 0; x && i < n; ++i)
            if (!std::isfinite(x[i])) fault = "progress was given an x that is not finite";
        return DELASSUS_CONTINUE;
    };
    auto settings = settings_of(1e-6);
    settings.max_iterations = heard_iterations;
    const auto heard = solver.solve(problem.raw(), settings, listen);
    expect(fault.empty(), fault);
    const auto unheard = solver.solve(problem.raw(), settings, nullptr);
    expect(heard.status == unheard.status, "a null progress changes the status of the solve");
    if (calls == 0) throw Skip(silent);
    return fmt::format("{} calls, {} iterations", calls, heard.outcome.iterations);
}

/// Asks to stop at the first and at the fourth call of progress.
std::string check_cancel(const Subject& subject) {
    const auto known = subject.tower();
    const PreparedProblem problem(known.problem);
    bool heard = false;
    for (const std::int64_t k : {1, 4}) {
        Solver solver = subject.solver();
        auto settings = settings_of(1e-14);
        settings.max_iterations = heard_iterations;
        std::int64_t calls = 0;
        settings.cancelled = [&] { return ++calls >= k; };
        Solution solution;
        const auto report = solver.solve(problem, solution, settings);
        if (calls < k) continue;
        heard = true;
        expect(report.status == Status::Cancelled,
               fmt::format("cancelled at call {} of progress, it ended with {}", k, name_of(report.status)));
        expect(calls == k, fmt::format("it called progress {} times more after it was told to stop", calls - k));
        expect(std::isfinite(report.error.natural), "the iterate left after a cancel has no finite error");
    }
    if (!heard) throw Skip(silent);
    return {};
}

std::string check_time_limit(const Subject& subject) {
    const auto known = subject.tower();
    Solver solver = subject.solver();
    auto settings = settings_of(1e-14);
    settings.time_limit = 1e-9;
    settings.max_iterations = heard_iterations;
    std::int64_t calls = 0;
    settings.cancelled = [&] { return ++calls < 0; };
    Solution solution;
    const auto report = solver.solve(PreparedProblem(known.problem), solution, settings);
    if (calls == 0) throw Skip(silent);
    expect(report.status == Status::TimeLimit,
           fmt::format("told that its time is over, it ended with {}", name_of(report.status)));
    expect(calls == 1, fmt::format("it called progress {} times more after its time was over", calls - 1));
    return {};
}

std::string check_iteration_limit(const Subject& subject) {
    const auto known = subject.tower();
    const PreparedProblem problem(known.problem);
    std::string figures;
    for (const std::int64_t limit : {0, 1, 3}) {
        Solver solver = subject.solver();
        auto settings = settings_of(1e-14);
        settings.max_iterations = limit;
        Solution solution;
        const auto report = solver.solve(problem, solution, settings);
        expect(report.iterations <= limit, fmt::format("allowed {} iterations, it took {}", limit, report.iterations));
        expect(
            report.status != Status::FalseClaim && report.status != Status::Error &&
                report.status != Status::NumericalFailure,
            fmt::format("allowed {} iterations, it ended with {}: {}", limit, name_of(report.status), report.message));
        figures += fmt::format("{}{}: {}", figures.empty() ? "" : ", ", limit, name_of(report.status));
    }
    return figures;
}

/// No iterations at all, on every problem: the starting point comes back, or the solution where none are needed.
std::string check_no_iterations(const Subject& subject) {
    for (const auto& known : subject.problems()) {
        Solver solver = subject.solver();
        auto settings = settings_of(fine_tolerance);
        settings.max_iterations = 0;
        Solution solution;
        const auto report = solver.solve(PreparedProblem(known.problem), solution, settings);
        expect(report.status == Status::IterationLimit || report.status == Status::Solved,
               fmt::format("\"{}\" with no iterations allowed ended with {}: {}", known.problem.name,
                           name_of(report.status), report.message));
    }
    return {};
}

}  // namespace

std::vector<Check> progress_checks() {
    return {{"progress/iterates", check_iterates},
            {"progress/cancel", check_cancel},
            {"progress/time_limit", check_time_limit},
            {"limits/iterations", check_iteration_limit},
            {"limits/no_iterations", check_no_iterations}};
}

}  // namespace delassus::check
