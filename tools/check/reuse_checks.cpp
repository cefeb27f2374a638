// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "check/checks.hpp"

namespace delassus::check {

namespace {

std::string check_warm_start(const Subject& subject) {
    if (!subject.can(DELASSUS_CAN_WARM_START)) throw Skip("it does not declare warm_start");
    std::int64_t cold_sum = 0, warm_sum = 0;
    for (const auto& known : subject.problems()) {
        Solver solver = subject.solver();
        const auto cold = solve_known(solver, known);
        auto settings = settings_of(fine_tolerance);
        settings.warm_start = true;
        Solution solution = known.solution;
        const auto warm = solver.solve(PreparedProblem(known.problem), solution, settings);
        expect_known_solution(known, solution, warm);
        expect(warm.iterations <= cold.iterations,
               fmt::format("\"{}\" took {} iterations from its solution and {} from zero", known.problem.name,
                           warm.iterations, cold.iterations));
        cold_sum += cold.iterations;
        warm_sum += warm.iterations;
    }
    return fmt::format("{} iterations from zero, {} from the solutions", cold_sum, warm_sum);
}

/// In pieces of a seventh each, a solve takes the iterations that it takes in one piece, and what it takes to notice
/// the end and to do again what was cut short, at most a piece.
std::string check_resume(const Subject& subject) {
    if ((subject.info().flags & DELASSUS_FLAG_RESUMES) == 0) throw Skip("it does not declare that it resumes");
    std::int64_t whole_sum = 0, pieces_sum = 0;
    auto problems = subject.problems();
    for (auto& tower : subject.takeable(towers())) problems.push_back(std::move(tower));
    for (const auto& known : problems) {
        Solver solver = subject.solver();
        const PreparedProblem problem(known.problem);
        auto settings = settings_of(fine_tolerance);
        Solution solution;
        const auto whole = solver.solve(problem, solution, settings);
        if (whole.status != Status::Solved || whole.iterations < 14) continue;  // a tower may be too hard for it
        settings.max_iterations = whole.iterations / 7;
        SolveReport piece;
        std::int64_t iterations = 0;
        do {
            piece = solver.solve(problem, solution, settings);
            iterations += piece.iterations;
            settings.warm_start = settings.resume = true;
            expect(iterations <= whole.iterations + 2 * settings.max_iterations,
                   fmt::format("\"{}\" took {} iterations in one piece and is not solved after {} in pieces of {}",
                               known.problem.name, whole.iterations, iterations, settings.max_iterations));
        } while (piece.status == Status::IterationLimit);
        expect_known_solution(known, solution, piece);
        whole_sum += whole.iterations;
        pieces_sum += iterations;
    }
    return fmt::format("{} iterations in one piece, {} in seven", whole_sum, pieces_sum);
}

std::string check_right_hand_sides(const Subject& subject) {
    std::int64_t analyses = 0;
    for (const auto& known : subject.problems()) {
        Solver solver = subject.solver();
        PreparedProblem problem(known.problem);
        for (int k = 0; k < 20; ++k) {
            const auto next = known.with_right_hand_side(k);
            problem.set_right_hand_side(next.problem.a, next.problem.b);
            Solution solution;
            const auto report = solver.solve(problem, solution, settings_of(fine_tolerance));
            expect_known_solution(next, solution, report);
            if (k == 0) analyses = report.analyses;
            expect(report.analyses == analyses,
                   fmt::format("\"{}\": right-hand side {} took a new analysis ({} after {})", known.problem.name, k,
                               report.analyses, analyses));
        }
    }
    return analyses > 0 ? "20 right-hand sides a problem, one analysis" : "20 right-hand sides a problem";
}

std::string check_values(const Subject& subject) {
    bool counts = false;
    for (const auto& known : subject.problems()) {
        Solver solver = subject.solver();
        const auto first = solve_known(solver, known);
        for (const double factor : {2.0, 0.5, 3.0}) {
            const auto changed = known.with_values(factor);
            const auto report = solve_known(solver, changed);
            expect(report.analyses == first.analyses,
                   fmt::format("\"{}\": new values of the same pattern took a new analysis", known.problem.name));
            if (first.factorizations > 0) {
                counts = true;
                expect(report.factorizations > first.factorizations,
                       fmt::format("\"{}\": new values took no new factorisation by its count", known.problem.name));
            }
        }
    }
    return counts ? "new factorisations, no new analysis" : "it counts no factorisations";
}

/// One solver for all problems in turn, forwards and back.
std::string check_patterns(const Subject& subject) {
    auto problems = subject.problems();
    Solver solver = subject.solver();
    for (const auto& known : problems) solve_known(solver, known);
    for (auto known = problems.rbegin(); known != problems.rend(); ++known) solve_known(solver, *known);
    return fmt::format("{} problems in turn", 2 * problems.size());
}

}  // namespace

std::vector<Check> reuse_checks() {
    return {{"reuse/warm_start", check_warm_start},
            {"reuse/resume", check_resume},
            {"reuse/right_hand_sides", check_right_hand_sides},
            {"reuse/values", check_values},
            {"reuse/patterns", check_patterns}};
}

}  // namespace delassus::check
