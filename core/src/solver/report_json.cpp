// SPDX-License-Identifier: BSD-3-Clause
#include "solver/report_json.hpp"

#include "problem/errors_json.hpp"

namespace delassus {

using Json = nlohmann::ordered_json;

Json report_json(const SolveReport& report) {
    Json json = {{"problem", report.problem},
                 {"solver", report.solver},
                 {"version", report.version},
                 {"options", report.options},
                 {"law", name_of(report.law)},
                 {"tolerance", report.tolerance},
                 {"status", name_of(report.status)},
                 {"message", report.message},
                 {"iterations", report.iterations},
                 {"seconds", {{"setup", report.seconds_setup}, {"solve", report.seconds_solve}}},
                 {"analyses", report.analyses},
                 {"factorizations", report.factorizations},
                 {"claimed_residual", json_number(report.claimed_residual)},
                 {"error", errors_json(report.error)}};
    if (!report.stages.empty()) {
        Json stages = Json::array();
        for (const auto& stage : report.stages)
            stages.push_back({{"solver", stage.solver},
                              {"options", stage.options},
                              {"law", name_of(stage.law)},
                              {"reason", stage.reason},
                              {"tolerance", stage.tolerance},
                              {"status", name_of(stage.status)},
                              {"message", stage.message},
                              {"iterations", stage.iterations},
                              {"seconds", stage.seconds},
                              {"natural", json_number(stage.natural)}});
        json["stages"] = std::move(stages);
    }
    if (!report.curve.empty()) {
        Json curve = Json::array();
        for (const auto& sample : report.curve) curve.push_back({sample.iteration, sample.seconds, sample.natural});
        json["curve"] = {{"columns", {"iteration", "seconds", "natural"}}, {"samples", std::move(curve)}};
    }
    return json;
}

std::string to_json(const SolveReport& report) {
    return json_text(report_json(report), 2) + "\n";
}

}  // namespace delassus
