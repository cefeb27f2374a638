// SPDX-License-Identifier: BSD-3-Clause
// delassus equilibrium: the static equilibrium of a scene, or the path of its equilibria.
#include "delassus/equilibrium.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/timestepper.hpp"
#include "output/vtk_series.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "scene_arguments.hpp"
#include "support/json.hpp"
#include "support/json_number.hpp"
#include "support/output_folder.hpp"

namespace delassus::command {

namespace {

using Json = nlohmann::ordered_json;

struct EquilibriumArguments {
    SceneArguments scene;
    std::filesystem::path output;
    std::optional<std::int32_t> load_steps;
    std::optional<double> tolerance;
    bool path = false;
    std::string until;
    std::optional<std::int32_t> points;
    std::vector<std::string> watch;
    bool json = false;
};

/// A body or a node of a system by its name.
struct Watched {
    std::string name;
    BodyIndex body = world_body;
    std::int32_t node = -1;

    [[nodiscard]] Vector3 place(const MultibodySystem& mechanics, const State& state) const {
        return node >= 0 ? mechanics.node_position(state, node) : mechanics.pose(state, body).position;
    }
};

Watched named(const SceneSystem& system, const std::string& name) {
    Watched found{.name = name, .body = system.system->find_body(name)};
    for (std::size_t i = 0; i < system.nodes.size() && found.body == world_body; ++i)
        if (system.nodes[i].name == name) found.node = static_cast<std::int32_t>(i);
    if (found.body == world_body && found.node < 0)
        throw InputError(fmt::format("the system \"{}\" has no body and no node \"{}\"", system.name, name));
    return found;
}

/// A load factor, or NAME.AXIS=METRES.
PathRule rule_of(const SceneSystem& system, const EquilibriumArguments& arguments) {
    PathRule rule;
    if (arguments.points) rule.most_points = *arguments.points;
    if (arguments.until.empty()) return rule;
    const auto number = [&](const std::string& text) {
        try {
            std::size_t read = 0;
            const double value = std::stod(text, &read);
            if (read == text.size()) return value;
        } catch (const std::exception&) {
        }
        throw InputError(
            fmt::format("--until is \"{}\"; it must be a load factor, or a displacement such as "
                        "rod_6.z=-0.5 (m)",
                        arguments.until));
    };
    const auto equals = arguments.until.find('=');
    if (equals == std::string::npos) {
        rule.load = number(arguments.until);
        return rule;
    }
    const std::string place = arguments.until.substr(0, equals);
    const std::string axes = "xyz";
    const auto axis = place.size() > 2 && place[place.size() - 2] == '.' ? axes.find(place.back()) : std::string::npos;
    if (axis == std::string::npos)
        throw InputError(fmt::format("--until names \"{}\"; it must be a body or a node with .x, .y or .z", place));
    const Watched watched = named(system, place.substr(0, place.size() - 2));
    rule.displacement = PathDisplacement{watched.body, watched.node, static_cast<int>(axis),
                                         number(arguments.until.substr(equals + 1))};
    return rule;
}

std::string_view name_of(PathMark mark) {
    return mark == PathMark::Limit ? "limit point" : mark == PathMark::Bifurcation ? "bifurcation" : "";
}

/// A path with what its points say of the bodies and nodes that are watched.
struct WatchedPath {
    EquilibriumPath path;
    std::vector<Watched> watched;
    std::vector<std::vector<Vector3>> displacements;  // of each, by point
};

std::string csv_of(const WatchedPath& found) {
    std::string text =
        "load,arc_length,largest_displacement,energy,negative_eigenvalues,newton_iterations,residual,mark";
    for (const Watched& one : found.watched)
        for (const char axis : {'x', 'y', 'z'}) text += fmt::format(",{}.{}", one.name, axis);
    text += '\n';
    for (std::size_t i = 0; i < found.path.points.size(); ++i) {
        const PathPoint& point = found.path.points[i];
        text += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{},{},{:.3g},{}", point.load, point.arc,
                            point.displacement, point.energy, point.negative_eigenvalues, point.newton_iterations,
                            point.residual, name_of(point.mark));
        for (const auto& of_one : found.displacements)
            for (const double value : of_one[i]) text += fmt::format(",{:.17g}", value);
        text += '\n';
    }
    return text;
}

Json json_of(const WatchedPath& found) {
    Json points = Json::array();
    for (std::size_t i = 0; i < found.path.points.size(); ++i) {
        const PathPoint& point = found.path.points[i];
        Json json = {{"load", point.load},
                     {"arc_length", point.arc},
                     {"largest_displacement", point.displacement},
                     {"energy", json_number(point.energy)},
                     {"negative_eigenvalues", point.negative_eigenvalues},
                     {"newton_iterations", point.newton_iterations},
                     {"residual", json_number(point.residual)}};
        if (point.mark != PathMark::None) json["mark"] = name_of(point.mark);
        for (std::size_t k = 0; k < found.watched.size(); ++k)
            json["displacements"][found.watched[k].name] = found.displacements[k][i];
        points.push_back(std::move(json));
    }
    return {{"complete", found.path.complete}, {"ending", found.path.ending}, {"points", std::move(points)}};
}

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

void print_end(const Equilibrium& found) {
    const LoadStep& last = found.load_steps.back();
    fmt::print("  largest unbalanced force {:.1e}, of forces up to {:.3g} (N, Nm)\n", last.residual,
               found.largest_force);
    if (std::isfinite(last.energy)) fmt::print("  energy {:.6g} J\n", last.energy);
    fmt::print("  {}", stability_of(found));
    if (!std::isnan(found.smallest_eigenvalue))
        fmt::print(": smallest eigenvalue {:.6g} rad²/s²", found.smallest_eigenvalue);
    fmt::print("\n");
}

void print_summary(const SceneSystem& system, const EquilibriumPath& found) {
    std::int64_t iterations = 0;
    for (const PathPoint& point : found.points) iterations += point.newton_iterations;
    const PathPoint& last = found.points.back();
    fmt::print("{}: path of {} equilibria to the load factor {:.9g}, {} Newton iterations\n", system.name,
               found.points.size(), last.load, iterations);
    for (const PathPoint& point : found.points)
        if (point.mark != PathMark::None)
            fmt::print("  {} at the load factor {:.9g}, largest displacement {:.6g} m\n", name_of(point.mark),
                       point.load, point.displacement);
    fmt::print("  at its end: largest displacement {:.6g} m\n", last.displacement);
    print_end(found.end);
}

void print_summary(const SceneSystem& system, const Equilibrium& found) {
    std::int64_t steps = 0, iterations = 0;
    for (const LoadStep& step : found.load_steps) {
        steps += step.steps;
        iterations += step.newton_iterations;
    }
    fmt::print("{}: equilibrium after {} load steps, {} steps of the search, {} Newton iterations\n", system.name,
               found.load_steps.size(), steps, iterations);
    print_end(found);
}

/// The system's rule ← with what the command line says. Throws InputError for arguments that do not fit.
void set_rule(SceneSystem& system, const EquilibriumArguments& arguments) {
    EquilibriumRule rule = system.equilibrium.value_or(EquilibriumRule{});
    if (arguments.load_steps) rule.load_steps = *arguments.load_steps;
    if (arguments.tolerance) rule.tolerance = *arguments.tolerance;
    if (rule.load_steps < 1) throw InputError("--load-steps must be at least 1");
    if (!(rule.tolerance > 0.0)) throw InputError("--equilibrium-tolerance must be positive");
    if (arguments.path) rule.method = EquilibriumMethod::ArcLength;
    system.equilibrium = rule;
    if (rule.method == EquilibriumMethod::ArcLength) {
        static_cast<void>(rule_of(system, arguments));
        for (const std::string& name : arguments.watch) static_cast<void>(named(system, name));
    } else if (!arguments.until.empty() || arguments.points || !arguments.watch.empty()) {
        throw InputError("--until, --points and --watch are for paths of equilibria; give --path too");
    }
}

/// Follows the path; write(arc length, state) is called with each point.
template <class Write>
WatchedPath path_of(SceneSystem& system, const Registry& registry, const EquilibriumArguments& arguments,
                    Write&& write) {
    const PathRule rule = rule_of(system, arguments);
    WatchedPath found;
    for (const std::string& name : arguments.watch) found.watched.push_back(named(system, name));
    found.displacements.resize(found.watched.size());
    const MultibodySystem& mechanics = *system.system;
    const auto note = [&](const PathPoint& point, const State& state) {
        write(point.arc, state);
        for (std::size_t k = 0; k < found.watched.size(); ++k) {
            const Vector3 now = found.watched[k].place(mechanics, state);
            const Vector3 start = found.watched[k].place(mechanics, mechanics.initial_state());
            found.displacements[k].push_back({now[0] - start[0], now[1] - start[1], now[2] - start[2]});
        }
    };
    found.path = follow_equilibria(system, registry, rule, note, interrupted);
    return found;
}

int equilibrium(const EquilibriumArguments& arguments) {
    Scene scene = read(arguments.scene);
    const Registry registry(absolute(arguments.scene.plugin_path));
    for (SceneSystem& system : scene.systems) set_rule(system, arguments);
    std::optional<OutputFolder> output;
    if (!arguments.output.empty()) {
        output.emplace(arguments.output, "equilibrium");
        output->clear();
        output->add_folder("vtk");
    }
    install_interrupt_handler();
    StdoutGuard guard;
    Json report = {
        {"scene", arguments.scene.file.filename().string()}, {"title", scene.title}, {"systems", Json::array()}};
    std::vector<Equilibrium> all;
    std::vector<std::optional<WatchedPath>> paths(scene.systems.size());
    int exit = exit_solved;
    std::vector<VtkSeries> series;
    series.reserve(scene.systems.size());
    std::vector<std::vector<double>> times(scene.systems.size());
    for (std::size_t i = 0; i < scene.systems.size(); ++i) {
        SceneSystem& system = scene.systems[i];
        const bool by_path = system.equilibrium->method == EquilibriumMethod::ArcLength;
        series.emplace_back(arguments.output / "vtk", system.name, *system.system);
        const auto write = [&](double time, const State& state) {
            if (!output) return;
            State frame = state;
            frame.t = time;
            const auto number = static_cast<std::int64_t>(times[i].size());
            output->add("vtk/" + series[i].file_name(number));
            series[i].write(number, frame);
            times[i].push_back(time);
        };
        try {
            if (by_path) {
                paths[i] = path_of(system, registry, arguments, write);
                if (!paths[i]->path.complete) {
                    guard.release();
                    fmt::print(stderr, "delassus: system \"{}\": {}\n", system.name, paths[i]->path.ending);
                    if (!arguments.points) exit = exit_not_converged;
                }
                all.push_back(paths[i]->path.end);
            } else {
                all.push_back(find_equilibrium(
                    system, registry, [&](const LoadStep& step, const State& state) { write(step.load, state); },
                    interrupted));
            }
        } catch (const StepFailure& error) {
            guard.release();
            fmt::print(stderr, "delassus: {}\n", error.what());
            return exit_not_converged;
        }
        report["systems"].push_back(json_of(system, all.back()));
        if (paths[i]) report["systems"].back()["path"] = json_of(*paths[i]);
    }
    guard.release();
    if (output) {
        std::vector<VtkCollectionPart> parts;
        for (std::size_t i = 0; i < series.size(); ++i) parts.push_back({&series[i], &times[i]});
        write_vtk_collection(output->add("equilibrium.pvd"), "vtk", parts);
        output->write("equilibrium.json", json_text(report) + "\n");
        for (std::size_t i = 0; i < paths.size(); ++i)
            if (paths[i]) output->write(scene.systems[i].name + ".path.csv", csv_of(*paths[i]));
        output->keep();
    }
    if (arguments.json) {
        fmt::print("{}\n", json_text(report));
    } else {
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (paths[i]) {
                print_summary(scene.systems[i], paths[i]->path);
            } else {
                print_summary(scene.systems[i], all[i]);
            }
        }
    }
    return exit;
}

}  // namespace

