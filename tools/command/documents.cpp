// SPDX-License-Identifier: BSD-3-Clause
// delassus documents: the manual page and the completions of shells, from the command line's own tables. For the build,
// which installs them, and for the completions, which ask for names.
#include <fmt/format.h>

#include <map>

#include "bench/suite.hpp"
#include "command.hpp"
#include "command_table.hpp"
#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/timestepper.hpp"

namespace delassus::command {

namespace {

void print_solvers() {
    fmt::print("auto\n");
    const Registry registry;
    for (const auto& plugin : registry.plugins()) fmt::print("{}\n", plugin.name);
}

void print_integrators() {
    for (const auto& info : timesteppers()) fmt::print("{}\n", info.name);
}

void print_kinds() {
    for (const auto& generator : generators()) fmt::print("{}\n", generator.name);
}

void print_suites() {
    for (const auto& suite : bench::shipped_suites(Registry())) fmt::print("{}\n", suite.name);
    fmt::print("relations\n");
}

constexpr const char* document_kinds = "man|bash|zsh|fish|solvers|integrators|kinds|suites";

int print_document(const CLI::App& program, const std::string& kind) {
    static const std::map<std::string, void (*)(Output&, const CLI::App&)> writers = {{"man", &write_manual_page},
                                                                                      {"bash", &write_bash_completion},
                                                                                      {"zsh", &write_zsh_completion},
                                                                                      {"fish", &write_fish_completion}};
    static const std::map<std::string, void (*)()> names = {{"solvers", &print_solvers},
                                                            {"integrators", &print_integrators},
                                                            {"kinds", &print_kinds},
                                                            {"suites", &print_suites}};
    if (const auto writer = writers.find(kind); writer != writers.end()) {
        Output out;
        writer->second(out, program);
        fmt::print("{}", fmt::to_string(out));
    } else if (const auto printer = names.find(kind); printer != names.end()) {
        printer->second();
    } else {
        throw InputError(fmt::format("there is no document \"{}\"; it must be one of {}", kind, document_kinds));
    }
    return exit_solved;
}

}  // namespace

void add_documents(CLI::App& program, Action& action) {
    auto kind = std::make_shared<std::string>();
    auto* command = program.add_subcommand(
        "documents", "Print the manual page, the completions of a shell, or the names that these ask for");
    command->add_option("kind", *kind, "What to print")->required()->type_name(document_kinds);
    command->callback(
        [&program, kind, &action] { action.run = [&program, kind] { return print_document(program, *kind); }; });
}

}  // namespace delassus::command
