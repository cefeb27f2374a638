// SPDX-License-Identifier: BSD-3-Clause
#include "scene_arguments.hpp"

#include "command.hpp"

namespace delassus::command {

void add_scene_arguments(CLI::App& command, SceneArguments& arguments) {
    command.add_option("scene", arguments.file, "Scene file (YAML)")->required()->type_name("SCENE");
    command.add_option("--solver", arguments.solver, "Solver of every system in place of the file's")
        ->type_name("SOLVER[(KEY=VALUE,…)]");
    add_law(command, arguments.law, "Law of friction of every system");
    command.add_option("--integrator", arguments.integrator, "Timestepper of every system in place of the file's")
        ->type_name("METHOD[(KEY=VALUE,…)]");
    command.add_option("--set", arguments.settings, "Value of the file to change, e.g. bodies.ball.mass=2")
        ->type_name("PATH=VALUE")
        ->expected(1)
        ->take_all();
    command.add_option("--step", arguments.step, "Step of every system in place of the file's")->type_name("SECONDS");
    command.add_option("--tolerance", arguments.tolerance, "Tolerance of every system, from which the steps follow")
        ->type_name("M_OR_RAD");
    command.add_option("--accuracy", arguments.accuracy, "Accuracy of every system, for which steps are divided")
        ->type_name("SHARE");
    command.add_option("--end", arguments.end, "End of every system in place of the file's")->type_name("SECONDS");
    add_plugin_path(command, arguments.plugin_path);
}

Scene read(const SceneArguments& arguments) {
    SceneOverrides overrides;
    for (const auto& setting : arguments.settings) overrides.values.push_back(parse_setting(setting));
    overrides.solver = arguments.solver;
    if (!arguments.law.empty()) overrides.law = law_of(arguments.law);
    overrides.integrator = arguments.integrator;
    overrides.step = arguments.step;
    overrides.tolerance = arguments.tolerance;
    overrides.accuracy = arguments.accuracy;
    overrides.end = arguments.end;
    return read_scene(arguments.file, overrides);
}

}  // namespace delassus::command
