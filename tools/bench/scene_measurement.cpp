// SPDX-License-Identifier: BSD-3-Clause
#include "bench/scene_measurement.hpp"

#include <algorithm>

#include "bench/ask.hpp"

namespace delassus::bench {

namespace {

Json scene_fields(const char* task, const WorkerSettings& worker, const SceneSource& scene) {
    Json fields = {{"do", task},
                   {"scene", std::filesystem::absolute(scene.file).string()},
                   {"settings", Json(scene.settings)},
                   {"end", scene.end},
                   {"forced", scene.forced},
                   {"plugin_path", Json::array()}};
    for (const auto& folder : worker.plugin_path) fields["plugin_path"].push_back(folder.string());
    return fields;
}

}  // namespace

SceneFacts describe_scene(const WorkerSettings& worker, const SceneSource& scene) {
    SceneFacts facts;
    ask_for_facts(worker, scene_fields("plan", worker, scene), scene.file.string(),
                  [&](const std::string& event, const Json& line) {
                      if (event == "scene") {
                          facts.hash = line.at("hash");
                          facts.title = line.at("title");
                          facts.step = line.at("step");
                          facts.end = line.at("end");
                          facts.integrator = line.at("integrator");
                      } else if (event == "plan") {
                          facts.plan = line.at("systems");
                      }
                  });
    return facts;
}

SimulationMeasurement simulate(const WorkerSettings& worker, const SimulateRequest& request) {
    SimulationMeasurement row;
    Json question = scene_fields("simulate", worker, request.scene);
    question["timestepper"] = request.timestepper;
    question["step"] = request.step;
    question["solver"] = request.solver;
    question["time_limit"] = request.time_limit;
    question["repeats"] = request.repeats;
    question["watch"] = request.watch;
    question["reverse"] = request.reverse;
    question["body"] = request.body;
    question["state"] = request.state.string();
    question["reference"] = request.reference.string();
    bool done = false;
    const double run_limit = request.time_limit + grace_of(request.time_limit);
    const auto child = ask(worker, question, [&](const Json& line) -> double {
        const std::string event = line.at("event");
        if (event == "begin") return run_limit;
        if (event == "recorded") {
            row.status = line.at("status");
            row.message = line.at("message");
            row.setup = number_of(line.at("setup"));
            row.seconds = number_of(line.at("seconds"));
            if (line.contains("error")) {
                row.position = number_of(line.at("error").at("position"));
                row.velocity = number_of(line.at("error").at("velocity"));
            }
            row.watched = line.at("watched");
            row.totals = line;
            for (const char* own : {"event", "status", "message", "setup", "seconds", "error", "watched"})
                row.totals.erase(own);
        } else if (event == "repeat") {
            row.repeats.push_back(number_of(line.at("seconds")));
            const bool first = row.repeats.size() == 1;
            row.setup = first ? number_of(line.at("setup")) : std::min(row.setup, number_of(line.at("setup")));
            row.seconds = first ? row.repeats.back() : std::min(row.seconds, row.repeats.back());
        } else if (event == "refused") {
            row.status = "unsupported";
            row.message = line.at("message");
        } else if (event == "failed") {
            if (row.status.empty()) row.status = status_of_failure(line.at("kind"));
            append(row.message, line.at("message").get<std::string>());
            done = true;
            return exit_limit;
        } else if (event == "done") {
            row.libraries = line.at("libraries").get<std::vector<std::string>>();
            hear_builds(line, worker, row.message);
            done = true;
            return exit_limit;
        }
        return loading_limit;
    });
    judge_end(row.status, row.message, child, worker, request.time_limit, done, {});
    row.peak_memory = child.peak_memory;
    return row;
}

}  // namespace delassus::bench
