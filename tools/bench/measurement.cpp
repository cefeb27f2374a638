// SPDX-License-Identifier: BSD-3-Clause
#include "bench/measurement.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/ask.hpp"
#include "problem/errors_json.hpp"

namespace delassus::bench {

namespace {

Json problem_fields(const char* task, const ProblemSource& problem, const std::string& law) {
    const Json source = problem.generator.empty()
                            ? Json(std::filesystem::absolute(problem.path).string())
                            : Json{{"generate", problem.generator}, {"parameters", problem.parameters}};
    return {{"do", task}, {"problem", source}, {"law", law}};
}

std::string reached(const Measurement& row) {
    if (row.curve.empty()) return "before its first iterate";
    const CurveSample& last = row.curve.back();
    return fmt::format("after iteration {}, natural error {:.2e}, {:.3g} s", last.iteration, last.natural,
                       last.seconds);
}

}  // namespace

std::string ProblemSource::text() const {
    if (generator.empty()) return path.string();
    std::string command = "delassus generate " + generator;
    for (const auto& [key, value] : parameters) command += fmt::format(" --set {}={}", key, value);
    return command;
}

double grace_of(double time_limit) {
    return 2.0 + 0.2 * time_limit;
}

std::string label_of(const SolverConfig& solver) {
    const std::string name = solver.name.find('/') == std::string::npos
                                 ? solver.name
                                 : std::filesystem::path(solver.name).filename().string();
    std::string options;
    for (const auto& [key, value] : solver.options)
        options += fmt::format("{}{}={}", options.empty() ? "" : ",", key, value);
    return options.empty() ? name : fmt::format("{}({})", name, options);
}

Measurement measure(const WorkerSettings& worker, const MeasureRequest& request,
                    const std::function<void(const CurveSample&)>& on_sample) {
    const ComparisonSettings& settings = request.settings;
    Measurement row;
    row.label = label_of(request.solver);
    row.solver = request.solver.name;
    row.options = request.solver.options;

    Json question = problem_fields("measure", request.problem, settings.law);
    question["solver"] = request.solver.name;
    question["options"] = request.solver.options;
    question["tolerance"] = settings.tolerance;
    question["max_iterations"] = settings.max_iterations;
    question["time_limit"] = settings.time_limit;
    question["repeats"] = settings.repeats;
    question["solution"] = request.solution.string();
    question["reference"] = request.reference.string();
    question["plugin_path"] = Json::array();
    for (const auto& folder : worker.plugin_path) question["plugin_path"].push_back(folder.string());

    const double run_limit = settings.time_limit + grace_of(settings.time_limit);
    bool done = false;
    const auto hear = [&](const Json& line) -> double {
        const std::string event = line.at("event");
        if (event == "begin") return run_limit;
        if (event == "sample") {
            const CurveSample sample{line.at("iteration").get<std::int64_t>(), number_of(line.at("seconds")),
                                     number_of(line.at("natural"))};
            row.curve.push_back(sample);
            if (on_sample) on_sample(sample);
            return run_limit;
        }
        if (event == "refused") {
            row.status = "unsupported";
            row.message = line.at("message");
        } else if (event == "recorded") {
            row.solver = line.at("solver");
            row.version = line.at("version");
            row.status = line.at("status");
            row.message = line.at("message");
            row.iterations = line.at("iterations").get<std::int64_t>();
            row.setup = number_of(line.at("setup"));
            row.solve = number_of(line.at("solve"));
            row.analyses = line.at("analyses");
            row.factorizations = line.at("factorizations");
            row.recorded = {row.setup, row.solve};
            row.stages = line.at("stages").get<std::vector<std::string>>();
            row.velocity = number_of(line.at("velocity"));
            row.speed = number_of(line.at("speed"));
            row.error = errors_in(line.at("error"));
            const Json& last = line.at("last");
            row.curve.push_back({last[0].get<std::int64_t>(), number_of(last[1]), number_of(last[2])});
        } else if (event == "repeat") {
            if (line.at("status") != row.status)
                append(row.message, fmt::format("a repeat ended with {}", line.at("status").get<std::string>()));
            row.repeats.push_back({number_of(line.at("setup")), number_of(line.at("solve"))});
        } else if (event == "failed") {
            if (row.status.empty()) row.status = status_of_failure(line.at("kind"));
            append(row.message, line.at("message").get<std::string>());
            done = true;
            return exit_limit;
        } else if (event == "done") {
            done = true;
            row.libraries = line.at("libraries").get<std::vector<std::string>>();
            if (const auto printed = line.at("printed").get<std::int64_t>(); printed > 0)
                append(row.message, fmt::format("wrote {} bytes to standard output; they were dropped", printed));
            return exit_limit;
        }
        return loading_limit;
    };
    const ChildResult child = ask(worker, question, hear);
    judge_end(row.status, row.message, child, worker, settings.time_limit, done, reached(row));
    row.peak_memory = child.peak_memory;
    for (const Repeat& repeat : row.repeats) {
        const bool first = &repeat == &row.repeats.front();
        row.setup = first ? repeat.setup : std::min(row.setup, repeat.setup);
        row.solve = first ? repeat.solve : std::min(row.solve, repeat.solve);
    }
    return row;
}

ProblemFacts describe(const WorkerSettings& worker, const ProblemSource& problem, const std::string& law) {
    ProblemFacts facts;
    ask_for_facts(worker, problem_fields("describe", problem, law), problem.text(),
                  [&](const std::string& event, const Json& line) {
                      if (event != "problem") return;
                      facts = {line.at("name"), line.at("law"),   line.at("structure"), line.at("n"), line.at("m"), {},
                               line.at("hash"), line.at("source")};
                      for (const auto& [kind, count] : line.at("cones").items()) facts.cones.emplace_back(kind, count);
                  });
    return facts;
}

std::vector<double> velocity_errors(const WorkerSettings& worker, const ProblemSource& problem,
                                    const std::filesystem::path& reference,
                                    const std::vector<std::filesystem::path>& solutions) {
    std::vector<double> errors(solutions.size(), unknown);
    Json question = problem_fields("velocity", problem, {});
    question["reference"] = reference.string();
    question["solutions"] = Json::array();
    for (const auto& folder : solutions) question["solutions"].push_back(folder.string());
    static_cast<void>(ask(worker, question, [&](const Json& line) {
        if (line.at("event") == "velocity")
            for (std::size_t k = 0; k < errors.size(); ++k) errors[k] = number_of(line.at("errors").at(k));
        return loading_limit;
    }));
    return errors;
}

}  // namespace delassus::bench
