// SPDX-License-Identifier: BSD-3-Clause
// delassus import: a model of another program as a scene.
#include <fmt/format.h>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/model_import.hpp"
#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"
#include "support/atomic_file.hpp"

namespace delassus::command {

namespace {

struct ImportArguments {
    std::filesystem::path model, output;
    ImportSettings settings;
    bool strict = false;
};

void print_items(const char* title, const std::vector<NotCarriedOver>& items) {
    if (items.empty()) return;
    fmt::print("{}:\n", title);
    for (const auto& item : items) fmt::print("  {}: {}\n", item.what, item.why);
}

/// Files that are there while the scene is looked at, and go unless it is kept.
class FilesBeside {
public:
    explicit FilesBeside(const ImportArguments& arguments, const ImportedScene& imported) {
        const auto near = std::filesystem::absolute(arguments.output).parent_path();
        for (const auto& file : imported.files) {
            const auto path = near / file.path;
            if (!std::filesystem::exists(path.parent_path())) {
                std::filesystem::create_directories(path.parent_path());
                folders_.push_back(path.parent_path());
            }
            const bool there = std::filesystem::exists(path);
            write_file_atomically(path, file.content);
            if (!there) written_.push_back(path);
        }
    }
    ~FilesBeside() {
        std::error_code ignored;
        for (const auto& path : written_) std::filesystem::remove(path, ignored);
        for (const auto& path : folders_) std::filesystem::remove(path, ignored);
    }
    FilesBeside(const FilesBeside&) = delete;
    FilesBeside& operator=(const FilesBeside&) = delete;
    void keep() {
        written_.clear();
        folders_.clear();
    }

private:
    std::vector<std::filesystem::path> written_, folders_;
};

int import_scene(const ImportArguments& arguments) {
    std::error_code ignored;
    if (std::filesystem::equivalent(arguments.model, arguments.output, ignored))
        throw InputError(
            fmt::format("{}: the scene would replace the model; give another file to -o", arguments.output.string()));
    const ImportedScene imported = import_model(arguments.model, arguments.output, arguments.settings);
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
    try {
        // What `delassus run` does before its first step.
        Scene scene = parse_scene(imported.yaml, arguments.output.string());
        const Registry registry(std::vector<std::filesystem::path>{});
        for (auto& system : scene.systems) const Simulation simulation(system, registry);
    } catch (const Error& error) {
        throw InputError(fmt::format("{}: the scene that this model makes would be refused: {}",
                                     arguments.model.string(), error.what()));
    }
    write_file_atomically(arguments.output, imported.yaml);
    files.keep();
    fmt::print("{}: from {} ({}): {} bodies, {} joints, {} shapes\n", arguments.output.string(),
               arguments.model.filename().string(), imported.format, imported.bodies, imported.joints, imported.shapes);
    report();
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
    command->add_option("-o,--output", arguments->output, "Scene to write; meshes go to a folder beside it")
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
    command->add_flag("--floating", arguments->settings.floating,
                      "The root link of a URDF model moves freely; without it the world holds it");
    command->callback([arguments, &action] { action.run = [arguments] { return import_scene(*arguments); }; });
}

}  // namespace delassus::command
