// SPDX-License-Identifier: BSD-3-Clause
// delassus plan: what a scene needs and what it does without.
#include <fmt/format.h>

#include "command.hpp"
#include "delassus/plan.hpp"
#include "process/stdout_guard.hpp"
#include "scene_arguments.hpp"
#include "simulation/plan_json.hpp"

namespace delassus::command {

namespace {

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
        fmt::print("{}\n", plan_json(arguments.file.filename().string(), plans));
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
