// SPDX-License-Identifier: BSD-3-Clause
// What the subcommands share.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "delassus/registry.hpp"

namespace delassus::command {

enum ExitCode { exit_solved = 0, exit_bad_input = 2, exit_not_converged = 3, exit_unsupported = 4 };

/// What was asked for on the command line: run() does it and returns the exit code. Exceptions become sentences.
struct Action {
    std::function<int()> run;
};

/// Each adds its subcommand to the program; its callback sets action.run.
void add_solve(CLI::App& program, Action& action);
void add_run(CLI::App& program, Action& action);
void add_equilibrium(CLI::App& program, Action& action);
void add_view(CLI::App& program, Action& action);
void add_plan(CLI::App& program, Action& action);
void add_compare(CLI::App& program, Action& action);
void add_bench(CLI::App& program, Action& action);
void add_plugins(CLI::App& program, Action& action);
/// Those of `delassus plugins` that install and remove.
void add_plugin_packages(CLI::App& plugins, Action& action);
void add_convert(CLI::App& program, Action& action);
void add_import(CLI::App& program, Action& action);
void add_inspect(CLI::App& program, Action& action);
void add_generate(CLI::App& program, Action& action);
void add_documents(CLI::App& program, Action& action);
void add_worker(CLI::App& program, Action& action);

/// "key=value" to its two halves; throws InputError.
std::pair<std::string, std::string> parse_setting(const std::string& text);

/// The --plugin-path option that every subcommand with plugins has.
void add_plugin_path(CLI::App& subcommand, std::vector<std::filesystem::path>& folders);

/// The --law option of subcommands that let a person change the law of friction.
void add_law(CLI::App& subcommand, std::string& law, const std::string& description);

/// The folders made absolute.
std::vector<std::filesystem::path> absolute(std::vector<std::filesystem::path> folders);

}  // namespace delassus::command
