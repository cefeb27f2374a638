// SPDX-License-Identifier: BSD-3-Clause
#include "bench/worker_requests.hpp"

#include <algorithm>
#include <map>

#include "delassus/generate.hpp"
#include "delassus/problem_files.hpp"
#include "problem/errors_json.hpp"
#include "process/supervision.hpp"

namespace delassus::bench {

namespace {

/// Runs longer than this are repeated once only.
constexpr double long_run = 5.0;

/// Whether running again would say more about the time.
bool worth_repeating(Status status) {
    switch (status) {
        case Status::Solved:
        case Status::IterationLimit:
        case Status::Stalled:
        case Status::Infeasible:
        case Status::FalseClaim:
            return true;
        default:
            return false;
    }
}

}  // namespace

Problem read_source(const Json& source) {
    return source.is_string() ? read_problem(source.get<std::string>())
                              : generate(source.at("generate").get<std::string>(),
                                         source.at("parameters").get<std::map<std::string, double>>());
}

SolverConfig solver_of(const Json& request) {
    SolverConfig config;
    config.name = request.at("solver");
    config.options = request.at("options").get<OptionTexts>();
    return config;
}

SolveSettings settings_of(const Json& request) {
    SolveSettings settings;
    settings.tolerance = request.at("tolerance");
    settings.max_iterations = request.at("max_iterations");
    settings.time_limit = request.at("time_limit");
    settings.cancelled = interrupted;
    return settings;
}

std::vector<std::filesystem::path> plugin_path_of(const Json& request) {
    std::vector<std::filesystem::path> folders;
    for (const auto& folder : request.at("plugin_path")) folders.emplace_back(folder.get<std::string>());
    return folders;
}

int repeats_of(const Json& request, const SolveReport& report) {
    const int repeats = worth_repeating(report.status) ? request.at("repeats").get<int>() : 0;
    return report.seconds_setup + report.seconds_solve > long_run ? std::min(repeats, 1) : repeats;
}

Json sample_json(const CurveSample& sample) {
    return {{"iteration", sample.iteration},
            {"seconds", json_number(sample.seconds)},
            {"natural", json_number(sample.natural)}};
}

Json recorded_json(const SolveReport& report, double velocity, double speed) {
    Json stages = Json::array();
    for (const StageReport& stage : report.stages) stages.push_back(stage.solver);
    const CurveSample last = report.curve.empty() ? CurveSample{} : report.curve.back();
    return {{"solver", report.solver},
            {"version", report.version},
            {"status", name_of(report.status)},
            {"message", report.message},
            {"iterations", report.iterations},
            {"setup", report.seconds_setup},
            {"solve", report.seconds_solve},
            {"analyses", report.analyses},
            {"factorizations", report.factorizations},
            {"error", errors_json(report.error)},
            {"velocity", json_number(velocity)},
            {"speed", json_number(speed)},
            {"stages", stages},
            {"last", {last.iteration, json_number(last.seconds), json_number(last.natural)}}};
}

Json repeat_json(const SolveReport& report) {
    return {{"status", name_of(report.status)}, {"setup", report.seconds_setup}, {"solve", report.seconds_solve}};
}

}  // namespace delassus::bench
