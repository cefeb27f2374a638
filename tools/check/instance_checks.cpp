// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>

#include "check/checks.hpp"
#include "check/raw_solver.hpp"

namespace delassus::check {

namespace {

std::string check_interleaved(const Subject& subject) {
    const auto problems = subject.problems();
    const auto &first = problems.front(), &second = problems.back();
    Solver one = subject.solver(), two = subject.solver();
    for (int k = 0; k < 5; ++k) {
        solve_known(one, first.with_right_hand_side(k));
        solve_known(two, second.with_right_hand_side(k));
    }
    return fmt::format("\"{}\" and \"{}\" by turns", first.problem.name, second.problem.name);
}

std::string check_threads(const Subject& subject) {
    const auto problems = subject.problems();
    const KnownProblem* const chosen[] = {&problems.front(), &problems.back()};
    std::exception_ptr failures[2];
    {
        std::vector<std::jthread> threads;
        for (int t = 0; t < 2; ++t)
            threads.emplace_back([&, t] {
                try {
                    Solver solver = subject.solver();
                    for (int k = 0; k < 20; ++k) solve_known(solver, chosen[t]->with_right_hand_side(k));
                } catch (...) {
                    failures[t] = std::current_exception();
                }
            });
    }
    for (const auto& failure : failures)
        if (failure) std::rethrow_exception(failure);
    return "two threads, 20 solves each";
}

std::string check_determinism(const Subject& subject) {
    const auto problems = subject.problems();
    for (const auto& known : problems) {
        const PreparedProblem problem(known.problem);
        Solution answers[2];
        for (auto& answer : answers) {
            Solver solver = subject.solver();
            static_cast<void>(solver.solve(problem, answer, settings_of(fine_tolerance)));
        }
        expect(answers[0].x == answers[1].x && answers[0].lambda == answers[1].lambda,
               fmt::format("\"{}\" solved twice gives two answers that differ in their bits", known.problem.name));
    }
    return fmt::format("{} problems, equal bits", problems.size());
}

/// What a kept solver answers depends on the problem and the request alone, not on the solves before.
std::string check_memory(const Subject& subject) {
    const auto problems = subject.problems();
    for (std::size_t k = 0; k < problems.size(); ++k) {
        const std::string& name = problems[k].problem.name;
        const PreparedProblem problem(problems[k].problem);
        const PreparedProblem between(problems[(k + 1) % problems.size()].problem);
        Solver solver = subject.solver();
        const auto solve = [&](const PreparedProblem& one, Solution& answer) {
            return solver.solve(one, answer, settings_of(fine_tolerance));
        };
        Solution first, other;
        const SolveReport before = solve(problem, first);
        const auto expect_the_same = [&](const char* when) {
            Solution again;
            const SolveReport report = solve(problem, again);
            expect(report.iterations == before.iterations && report.status == before.status,
                   fmt::format("\"{}\" took {} iterations ({}) {}, and {} ({}) before: a solver keeps nothing from one "
                               "solve to the next that changes the answer",
                               name, report.iterations, name_of(report.status), when, before.iterations,
                               name_of(before.status)));
            expect(again.x == first.x && again.lambda == first.lambda,
                   fmt::format("\"{}\" solved {} by the same solver has another answer in its last bits", name, when));
        };
        expect_the_same("for the second time");
        expect_the_same("for the third time");
        static_cast<void>(solve(between, other));
        expect_the_same("after another problem");
    }
    return fmt::format("{} problems, four solves by one solver, equal iterations and bits", problems.size());
}

/// Solvers that are thrown away in the middle of their lives.
std::string check_unused(const Subject& subject) {
    const PreparedProblem problem(subject.problems().front().problem);
    { const RawSolver created(subject); }
    RawSolver twice(subject);
    for (int k = 0; k < 2; ++k)
        expect(twice.set_up(problem.raw()) == DELASSUS_SOLVED,
               fmt::format("set-up {} failed: {}", k, twice.last_error()));
    return {};
}

std::size_t bytes_in_use() {
    const auto information = mallinfo2();
    return information.uordblks + information.hblkhd;
}

constexpr bool under_sanitizer() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    return true;
#else
    return false;
#endif
}

/// A leak grows with every cycle; caches fill and stop. Three batches in a row must each grow by more than 32
/// bytes a cycle to count as one.
std::string check_leaks(const Subject& subject) {
    if (under_sanitizer()) throw Skip("the sanitizer looks for leaks itself");
    constexpr double bytes_a_cycle = 32.0;
    const auto known = subject.problems().back();
    const PreparedProblem problem(known.problem);
    const auto cycle = [&] {
        Solver solver = subject.solver();
        Solution solution;
        for (int k = 0; k < 2; ++k) static_cast<void>(solver.solve(problem, solution, settings_of(1e-4)));
    };
    const auto begin = std::chrono::steady_clock::now();
    for (int k = 0; k < 30; ++k) cycle();
    const std::chrono::duration<double> warm_up = std::chrono::steady_clock::now() - begin;
    const int cycles = std::clamp(static_cast<int>(30.0 * 3.0 / warm_up.count()), 20, 200);
    double growth[3];
    for (double& batch : growth) {
        const auto before = bytes_in_use();
        for (int k = 0; k < cycles; ++k) cycle();
        batch = (static_cast<double>(bytes_in_use()) - static_cast<double>(before)) / cycles;
    }
    const double least = *std::min_element(std::begin(growth), std::end(growth));
    expect(least <= bytes_a_cycle,
           fmt::format("memory grows by {:.0f} bytes a cycle of create, solve and destroy", least));
    return fmt::format("{} cycles, {:.1f} bytes a cycle", std::size(growth) * static_cast<std::size_t>(cycles), least);
}

}  // namespace

std::vector<Check> instance_checks() {
    return {{"instances/interleaved", check_interleaved}, {"instances/threads", check_threads},
            {"instances/determinism", check_determinism}, {"instances/memory", check_memory},
            {"instances/unused", check_unused},           {"instances/leaks", check_leaks}};
}

}  // namespace delassus::check
