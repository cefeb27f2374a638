// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <malloc.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/version.hpp"
#include "process/out_of_memory.hpp"

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

void add_law(CLI::App& subcommand, std::string& law, const std::string& description) {
    subcommand.add_option("--law", law, description)->type_name("associated|coulomb");
}

std::vector<std::filesystem::path> absolute(std::vector<std::filesystem::path> folders) {
    for (auto& folder : folders) folder = std::filesystem::absolute(folder);
    return folders;
}

namespace {

/// Steps of a scene free arrays of megabytes and take them again: what was freed stays with the process.
void keep_freed_memory() {
    mallopt(M_MMAP_THRESHOLD, 64 << 20);
    mallopt(M_TRIM_THRESHOLD, 512 << 20);
}

/// Throws Error unless everything printed has been written: standard output may be a file on a full disk.
void flush_output() {
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout.flush())
        throw Error(fmt::format("standard output cannot be written: {}", std::strerror(errno)));
}

int parse_and_run(int argc, char** argv) {
    CLI::App program{
        "Solves saddle-point and cone-complementarity problems with solvers that are plugins, compares them, and\n"
        "simulates mechanical systems with them.\n"
        "Exit codes: 0 solved; 2 bad input or usage, a file that cannot be written, out of memory; 3 not converged; 4 "
        "the\n"
        "solver cannot take the problem."};
    program.name("delassus");
    program.set_version_flag("--version", "delassus " DELASSUS_VERSION);
    program.require_subcommand(1);
    program.failure_message(CLI::FailureMessage::simple);

    Action action;
    add_solve(program, action);
    add_run(program, action);
    add_equilibrium(program, action);
    add_view(program, action);
    add_plan(program, action);
    add_compare(program, action);
    add_bench(program, action);
    add_plugins(program, action);
    add_inspect(program, action);
    add_convert(program, action);
    add_import(program, action);
    add_generate(program, action);
    add_documents(program, action);
    add_worker(program, action);
    int exit_code = exit_bad_input;
    try {
        program.parse(argc, argv);
        static const std::string activity =
            fmt::format("running \"delassus {}\"", program.get_subcommands().front()->get_name());
        set_activity(activity.c_str());
        exit_code = action.run();
    } catch (const CLI::ParseError& error) {
        exit_code = program.exit(error) == 0 ? exit_solved : exit_bad_input;
    }
    flush_output();
    return exit_code;
}

/// Writes one sentence to standard error; allocates nothing.
void say(const char* sentence) {
    std::fputs("delassus: ", stderr);
    std::fputs(sentence, stderr);
    std::fputs(memory_has_ended() ? " (after an allocation had failed: out of memory)\n" : "\n", stderr);
}

}  // namespace
}  // namespace delassus::command

int main(int argc, char** argv) {
    using namespace delassus;
    using namespace delassus::command;
    prepare_for_out_of_memory(exit_bad_input);
    keep_freed_memory();
    std::signal(SIGXFSZ, SIG_IGN);  // writing beyond the size limit then fails with a sentence
    try {
        return parse_and_run(argc, argv);
    } catch (const Unsupported& error) {
        say(error.what());
        return exit_unsupported;
    } catch (const std::bad_alloc&) {
        say_out_of_memory();
    } catch (const std::exception& error) {
        say(error.what());
    }
    return exit_bad_input;
}
