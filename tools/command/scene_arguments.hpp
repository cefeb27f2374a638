// SPDX-License-Identifier: BSD-3-Clause
// What `delassus run` and `delassus plan` have in common: a scene and what to change in it.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "delassus/scene.hpp"

namespace delassus::command {

struct SceneArguments {
    std::filesystem::path file;
    std::string solver, law, integrator;
    std::vector<std::string> settings;
    std::optional<double> step, tolerance, accuracy, end;
    std::vector<std::filesystem::path> plugin_path;
};

void add_scene_arguments(CLI::App& command, SceneArguments& arguments);

/// The scene with the changes. Throws InputError.
Scene read(const SceneArguments& arguments);

}  // namespace delassus::command
