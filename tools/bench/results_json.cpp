// SPDX-License-Identifier: BSD-3-Clause
#include "bench/measures.hpp"
#include "bench/rows.hpp"
#include "bench/writers.hpp"
#include "problem/errors_json.hpp"

namespace delassus::bench {

Json json_of(const Measurement& row) {
    Json repeats = Json::array();
    for (const Repeat& repeat : row.repeats) repeats.push_back({json_number(repeat.setup), json_number(repeat.solve)});
    Json error = nullptr;
    if (row.error) {
        error = errors_json(*row.error);
        error["velocity"] = json_number(row.velocity);
    }
    Json curve = Json::array();
    for (const CurveSample& sample : row.curve)
        curve.push_back({sample.iteration, json_number(sample.seconds), json_number(sample.natural)});
    return {{"label", row.label},
            {"solver", row.solver},
            {"version", row.version},
            {"options", Json(row.options)},
            {"status", row.status},
            {"message", row.message},
            {"iterations", row.iterations ? Json(*row.iterations) : Json(nullptr)},
            {"seconds", {{"setup", json_number(row.setup)}, {"solve", json_number(row.solve)}, {"repeats", repeats}}},
            {"analyses", row.analyses},
            {"factorizations", row.factorizations},
            {"error", error},
            {"peak_memory", row.peak_memory},
            {"curve", {{"columns", {"iteration", "seconds", "natural"}}, {"samples", curve}}}};
}

Json json_of(const Machine& machine) {
    return {{"processor", machine.processor},
            {"cores", machine.cores},
            {"memory", machine.memory},
            {"load", json_number(machine.load)},
            {"system", machine.system}};
}

Json json_of(const Build& build) {
    return {{"compiler", build.compiler}, {"type", build.type}, {"flags", build.flags}};
}

namespace {

Json json_of(const ProblemResults& problem) {
    const ProblemFacts& facts = problem.facts;
    Json cones = Json::object();
    for (const auto& [kind, count] : facts.cones) cones[kind] = count;
    Json results = Json::array();
    for (const auto& row : problem.results) results.push_back(bench::json_of(row));
    return {
        {"name", facts.name},
        {"path", problem.path.string()},
        {"n", facts.n},
        {"m", facts.m},
        {"law", facts.law},
        {"structure", facts.structure},
        {"cones", cones},
        {"velocity_reference", problem.velocity_reference.empty() ? Json(nullptr) : Json(problem.velocity_reference)},
        {"results", results}};
}

}  // namespace

std::string json_text(const Comparison& comparison) {
    const auto& settings = comparison.settings;
    Json problems = Json::array();
    for (const auto& problem : comparison.problems) problems.push_back(json_of(problem));
    const Json json = {{"format", "delassus-comparison"},
                       {"version", 1},
                       {"created", comparison.created},
                       {"command", comparison.command},
                       {"folder", comparison.folder},
                       {"delassus", comparison.build.version},
                       {"build", bench::json_of(comparison.build)},
                       {"machine", bench::json_of(comparison.machine)},
                       {"settings",
                        {{"tolerance", settings.tolerance},
                         {"time_limit", settings.time_limit},
                         {"max_iterations", settings.max_iterations},
                         {"repeats", settings.repeats},
                         {"law", settings.law.empty() ? Json(nullptr) : Json(settings.law)}}},
                       {"interrupted", comparison.interrupted},
                       {"measures", answer_measures_json()},
                       {"problems", problems}};
    return json_text(json, 1) + "\n";
}

}  // namespace delassus::bench
