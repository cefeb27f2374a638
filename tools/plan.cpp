// SPDX-License-Identifier: BSD-3-Clause
// delassus plan: what a scene needs and what it does without.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "command.hpp"
#include "delassus/plan.hpp"
#include "process/stdout_guard.hpp"
#include "scene_arguments.hpp"

namespace delassus::command {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const std::vector<PlanLine>& lines) {
    Json json = Json::array();
    for (const auto& line : lines) json.push_back({{"what", line.what}, {"reason", line.reason}});
    return json;
}

void print_lines(std::string_view title, const std::vector<PlanLine>& lines) {
    fmt::print("  {}\n", title);
    for (const auto& line : lines) fmt::print("    {}: {}\n", line.what, line.reason);
}

int plan(const SceneArguments& arguments, bool as_json) {
    Scene scene = read(arguments);
    const Registry registry(absolute(arguments.plugin_path));
    StdoutGuard guard;
    const auto plans = make_plan(scene, registry);
    guard.release();
    if (as_json) {
        Json json = {{"scene", arguments.file.filename().string()}, {"systems", Json::array()}};
        for (const auto& one : plans)
            json["systems"].push_back({{"name", one.name},
                                       {"velocities", one.velocities},
                                       {"constraints", one.constraints},
                                       {"parts", one.parts},
                                       {"kept", json_of(one.kept)},
                                       {"left_out", json_of(one.left_out)},
                                       {"solvers", one.solvers},
                                       {"later_solvers", one.later_solvers},
                                       {"libraries", one.libraries}});
        fmt::print("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
        return exit_solved;
    }
    for (const auto& one : plans) {
        fmt::print("{}: {} velocities, {} rows of bilateral constraints\n", one.name, one.velocities, one.constraints);
        print_lines("kept", one.kept);
        print_lines("left out", one.left_out);
        fmt::print("  libraries: {}\n", one.libraries.empty() ? std::string("none beyond libdelassus")
                                                              : fmt::format("{}", fmt::join(one.libraries, ", ")));
    }
    return exit_solved;
}

}  // namespace

void add_plan(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<SceneArguments>();
    auto json = std::make_shared<bool>(false);
    auto* command = program.add_subcommand("plan", "Say what a scene needs and what is left out of it");
    add_scene_arguments(*command, *arguments);
    command->add_flag("--json", *json, "Print the plan as JSON");
    command->callback(
        [arguments, json, &action] { action.run = [arguments, json] { return plan(*arguments, *json); }; });
}

}  // namespace delassus::command
