// SPDX-License-Identifier: BSD-3-Clause
// delassus equilibrium: the static equilibrium of a scene.
#include "delassus/equilibrium.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/timestepper.hpp"
#include "output/vtk_series.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "scene_arguments.hpp"
#include "support/atomic_file.hpp"
#include "support/json.hpp"
#include "support/json_number.hpp"

namespace delassus::command {

namespace {

using Json = nlohmann::ordered_json;

struct EquilibriumArguments {
    SceneArguments scene;
    std::filesystem::path output;
    std::optional<std::int32_t> load_steps;
    std::optional<double> tolerance;
    bool json = false;
};

std::string_view stability_of(const Equilibrium& found) {
    if (std::isnan(found.smallest_eigenvalue)) return "not judged";
    if (found.smallest_eigenvalue < 0.0) return "unstable";
    return found.smallest_eigenvalue > 0.0 ? "stable" : "neutral";
}

Json json_of(const SceneSystem& system, const Equilibrium& found) {
    const MultibodySystem& mechanics = *system.system;
    Json steps = Json::array(), bodies = Json::object(), nodes = Json::object(), joints = Json::object();
    for (const LoadStep& step : found.load_steps)
        steps.push_back({{"load", step.load},
                         {"steps", step.steps},
                         {"newton_iterations", step.newton_iterations},
                         {"residual", json_number(step.residual)},
                         {"energy", json_number(step.energy)}});
    for (BodyIndex i = 0; i < mechanics.body_count(); ++i) {
        const Pose pose = mechanics.pose(found.state, i);
        bodies[mechanics.body(i).name] = {{"position", pose.position}, {"orientation", pose.orientation}};
    }
    for (std::size_t i = 0; i < system.nodes.size(); ++i)
        nodes[system.nodes[i].name] = {
            {"position", mechanics.node_position(found.state, static_cast<std::int32_t>(i))}};
    const auto multipliers = mechanics.all_multipliers(found.multipliers);
    for (std::size_t i = 0; i < system.joints.size(); ++i) {
        const auto [first, count] = mechanics.joint_rows(static_cast<std::int32_t>(i));
        joints[system.joints[i].name] =
            std::vector<double>(multipliers.begin() + first, multipliers.begin() + first + count);
    }
    return {{"name", system.name},
            {"load_steps", std::move(steps)},
            {"residual", json_number(found.load_steps.back().residual)},
            {"largest_force", json_number(found.largest_force)},
            {"energy", json_number(found.load_steps.back().energy)},
            {"stability", stability_of(found)},
            {"smallest_eigenvalue", json_number(found.smallest_eigenvalue)},
            {"bodies", std::move(bodies)},
            {"nodes", std::move(nodes)},
            {"reactions", std::move(joints)}};
}

void print_summary(const SceneSystem& system, const Equilibrium& found) {
    std::int64_t steps = 0, iterations = 0;
    for (const LoadStep& step : found.load_steps) {
        steps += step.steps;
        iterations += step.newton_iterations;
    }
    const LoadStep& last = found.load_steps.back();
    fmt::print("{}: equilibrium after {} load steps, {} steps of the search, {} Newton iterations\n", system.name,
               found.load_steps.size(), steps, iterations);
    fmt::print("  largest unbalanced force {:.1e}, of forces up to {:.3g} (N, Nm)\n", last.residual,
               found.largest_force);
    if (std::isfinite(last.energy)) fmt::print("  energy {:.6g} J\n", last.energy);
    fmt::print("  {}", stability_of(found));
    if (!std::isnan(found.smallest_eigenvalue))
        fmt::print(": smallest eigenvalue {:.6g} rad²/s²", found.smallest_eigenvalue);
    fmt::print("\n");
}

/// Makes the folder for the frames, in place of those of an earlier search.
void make_folder(const std::filesystem::path& output, const std::filesystem::path& frames) {
    if (std::filesystem::exists(output)) {
        const bool earlier = std::filesystem::exists(output / "equilibrium.json");
        if (!std::filesystem::is_directory(output) || (!earlier && !std::filesystem::is_empty(output)))
            throw InputError(fmt::format("{} contains something else than an earlier equilibrium; name another folder",
                                         output.string()));
        std::filesystem::remove_all(frames);
    }
    std::filesystem::create_directories(frames);
}

int equilibrium(const EquilibriumArguments& arguments) {
    Scene scene = read(arguments.scene);
    const Registry registry(absolute(arguments.scene.plugin_path));
    const std::filesystem::path frames = arguments.output / "vtk";
    if (!arguments.output.empty()) make_folder(arguments.output, frames);
    install_interrupt_handler();
    install_crash_handler("a solver plugin", exit_not_converged);
    StdoutGuard guard;
    Json report = {
        {"scene", arguments.scene.file.filename().string()}, {"title", scene.title}, {"systems", Json::array()}};
    std::vector<Equilibrium> all;
    std::vector<VtkSeries> series;
    series.reserve(scene.systems.size());
    std::vector<std::vector<double>> loads(scene.systems.size());
    for (std::size_t i = 0; i < scene.systems.size(); ++i) {
        SceneSystem& system = scene.systems[i];
        EquilibriumRule rule = system.equilibrium.value_or(EquilibriumRule{});
        if (arguments.load_steps) rule.load_steps = *arguments.load_steps;
        if (arguments.tolerance) rule.tolerance = *arguments.tolerance;
        if (rule.load_steps < 1) throw InputError("--load-steps must be at least 1");
        if (!(rule.tolerance > 0.0)) throw InputError("--equilibrium-tolerance must be positive");
        system.equilibrium = rule;
        series.emplace_back(frames, system.name, *system.system);
        const auto write = [&](const LoadStep& step, const State& state) {
            if (arguments.output.empty()) return;
            State frame = state;
            frame.t = step.load;
            series[i].write(static_cast<std::int64_t>(loads[i].size()), frame);
            loads[i].push_back(step.load);
        };
        try {
            all.push_back(find_equilibrium(system, registry, write, interrupted));
        } catch (const StepFailure& error) {
            guard.release();
            fmt::print(stderr, "delassus: {}\n", error.what());
            return exit_not_converged;
        }
        report["systems"].push_back(json_of(system, all.back()));
    }
    guard.release();
    if (!arguments.output.empty()) {
        std::vector<VtkCollectionPart> parts;
        for (std::size_t i = 0; i < series.size(); ++i) parts.push_back({&series[i], &loads[i]});
        write_vtk_collection(arguments.output / "equilibrium.pvd", "vtk", parts);
        write_file_atomically(arguments.output / "equilibrium.json", json_text(report) + "\n");
    }
    if (arguments.json) {
        fmt::print("{}\n", json_text(report));
    } else {
        for (std::size_t i = 0; i < all.size(); ++i) print_summary(scene.systems[i], all[i]);
    }
    return exit_solved;
}

}  // namespace

void add_equilibrium(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<EquilibriumArguments>();
    auto* command = program.add_subcommand(
        "equilibrium", "Find the static equilibrium of a scene under its weight and its loads at t = 0");
    add_scene_arguments(*command, arguments->scene);
    command
        ->add_option("-o,--output", arguments->output,
                     "Folder for equilibrium.json and VTK files, a frame for each load step")
        ->type_name("DIR");
    command->add_option("--load-steps", arguments->load_steps, "Parts in which weight and loads are raised [10]")
        ->type_name("N");
    command
        ->add_option("--equilibrium-tolerance", arguments->tolerance,
                     "Last movement of the search over the whole way [1e-10]")
        ->type_name("EPS");
    command->add_flag("--json", arguments->json, "Print the report as JSON");
    command->callback([arguments, &action] { action.run = [arguments] { return equilibrium(*arguments); }; });
}

}  // namespace delassus::command
