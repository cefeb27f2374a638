// SPDX-License-Identifier: BSD-3-Clause
#include "bench/tasks.hpp"

#include <algorithm>
#include <set>

#include "bench/key.hpp"
#include "problem/cone_kinds.hpp"

namespace delassus::bench {

namespace {

std::vector<std::string> limits_of(const Suite& suite) {
    return {digits(suite.time_limit), digits(suite.memory_limit), std::to_string(suite.max_iterations),
            std::to_string(suite.repeats)};
}

std::string key_of_run(std::vector<std::string> parts, const Suite& suite, const std::string& code) {
    for (const auto& limit : limits_of(suite)) parts.push_back(limit);
    parts.push_back(code);
    return key_of(parts);
}

/// Names tell problems apart in tables.
std::string unique_name(const std::string& name, const std::vector<TaskProblem>& others) {
    std::string unique = name;
    for (int number = 2;
         std::any_of(others.begin(), others.end(), [&](const TaskProblem& other) { return other.name == unique; });
         ++number)
        unique = fmt::format("{} ({})", name, number);
    return unique;
}

void add_solves(Tasks& tasks, const Suite& suite, const std::string& code, const std::vector<bool>& shares) {
    for (std::size_t p = 0; p < tasks.problems.size(); ++p) {
        const ProblemFacts& facts = tasks.problems[p].facts;
        const bool lawful = std::any_of(facts.cones.begin(), facts.cones.end(), [](const auto& cone) {
            const auto* kind = find_cone_kind(cone.first);
            return kind && kind->has_law();
        });
        std::set<std::string> laws;
        for (const auto& chosen : suite.laws) {
            const std::string law = chosen.empty() || !lawful ? facts.law : chosen;
            if (!laws.insert(law).second) continue;
            for (std::size_t s = 0; s < suite.solvers.size(); ++s)
                for (const int processes : suite.processes) {
                    if (processes > 1 && !shares[s]) continue;
                    const bool parts = suite.in_parts() && shares[s];
                    for (const double tolerance : suite.tolerances) {
                        std::vector<std::string> content = {"solve", facts.hash, law, label_of(suite.solvers[s]),
                                                            digits(tolerance)};
                        if (parts) content.push_back(fmt::format("{} processes", processes));
                        tasks.solves.push_back(
                            {key_of_run(std::move(content), suite, code), p, s, law, tolerance, parts ? processes : 0});
                    }
                }
        }
    }
}

void add_simulations(Tasks& tasks, const Suite& suite, const std::string& code) {
    for (std::size_t index = 0; index < tasks.scenes.size(); ++index) {
        TaskScene& scene = tasks.scenes[index];
        auto methods = !scene.entry.timesteppers.empty() ? scene.entry.timesteppers : suite.timesteppers;
        if (methods.empty()) methods.push_back({"", {}});
        for (const auto& method : methods) {
            std::vector<double> steps = !scene.entry.steps.empty() ? scene.entry.steps
                                        : !method.steps.empty()    ? method.steps
                                                                   : suite.steps;
            if (steps.empty()) steps.push_back(scene.facts.step);
            for (const auto& solver : suite.step_solvers)
                for (const double step : steps) {
                    SimulateRequest request;
                    request.scene = scene.entry.source;
                    request.timestepper = method.text;
                    request.step = step;
                    request.solver = solver;
                    request.time_limit = suite.time_limit;
                    request.repeats = suite.repeats;
                    scene.smallest_step = scene.smallest_step > 0.0 ? std::min(scene.smallest_step, step) : step;
                    tasks.simulations.push_back({"", index, std::move(request)});
                }
        }
    }
    // The reference that the end is measured against is part of the result.
    const auto& references = suite.references;
    for (auto& task : tasks.simulations) {
        const TaskScene& scene = tasks.scenes[task.scene];
        task.key =
            key_of_run({"simulation", scene.facts.hash, digits(scene.facts.end), task.request.timestepper,
                        digits(task.request.step), task.request.solver, scene.entry.reference_timestepper,
                        digits(scene.entry.reference_step), references.timestepper, digits(references.step_fraction),
                        digits(scene.smallest_step), std::to_string(references.solvers.empty())},
                       suite, code);
    }
}

}  // namespace

Tasks make_tasks(const Suite& suite, const WorkerSettings& worker, const std::string& code,
                 const std::vector<bool>& shares) {
    Tasks tasks;
    std::set<std::string> known;
    for (const auto& problem : suite.problems) {
        ProblemFacts facts = describe(worker, problem.source, {}, suite.in_parts() ? suite.processes.back() : 0);
        if (!known.insert(facts.hash + facts.law).second) continue;
        const std::string name = unique_name(problem.name.empty() ? facts.name : problem.name, tasks.problems);
        tasks.problems.push_back({problem.source, name, problem.family, std::move(facts)});
    }
    for (const auto& scene : suite.scenes) tasks.scenes.push_back({scene, describe_scene(worker, scene.source), 0.0});
    for (const auto& scene : suite.leaving_out) {
        SceneFacts facts = describe_scene(worker, scene.source);
        const std::string key = key_of_run({"leaving out", facts.hash, digits(facts.end)}, suite, code);
        tasks.leaving_out.push_back({key, scene, std::move(facts)});
    }
    add_solves(tasks, suite, code, shares);
    add_simulations(tasks, suite, code);
    return tasks;
}

}  // namespace delassus::bench