void add_equilibrium(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<EquilibriumArguments>();
    auto* command = program.add_subcommand(
        "equilibrium", "Find the static equilibrium of a scene under its weight and its loads at t = 0");
    add_scene_arguments(*command, arguments->scene);
    command
        ->add_option(
            "-o,--output", arguments->output,
            "Folder for equilibrium.json, tables of paths (NAME.path.csv) and VTK files, a frame for each load "
            "step or point")
        ->type_name("DIR");
    command
        ->add_option("--load-steps", arguments->load_steps,
                     "Parts in which weight and loads are raised; of a path, its first step [10]")
        ->type_name("N");
    command
        ->add_option("--equilibrium-tolerance", arguments->tolerance,
                     "Last movement of the search over the whole way [1e-10]")
        ->type_name("EPS");
    command->add_flag("--path", arguments->path,
                      "Follow the path of equilibria past limit points, by arc length, to the whole loads");
    command
        ->add_option("--until", arguments->until,
                     "Where the path ends: at a load factor, or a displacement such as rod_6.z=-0.5 (m) [1]")
        ->type_name("WHERE");
    command->add_option("--points", arguments->points, "Points of the path at most [1000]")->type_name("N");
    command
        ->add_option("--watch", arguments->watch,
                     "Bodies and nodes whose displacements are columns of the path's table")
        ->type_name("NAME");
    command->add_flag("--json", arguments->json, "Print the report as JSON");
    command->callback([arguments, &action] { action.run = [arguments] { return equilibrium(*arguments); }; });
}

}  // namespace delassus::command
