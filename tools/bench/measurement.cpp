// SPDX-License-Identifier: BSD-3-Clause
#include "bench/measurement.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "bench/ask.hpp"
#include "delassus/error.hpp"
#include "delassus/partitioned_files.hpp"
#include "problem/errors_json.hpp"

namespace delassus::bench {

namespace {

Json problem_fields(const char* task, const ProblemSource& problem, const std::string& law) {
    const Json source = problem.generator.empty()
                            ? Json(std::filesystem::absolute(problem.path).string())
                            : Json{{"generate", problem.generator}, {"parameters", problem.parameters}};
    return {{"do", task}, {"problem", source}, {"law", law}};
}

/// Those of the fastest run so far are kept.
void hear_figures(const Json& list, Measurement& row) {
    const auto latest = row.repeats.empty() ? row.solve : row.repeats.back().solve;
    for (std::size_t k = 0; k + 1 < row.repeats.size(); ++k)
        if (row.repeats[k].solve < latest) return;
    row.by_process.clear();
    for (const Json& one : list) {
        ProcessFigures figures{one.at("n"), one.at("m"), one.at("ghosts"), one.at("peak_memory"), {}, {}};
        if (!one.at("bytes_sent").is_null()) figures.bytes_sent = one.at("bytes_sent").get<std::int64_t>();
        for (const auto& [phase, seconds] : one.at("seconds").items())
            figures.phases.emplace_back(phase, number_of(seconds));
        row.by_process.push_back(std::move(figures));
    }
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

std::string label_in_parts(const std::string& method, int processes) {
    return processes > 1 ? fmt::format("{}, {} processes", method, processes) : method;
}

Measurement measure(const WorkerSettings& worker, const MeasureRequest& request,
                    const std::function<void(const CurveSample&)>& on_sample) {
    const ComparisonSettings& settings = request.settings;
    Measurement row;
    row.method = label_of(request.solver);
    row.processes = std::max(1, request.processes);
    row.label = label_in_parts(row.method, row.processes);
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
    question["parts"] = request.processes > 0;
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
        } else if (event == "processes") {
            hear_figures(line.at("processes"), row);
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
            hear_builds(line, worker, row.message);
            return exit_limit;
        }
        return loading_limit;
    };
    const ChildResult child = ask(worker, question, hear, row.processes);
    judge_end(row.status, row.message, child, worker, settings.time_limit, done, reached(row));
    row.peak_memory = child.peak_memory;
    for (const ProcessFigures& one : row.by_process) row.peak_memory = std::max(row.peak_memory, one.peak_memory);
    for (const Repeat& repeat : row.repeats) {
        const bool first = &repeat == &row.repeats.front();
        row.setup = first ? repeat.setup : std::min(row.setup, repeat.setup);
        row.solve = first ? repeat.solve : std::min(row.solve, repeat.solve);
    }
    return row;
}

ProblemFacts describe(const WorkerSettings& worker, const ProblemSource& problem, const std::string& law,
                      int processes) {
    ProblemFacts facts;
    const auto hear = [&](const std::string& event, const Json& line) {
        if (event != "problem") return;
        facts = {line.at("name"), line.at("law"),   line.at("structure"), line.at("n"), line.at("m"), {},
                 line.at("hash"), line.at("source")};
        for (const auto& [kind, count] : line.at("cones").items()) facts.cones.emplace_back(kind, count);
    };
    Json question = problem_fields("describe", problem, law);
    const bool made_to_be_shared =
        problem.generator == "pile" || (problem.generator.empty() && is_partitioned_file(problem.path));
    question["parts"] = processes > 0 && made_to_be_shared;
    ask_for_facts(worker, question, problem.text(), hear, processes > 0 && made_to_be_shared ? processes : 1);
    return facts;
}

std::filesystem::path find_launcher(const WorkerSettings& worker, int processes) {
    WorkerSettings with = worker;
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; with.launcher.empty() && std::getline(folders, folder, ':');)
        if (const auto program = std::filesystem::path(folder) / "mpirun";
            !folder.empty() && access(program.c_str(), X_OK) == 0)
            with.launcher = program;
    if (with.launcher.empty())
        throw InputError(
            "the suite asks for several processes, and there is no mpirun in PATH to start them (Debian: openmpi-bin)");
    std::string failure;
    bool done = false;
    const ChildResult child = ask(
        with, Json{{"do", "ping"}},
        [&](const Json& line) {
            if (line.at("event") == "failed") failure = line.at("message");
            done = done || line.at("event") == "done";
            return start_limit;
        },
        processes);
    if (child.cancelled) throw Error("interrupted while " + with.launcher.string() + " started its first processes");
    if (done) return with.launcher;
    if (failure.empty()) failure = last_line(child.errors);
    if (geteuid() == 0 && child.errors.find("root") != std::string::npos)
        failure =
            "it does not run as root unless OMPI_ALLOW_RUN_AS_ROOT and OMPI_ALLOW_RUN_AS_ROOT_CONFIRM are set to 1";
    throw InputError(fmt::format("{} did not start {} processes: {}", with.launcher.string(), processes,
                                 failure.empty() ? "it gave no reason" : failure));
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
