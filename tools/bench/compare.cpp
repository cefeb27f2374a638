// SPDX-License-Identifier: BSD-3-Clause
#include "bench/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "bench/scratch_folder.hpp"
#include "delassus/error.hpp"

namespace delassus::bench {

namespace {

namespace fs = std::filesystem;

/// A result must be as accurate as this (natural error) to serve as the reference of the velocity error.
constexpr double reference_accuracy = 1e-9;

/// Splits at commas that stand outside parentheses.
std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> parts = {""};
    int depth = 0;
    for (const char c : text) {
        depth += c == '(' ? 1 : c == ')' ? -1 : 0;
        if (c == ',' && depth == 0) {
            parts.emplace_back();
        } else if (c != ' ' || depth > 0) {
            parts.back() += c;
        }
    }
    return parts;
}

void compare_velocities(const ComparePlan& plan, ProblemResults& problem, const std::vector<fs::path>& solutions) {
    if (problem.facts.n == 0) return;
    const Measurement* best = nullptr;
    for (const auto& row : problem.results)
        if (row.error && row.error->natural <= reference_accuracy &&
            row.error->balance <= std::max(reference_accuracy, row.error->natural) &&
            (!best || row.error->natural < best->error->natural))
            best = &row;
    if (!best) return;
    const auto index = static_cast<std::size_t>(best - problem.results.data());
    problem.velocity_reference = best->label;
    const auto errors = velocity_errors(plan.worker, problem.path, solutions[index], solutions);
    for (std::size_t k = 0; k < problem.results.size(); ++k) problem.results[k].velocity = errors[k];
}

}  // namespace

bool Comparison::all_solved() const {
    return !interrupted && std::all_of(problems.begin(), problems.end(), [](const ProblemResults& problem) {
        return std::any_of(problem.results.begin(), problem.results.end(),
                           [](const Measurement& row) { return row.status == "solved"; });
    });
}

std::vector<SolverConfig> solvers_of(const std::vector<std::string>& texts, const Registry& registry) {
    std::vector<SolverConfig> solvers;
    std::set<std::string> labels;
    for (const auto& text : texts)
        for (const auto& part : split(text)) {
            SolverConfig solver = parse_solver(part);
            check_solver(registry, solver);
            if (is_library_path(solver.name)) solver.name = fs::absolute(solver.name).lexically_normal().string();
            if (!labels.insert(label_of(solver)).second)
                throw InputError(fmt::format("the solver {} is listed twice", label_of(solver)));
            solvers.push_back(std::move(solver));
        }
    if (!solvers.empty()) return solvers;
    for (const auto& plugin : registry.plugins()) {
        solvers.emplace_back();
        solvers.back().name = plugin.name;
    }
    if (solvers.empty())
        throw InputError(fmt::format("there is no solver to compare: no plugin was found in {}",
                                     registry.folders().back().string()));
    return solvers;
}

Comparison compare(const ComparePlan& plan, const CompareListener& listener) {
    const auto cancelled = [&] { return plan.worker.cancelled && plan.worker.cancelled(); };
    std::vector<ProblemFacts> facts;
    for (const auto& path : plan.problems) facts.push_back(describe(plan.worker, path, plan.settings.law));

    Comparison comparison;
    comparison.created = now();
    comparison.machine = this_machine();
    comparison.build = this_build();
    comparison.settings = plan.settings;
    const std::size_t total = plan.problems.size() * plan.solvers.size();
    std::size_t number = 0;
    for (std::size_t p = 0; p < plan.problems.size() && !cancelled(); ++p) {
        const ScratchFolder scratch;
        std::vector<fs::path> solutions;
        ProblemResults problem{plan.problems[p], facts[p], {}, {}};
        for (const auto& solver : plan.solvers) {
            if (cancelled()) break;
            ++number;
            if (listener.on_begin) listener.on_begin(facts[p], label_of(solver), number, total);
            solutions.push_back(scratch.path() / std::to_string(number));
            problem.results.push_back(measure(
                plan.worker, {plan.problems[p], solver, plan.settings, solutions.back(), {}}, listener.on_sample));
        }
        if (!cancelled()) compare_velocities(plan, problem, solutions);
        comparison.problems.push_back(std::move(problem));
        comparison.interrupted = cancelled();
        if (listener.on_problem) listener.on_problem(comparison);
    }
    comparison.interrupted = cancelled();
    return comparison;
}

std::string shell_line(const std::vector<std::string>& arguments) {
    std::string line;
    for (const auto& argument : arguments) {
        if (!line.empty()) line += ' ';
        const bool plain = !argument.empty() && argument.find_first_not_of(
                                                    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                                    "0123456789_-+=.,/:@%") == std::string::npos;
        if (plain) {
            line += argument;
            continue;
        }
        line += '\'';
        for (const char c : argument) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
        line += '\'';
    }
    return line;
}

}  // namespace delassus::bench
