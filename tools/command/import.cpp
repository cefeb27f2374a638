// SPDX-License-Identifier: BSD-3-Clause
// delassus import: a model of another program as a scene.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/model_import.hpp"
#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"
#include "support/atomic_file.hpp"
#include "support/output_folder.hpp"

namespace delassus::command {

namespace {

struct ImportArguments {
    std::filesystem::path model, output;
    ImportSettings settings;
    bool strict = false, part_overlaps = false, keep_overlaps = false;
    std::optional<double> height;
};

void print_items(const char* title, const std::vector<NotCarriedOver>& items) {
    if (items.empty()) return;
    fmt::print("{}:\n", title);
    for (const auto& item : grouped(items)) fmt::print("  {}: {}\n", item.what, item.why);
}

/// Files that are there while the scene is looked at, and go unless it is kept.
class FilesBeside {
public:
    FilesBeside(const ImportArguments& arguments, const ImportedScene& imported) {
        const auto near = std::filesystem::absolute(arguments.output).parent_path();
        for (const auto& file : imported.files) {
            const auto path = near / file.path;
            auto& folder = folders_[path.parent_path()];
            if (!folder) folder = std::make_unique<OutputFolder>(path.parent_path(), "import");
            folder->write(path.filename().string(), file.content);
        }
    }
    void keep() {
        for (auto& [path, folder] : folders_) folder->keep();
    }

private:
    std::map<std::filesystem::path, std::unique_ptr<OutputFolder>> folders_;
};

/// Two bodies that overlap where the scene starts, by more than the contact envelope: steps do not take such an overlap
/// for one that rounding or a step left, and push it out.
struct Overlap {
    std::array<std::string, 2> bodies;
    double depth = 0.0;
    bool near = false;  ///< joined_nearby(): parts of one joint that was drawn coarsely
    bool parted = false;
};

/// Whether two bodies are joined over at most two joints. Several joints in one place, with bodies without mass between
/// them, count as one.
bool joined_nearby(const MultibodySystem& system, BodyIndex from, BodyIndex to) {
    constexpr int most = 2;
    std::map<BodyIndex, int> joints_to = {{from, 0}};
    for (bool nearer = true; nearer;) {
        nearer = false;
        for (std::int32_t k = 0; k < system.joint_count(); ++k) {
            const JointParameters& joint = system.joint(k);
            if (joint.kind == JointKind::Gear) continue;
            for (const auto& [near, far] : {std::pair(joint.first, joint.second), {joint.second, joint.first}}) {
                const auto known = joints_to.find(near);
                if (far == world_body || known == joints_to.end()) continue;
                const int count = known->second + (system.body(far).mass > 0.0 ? 1 : 0);
                const auto [place, first] = joints_to.try_emplace(far, count);
                if (!first && place->second <= count) continue;
                place->second = count;
                nearer = true;
            }
        }
    }
    const auto found = joints_to.find(to);
    return found != joints_to.end() && found->second <= most;
}

std::vector<Overlap> overlaps_of(Scene& scene) {
    std::vector<Overlap> all;
    for (auto& one : scene.systems) {
        MultibodySystem& system = *one.system;
        if (!system.detects_contacts()) continue;
        UnilateralRows rows;
        system.collect_unilateral(system.initial_state(), one.step, rows);
        for (const ContactPoint& contact : rows.contacts()) {
            if (!(contact.gap < -system.envelope())) continue;
            const auto [a, b] = system.contact_bodies(contact);
            if (a < 0 || b < 0 || std::max(a, b) >= system.body_count()) continue;
            const std::array<std::string, 2> bodies = {system.body(a).name, system.body(b).name};
            auto found =
                std::find_if(all.begin(), all.end(), [&](const Overlap& known) { return known.bodies == bodies; });
            if (found == all.end()) found = all.insert(all.end(), {bodies, 0.0, joined_nearby(system, a, b)});
            found->depth = std::max(found->depth, -contact.gap);
        }
    }
    std::stable_sort(all.begin(), all.end(), [](const Overlap& a, const Overlap& b) { return a.depth > b.depth; });
    return all;
}

/// Those that are kept apart, or the others.
void print_overlaps(const char* title, const std::vector<Overlap>& overlaps, bool parted) {
    constexpr std::size_t most_named = 10;
    std::size_t count = 0;
    for (const Overlap& one : overlaps) {
        if (one.parted != parted) continue;
        if (count == 0) fmt::print("{}:\n", title);
        if (++count <= most_named)
            fmt::print("  \"{}\" and \"{}\": {:.3g} m\n", one.bodies[0], one.bodies[1], one.depth);
    }
    if (count > most_named) fmt::print("  and {} pairs more\n", count - most_named);
}

int import_scene(ImportArguments arguments) {
    if (arguments.height) {
        arguments.settings.ground = true;
        arguments.settings.height = *arguments.height;
    }
    std::error_code ignored;
    if (std::filesystem::equivalent(arguments.model, arguments.output, ignored))
        throw InputError(
            fmt::format("{}: the scene would replace the model; give another file to -o", arguments.output.string()));
    require_replaceable(arguments.output, "scene");
    ImportedScene imported = import_model(arguments.model, arguments.output, arguments.settings);
    const auto report = [&] {
        print_items("Not carried over", imported.lost);
        print_items("Left out, without effect on the motion", imported.without_effect);
    };
    if (arguments.strict && !imported.lost.empty()) {
        report();
        throw InputError(fmt::format(
            "{}: {} of the model {} no counterpart in a scene; --strict writes nothing then", arguments.model.string(),
            imported.lost.size() == 1 ? "1 item" : fmt::format("{} items", imported.lost.size()),
            imported.lost.size() == 1 ? "has" : "have"));
    }
    FilesBeside files(arguments, imported);
    std::vector<Overlap> overlaps;
    try {
        // What `delassus run` does before its first step.
        Scene scene = parse_scene(imported.yaml, arguments.output.string());
        const Registry registry(std::vector<std::filesystem::path>{});
        for (auto& system : scene.systems) const Simulation simulation(system, registry);
        overlaps = overlaps_of(scene);
        for (Overlap& one : overlaps) {
            one.parted = arguments.part_overlaps || (one.near && !arguments.keep_overlaps);
            if (one.parted) arguments.settings.apart.push_back(one.bodies);
        }
        if (!arguments.settings.apart.empty())
            imported = import_model(arguments.model, arguments.output, arguments.settings);
    } catch (const Error& error) {
        throw InputError(fmt::format("{}: the scene that this model makes would be refused: {}",
                                     arguments.model.string(), error.what()));
    }
    write_file_atomically(arguments.output, marked_text("#", imported.yaml));
    files.keep();
    fmt::print("{}: from {} ({}): {} bodies, {} joints, {} shapes\n", arguments.output.string(),
               arguments.model.filename().string(), imported.format, imported.bodies, imported.joints, imported.shapes);
    report();
    print_overlaps(arguments.part_overlaps
                       ? "Overlap at the start, and are kept apart"
                       : "Overlap at the start, are joined over two joints at most, and are kept apart "
                         "(--keep-overlaps lets them touch)",
                   overlaps, true);
    print_overlaps("Overlap at the start (--part-overlaps keeps these apart)", overlaps, false);
    return exit_solved;
}

}  // namespace

void add_import(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<ImportArguments>();
    auto* command = program.add_subcommand(
        "import", "Make a scene of a model in MJCF, URDF or SDF; what has no counterpart is listed");
    command->add_option("model", arguments->model, "Model file; its root element tells its format")
        ->required()
        ->type_name("MODEL");
    command
        ->add_option("-o,--output", arguments->output,
                     "Scene to write, replaced only if delassus wrote it so; meshes go to a folder beside it")
        ->required()
        ->type_name("SCENE");
    command->add_flag(
        "--strict", arguments->strict,
        "Refuse a model of which something that acts on the motion has no counterpart, and write nothing");
    command->add_option("--end", arguments->settings.end, "End of the scene, s (10)")->type_name("SECONDS");
    command
        ->add_option("--keyframe", arguments->settings.keyframe,
                     "Keyframe of an MJCF model, by name or number, at which the scene starts")
        ->type_name("NAME");
    command->add_flag("--inputs", arguments->settings.inputs,
                      "Controls of MJCF actuators become inputs of the scene, which a program sets while it runs");
    command->add_flag("--floating", arguments->settings.floating,
                      "The root link of a URDF model moves freely; without it the world holds it");
    command->add_flag("--fixed-base", arguments->settings.fixed_base,
                      "The world holds the first body of each mechanism that floats");
    command->add_flag("--ground", arguments->settings.ground,
                      "Add a plane against gravity; the model's lowest point touches it at the start");
    command->add_option("--height", arguments->height, "With such a ground: how high over it the lowest point is, m")
        ->type_name("METRES");
    command
        ->add_option("--package-path", arguments->settings.package_paths,
                     "Folder in which package:// and model:// addresses are looked for; may be given again")
        ->type_name("DIR");
    auto* part = command->add_flag("--part-overlaps", arguments->part_overlaps,
                                   "Keep bodies apart that overlap at the start by more than the contact envelope; "
                                   "those that are joined over two joints at most are kept apart in any case");
    command
        ->add_flag("--keep-overlaps", arguments->keep_overlaps,
                   "Let all of these touch, which are pushed apart then, also those that are joined nearby")
        ->excludes(part);
    command->callback([arguments, &action] { action.run = [arguments] { return import_scene(*arguments); }; });
}

}  // namespace delassus::command
