// SPDX-License-Identifier: BSD-3-Clause
#include "check/subject.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace delassus::check {

namespace {

/// max |v − reference| / (1 + max |reference|).
double distance(const std::vector<double>& v, const std::vector<double>& reference) {
    double difference = 0.0, size = 0.0;
    for (std::size_t i = 0; i < v.size(); ++i) {
        difference = std::max(difference, std::abs(v[i] - reference[i]));
        size = std::max(size, std::abs(reference[i]));
    }
    return difference / (1.0 + size);
}

}  // namespace

std::vector<KnownProblem> Subject::takeable(std::vector<KnownProblem> list) const {
    const Solver candidate = solver();
    std::erase_if(list, [&](const KnownProblem& known) {
        return !candidate.refusal(PreparedProblem(known.problem), SolveSettings{}).empty();
    });
    return list;
}

std::vector<KnownProblem> Subject::problems() const {
    auto list = takeable(known_problems());
    expect(!list.empty(), "it takes none of the problems with known answers");
    return list;
}

KnownProblem Subject::tower() const {
    auto list = takeable(towers());
    if (list.empty()) throw Skip("it takes none of the towers");
    return std::move(list.front());
}

void expect(bool condition, const std::string& sentence) {
    if (!condition) throw Failure(sentence);
}

void expect_known_solution(const KnownProblem& known, const Solution& solution, const SolveReport& report) {
    const auto& name = known.problem.name;
    expect(report.status == Status::Solved,
           fmt::format("\"{}\" at tolerance {:.0e} ended with {}{}{}; natural error {:.2e}, balance error {:.2e}", name,
                       report.tolerance, name_of(report.status), report.message.empty() ? "" : ": ", report.message,
                       report.error.natural, report.error.balance));
    const double allowed = 100.0 * report.tolerance;
    const double x_error = distance(solution.x, known.solution.x);
    expect(x_error <= allowed, fmt::format("\"{}\": x is {:.2e} away from the known solution", name, x_error));
    if (!known.lambda_is_unique) return;
    const double lambda_error = distance(solution.lambda, known.solution.lambda);
    expect(lambda_error <= allowed,
           fmt::format("\"{}\": λ is {:.2e} away from the known solution", name, lambda_error));
}

SolveReport solve_known(Solver& solver, const KnownProblem& known, double tolerance) {
    Solution solution;
    auto report = solver.solve(PreparedProblem(known.problem), solution, settings_of(tolerance));
    expect_known_solution(known, solution, report);
    return report;
}

SolveSettings settings_of(double tolerance) {
    SolveSettings settings;
    settings.tolerance = tolerance;
    settings.time_limit = 10.0;
    return settings;
}

}  // namespace delassus::check
