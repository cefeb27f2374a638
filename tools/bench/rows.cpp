// SPDX-License-Identifier: BSD-3-Clause
#include "bench/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problem/cone_kinds.hpp"

namespace delassus::bench {

namespace {

/// The natural error is relative to what the reactions have to correct: λ = 0 has about 1. Beyond this an iterate has
/// gone away from the solution, not towards it.
constexpr double diverged_error = 1e3;

/// Blocks that can open, slide or reach a bound; the rows where there are none.
std::int64_t size_of(const ProblemFacts& facts) {
    std::int64_t size = 0;
    for (const auto& [kind, count] : facts.cones)
        if (const auto* row = find_cone_kind(kind); row && !row->is_linear) size += count;
    return size > 0 ? size : facts.m;
}

}  // namespace

std::string cause_of(const Measurement& row) {
    const std::string& status = row.status;
    if (status == "solved") return {};
    if (status == "hung") return "time_limit";
    const bool limit =
        status == "iteration_limit" || status == "time_limit" || status == "stalled" || status == "numerical_failure";
    if (limit && row.error && !(row.error->natural <= diverged_error)) return "diverged";
    return status;
}

std::string cause_of(const SimulationMeasurement& row) {
    if (row.status == "finished") return {};
    if (row.status == "failed") return "step_failure";
    if (row.status == "hung") return "time_limit";
    return row.status;
}

Json problem_row(const ProblemFacts& facts, const SuiteProblem& problem) {
    Json cones = Json::object();
    for (const auto& [kind, count] : facts.cones) cones[kind] = count;
    return {{"kind", "problem"},
            {"problem", facts.hash},
            {"name", problem.name.empty() ? facts.name : problem.name},
            {"from", problem.source.text()},
            {"source", facts.source},
            {"n", facts.n},
            {"m", facts.m},
            {"law", facts.law},
            {"structure", facts.structure},
            {"cones", cones},
            {"size", size_of(facts)},
            {"family", problem.family.empty() ? Json(nullptr) : Json(problem.family)}};
}

namespace {

/// What the processes of a problem in parts had, and what it cost them; null where it was whole.
Json parts_json(const Measurement& row) {
    if (row.by_process.empty()) return nullptr;
    std::int64_t ghosts = 0, most = 0, all = 0, bytes = 0;
    bool told = true;
    Json list = Json::array();
    for (const ProcessFigures& one : row.by_process) {
        ghosts += one.ghosts;
        most = std::max(most, one.n + one.m);
        all += one.n + one.m;
        told = told && one.bytes_sent;
        bytes += one.bytes_sent.value_or(0);
        Json seconds = Json::object();
        for (const auto& [phase, value] : one.phases) seconds[phase] = json_number(value);
        list.push_back({{"n", one.n},
                        {"m", one.m},
                        {"ghosts", one.ghosts},
                        {"peak_memory", one.peak_memory},
                        {"bytes_sent", one.bytes_sent ? Json(*one.bytes_sent) : Json(nullptr)},
                        {"seconds", seconds}});
    }
    const bool iterated = row.iterations && *row.iterations > 0;
    return {
        {"bytes_an_iteration",
         told && iterated ? Json(static_cast<double>(bytes) / static_cast<double>(*row.iterations)) : Json(nullptr)},
        {"ghosts", ghosts},
        {"imbalance", all > 0 ? Json(static_cast<double>(most) * static_cast<double>(row.by_process.size()) /
                                     static_cast<double>(all))
                              : Json(nullptr)},
        {"by_process", list}};
}

}  // namespace

Json solve_row(const std::string& key, const std::string& problem, const std::string& law, double tolerance,
               const Measurement& row) {
    Json json = {{"kind", "solve"},       {"key", key}, {"problem", problem}, {"law", law}, {"tolerance", tolerance},
                 {"cause", cause_of(row)}};
    json.update(json_of(row));
    json["seconds"]["recorded"] = {json_number(row.recorded.setup), json_number(row.recorded.solve)};
    json["stages"] = row.stages;
    json["method"] = row.method;
    json["processes"] = row.processes;
    json["parts"] = parts_json(row);
    return json;
}

Json skipped_row(const std::string& key, const std::string& problem, const std::string& law, double tolerance,
                 const SolverConfig& solver, int processes, const RunEnd& end, double looser) {
    Measurement row;
    row.method = label_of(solver);
    row.processes = processes;
    row.label = label_in_parts(row.method, processes);
    row.solver = solver.name;
    row.options = solver.options;
    row.status = end.status;
    std::string spoken = end.status;
    std::replace(spoken.begin(), spoken.end(), '_', ' ');
    row.message = fmt::format("not run: ended with {} at {:g} already", spoken, looser);
    Json json = solve_row(key, problem, law, tolerance, row);
    json["cause"] = end.cause;
    json["skipped_after"] = looser;
    return json;
}

namespace {

Json json_of(const SimulationMeasurement& row) {
    return {{"status", row.status},
            {"cause", cause_of(row)},
            {"message", row.message},
            {"seconds",
             {{"setup", json_number(row.setup)}, {"stepping", json_number(row.seconds)}, {"repeats", row.repeats}}},
            {"error", {{"position", json_number(row.position)}, {"velocity", json_number(row.velocity)}}},
            {"totals", row.totals},
            {"peak_memory", row.peak_memory}};
}

}  // namespace

Json simulation_row(const std::string& key, const std::string& scene, const SimulateRequest& request,
                    const SimulationMeasurement& row) {
    Json json = {
        {"kind", "simulation"}, {"key", key},
        {"scene", scene},       {"timestepper", request.timestepper.empty() ? "the scene's own" : request.timestepper},
        {"step", request.step}, {"solver", request.solver}};
    json.update(json_of(row));
    return json;
}

Json leaving_out_row(const std::string& key, const SuiteScene& scene, const SceneFacts& facts,
                     const SimulationMeasurement& as_is, const SimulationMeasurement& forced) {
    Json row = {{"kind", "leaving_out"},
                {"key", key},
                {"scene", facts.hash},
                {"name", scene.name},
                {"title", facts.title},
                {"file", std::filesystem::absolute(scene.source.file).lexically_normal().string()},
                {"set", Json(scene.source.settings)},
                {"end", facts.end},
                {"left_out", Json::array()}};
    for (const Json& system : facts.plan)
        for (const Json& line : system.at("left_out")) row["left_out"].push_back(line);
    for (const auto& [name, run] : {std::pair("as_is", &as_is), std::pair("forced", &forced)}) {
        row[name] = json_of(*run);
        row[name]["libraries"] = run->libraries;
    }
    return row;
}

}  // namespace delassus::bench
