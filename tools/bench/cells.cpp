// SPDX-License-Identifier: BSD-3-Clause
#include "bench/cells.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/key.hpp"
#include "bench/outcome.hpp"
#include "delassus/error.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace {

/// All that the row follows from, but for the program.
std::vector<std::string> content_of(const Suite& suite, const SuiteAxis& axis, const CellTask& task) {
    std::vector<std::string> parts = {"cell",
                                      axis.name,
                                      digits(axis.values[task.value]),
                                      task.method,
                                      digits(axis.time_limit),
                                      digits(suite.memory_limit),
                                      std::to_string(suite.max_iterations)};
    for (const auto& bound : axis.bounds[task.value]) parts.push_back(bound.measure + digits(bound.limit));
    if (!axis.problems.empty()) {
        for (const auto& part : {axis.problems[task.value].text(), axis.law, digits(axis.tolerance)})
            parts.push_back(part);
        return parts;
    }
    const SceneSource& scene = axis.scenes[task.value];
    parts.push_back(read_file(scene.file));
    for (const auto& [path, text] : scene.settings) parts.push_back(path + "=" + text);
    if (!axis.positions.empty())
        for (const double entry : axis.positions[task.value]) parts.push_back(digits(entry));
    return parts;
}

std::string text_of(const SceneSource& scene) {
    std::string command = "delassus run " + scene.file.lexically_normal().string();
    for (const auto& [path, text] : scene.settings) command += fmt::format(" --set '{}={}'", path, text);
    return command;
}

bool is_bounded(const std::vector<Bound>& bounds, std::string_view measure) {
    return std::any_of(bounds.begin(), bounds.end(), [&](const Bound& bound) { return bound.measure == measure; });
}

Json row_of(const SuiteAxis& axis, const CellTask& task, const std::string& from, const std::string& status,
            const Judgement& judgement, double seconds, std::int64_t peak_memory) {
    return {{"kind", "cell"},
            {"key", task.key},
            {"axis", axis.name},
            {"value", axis.values[task.value]},
            {"method", task.method},
            {"from", from},
            {"outcome", judgement.outcome},
            {"status", status},
            {"sentence", judgement.sentence},
            {"measure", judgement.measure},
            {"figure", json_number(judgement.figure)},
            {"limit", json_number(judgement.limit)},
            {"measures", judgement.measures},
            {"seconds", json_number(seconds)},
            {"peak_memory", peak_memory}};
}

}  // namespace

std::vector<CellTask> make_cells(const Suite& suite, const std::string& code) {
    std::vector<CellTask> tasks;
    const auto add = [&](CellTask task) {
        const SuiteAxis& axis = suite.axes[task.axis];
        for (task.value = 0; task.value < axis.values.size(); ++task.value) {
            auto parts = content_of(suite, axis, task);
            parts.push_back(code);
            task.key = key_of(parts);
            tasks.push_back(task);
        }
    };
    for (std::size_t a = 0; a < suite.axes.size(); ++a) {
        const SuiteAxis& axis = suite.axes[a];
        if (!axis.problems.empty()) {
            for (std::size_t s = 0; s < axis.solvers.size(); ++s) add({"", a, 0, label_of(axis.solvers[s]), s, "", ""});
            continue;
        }
        for (const auto& timestepper : axis.timesteppers)
            for (const auto& solver : axis.step_solvers) {
                const std::string method = timestepper.empty() && solver.empty() ? "as the scene has it"
                                           : timestepper.empty()                 ? solver
                                           : solver.empty()                      ? timestepper
                                                                                 : timestepper + " with " + solver;
                add({"", a, 0, method, 0, timestepper, solver});
            }
    }
    return tasks;
}

Json axis_row(const SuiteAxis& axis) {
    Json bounds = Json::array();
    for (const auto& at : axis.bounds) {
        Json one = Json::object();
        for (const auto& bound : at) one[bound.measure] = bound.limit;
        bounds.push_back(one);
    }
    return {{"kind", "axis"},        {"axis", axis.name},
            {"title", axis.title},   {"unit", axis.unit},
            {"values", axis.values}, {"bounds", bounds},
            {"reason", axis.reason}, {"of", axis.problems.empty() ? "scene" : "problem"}};
}

Json run_cell(const WorkerSettings& worker, const Suite& suite, const CellTask& task,
              const std::filesystem::path& cache) {
    const SuiteAxis& axis = suite.axes[task.axis];
    const auto& bounds = axis.bounds[task.value];
    if (axis.problems.empty()) {
        SimulateRequest request;
        request.scene = axis.scenes[task.value];
        request.timestepper = task.timestepper;
        request.solver = task.step_solver;
        request.time_limit = axis.time_limit;
        request.repeats = 0;
        request.watch = true;
        request.reverse = is_bounded(bounds, "reversal");
        request.body = axis.body;
        const SimulationMeasurement run = simulate(worker, request);
        std::optional<std::array<double, 3>> place;
        if (!axis.positions.empty()) place = axis.positions[task.value];
        return row_of(axis, task, text_of(request.scene), run.status, judge(run, bounds, place), run.seconds,
                      run.peak_memory);
    }
    MeasureRequest request;
    request.problem = axis.problems[task.value];
    request.solver = axis.solvers[task.solver];
    request.settings = {axis.tolerance, axis.time_limit, suite.max_iterations, 0, axis.law};
    Measurement run;
    try {
        if (is_bounded(bounds, "velocity")) {
            const ProblemFacts facts = describe(worker, request.problem, axis.law);
            // A reference that is not confirmed could make a right answer look wrong.
            const Reference reference =
                find_reference(worker, suite.references, request.problem, facts, facts.law, cache);
            if (!reference.row.is_null() && reference.row.value("confirmed", false))
                request.reference = reference.place;
        }
        run = measure(worker, request);
    } catch (const InputError& error) {  // the problem itself is refused
        run.status = "input";
        run.message = error.what();
    }
    return row_of(axis, task, request.problem.text(), run.status, judge(run, bounds), run.setup + run.solve,
                  run.peak_memory);
}

}  // namespace delassus::bench
