// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <new>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/version.hpp"

namespace delassus::command {

std::pair<std::string, std::string> parse_setting(const std::string& text) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
        throw InputError(fmt::format("\"{}\" is not of the form key=value", text));
    return {text.substr(0, equals), text.substr(equals + 1)};
}

void add_plugin_path(CLI::App& subcommand, std::vector<std::filesystem::path>& folders) {
    subcommand.add_option("--plugin-path", folders, "Folders to search for plugins first")->type_name("DIR");
}

std::vector<std::filesystem::path> absolute(std::vector<std::filesystem::path> folders) {
    for (auto& folder : folders) folder = std::filesystem::absolute(folder);
    return folders;
}

}  // namespace delassus::command

int main(int argc, char** argv) {
    using namespace delassus;
    using namespace delassus::command;
    CLI::App program{
        "Solves saddle-point and cone-complementarity problems with solvers that are plugins, compares them, and\n"
        "simulates mechanical systems with them.\n"
        "Exit codes: 0 solved; 2 bad input or usage; 3 not converged; 4 the solver cannot take the problem."};
    program.name("delassus");
    program.set_version_flag("--version", "delassus " DELASSUS_VERSION);
    program.require_subcommand(1);
    program.failure_message(CLI::FailureMessage::simple);

    Action action;
    add_solve(program, action);
    add_run(program, action);
    add_view(program, action);
    add_plan(program, action);
    add_compare(program, action);
    add_bench(program, action);
    add_plugins(program, action);
    add_inspect(program, action);
    add_convert(program, action);
    add_generate(program, action);
    add_worker(program, action);
    try {
        program.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return program.exit(error) == 0 ? exit_solved : exit_bad_input;
    }
    try {
        return action.run();
    } catch (const Unsupported& error) {
        fmt::print(stderr, "delassus: {}\n", error.what());
        return exit_unsupported;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "delassus: out of memory\n");
    } catch (const std::exception& error) {
        fmt::print(stderr, "delassus: {}\n", error.what());
    }
    return exit_bad_input;
}
