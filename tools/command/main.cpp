// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "command.hpp"
#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/version.hpp"
#include "process/out_of_memory.hpp"
#include "process/terminal.hpp"
#include "process/watched_process.hpp"
#include "support/nearest_name.hpp"
#include "support/sentence.hpp"
#include "support/standard_descriptors.hpp"
#include "support/trace.hpp"

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

/// OpenBLAS, which some plugins bring, starts a thread for each processor when it is loaded, and interrupts this
/// process where one does not start. Solvers that gain by more threads ask for them (sdk/blas_threads.hpp). The least
/// of its variables leaves both to the user's own, but where the address space is limited: its threads would wait for
/// memory for ever.
void let_blas_start_alone() {
    rlimit space{};
    const bool limited = getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY;
    if (limited) setenv("OPENBLAS_NUM_THREADS", "1", 1);
    if (!std::getenv("OPENBLAS_NUM_THREADS") && !std::getenv("OMP_NUM_THREADS")) setenv("GOTO_NUM_THREADS", "1", 0);
}

/// Throws Error unless everything printed has been written: standard output may be a file on a full disk.
void flush_output() {
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout.flush())
        throw Error(fmt::format("standard output cannot be written: {}", std::strerror(errno)));
}

/// The names of a command's options, or of its subcommands, that are shown to a person.
std::vector<std::string> names_of_options(const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options([](const CLI::Option* one) { return one->nonpositional(); }))
        for (const auto& name : option->get_lnames()) names.push_back("--" + name);
    return names;
}

std::vector<std::string> names_of_subcommands(const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::App* one : command.get_subcommands([](const CLI::App* sub) { return !sub->get_group().empty(); }))
        names.push_back(one->get_name());
    return names;
}

/// A sentence on the first argument that means nothing, or on a subcommand that is missing; empty where all is known.
std::string about_unknown_argument(const CLI::App& program) {
    const CLI::App* command = &program;
    std::string line = program.get_name();
    while (!command->get_subcommands().empty()) {
        command = command->get_subcommands().front();
        line += " " + command->get_name();
    }
    const auto hint = [](const std::string& word, const std::vector<std::string>& names) {
        return nearest_name_hint(word, std::vector<std::string_view>(names.begin(), names.end()));
    };
    const auto rest = program.remaining(true);
    const auto option = std::find_if(rest.begin(), rest.end(), [](const auto& word) { return word.starts_with('-'); });
    if (option != rest.end() && *option != "--") {
        const std::string name = option->substr(0, option->find('='));
        return fmt::format("`{}` has no option \"{}\"{}", line, name, hint(name, names_of_options(*command)));
    }
    const auto subcommands = names_of_subcommands(*command);
    if (rest.empty())
        return subcommands.empty() ? std::string()
                                   : fmt::format("`{}` needs a command: {}", line, fmt::join(subcommands, ", "));
    if (subcommands.empty()) return fmt::format("`{}` has no use for \"{}\"", line, rest.front());
    return fmt::format("`{}` has no command \"{}\"{}", line, rest.front(), hint(rest.front(), subcommands));
}

/// The sentence of an error on the command line. What CLI11 finds missing may be there, misspelt.
std::string sentence_of(const CLI::App* program, const CLI::Error& error) {
    const int code = error.get_exit_code();
    const bool of_arguments = code == static_cast<int>(CLI::ExitCodes::RequiredError) ||
                              code == static_cast<int>(CLI::ExitCodes::ExtrasError);
    const std::string sentence = of_arguments ? about_unknown_argument(*program) : std::string();
    return sentence.empty() ? CLI::FailureMessage::simple(program, error) : fmt::format("delassus: {}\n", sentence);
}

/// An empty path would count as one that was not given.
void refuse_empty_values(CLI::App& command) {
    const CLI::Validator not_empty([](const std::string& text) { return std::string(text.empty() ? "is empty" : ""); },
                                   "", "not empty");
    for (CLI::Option* option : command.get_options()) option->check(not_empty);
    for (CLI::App* subcommand : command.get_subcommands({})) refuse_empty_values(*subcommand);
}

/// Every command may run the code of plugins and libraries. `worker` is watched by who asks it.
void watch(const std::string& command) {
    if (command == "worker") return;
    continue_in_watched_child(
        process_count() > 1 ? fmt::format("process {} of {}", process_rank(), process_count()) : std::string(),
        exit_not_converged);
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
    program.failure_message(sentence_of);

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
    refuse_empty_values(program);
    int exit_code = exit_bad_input;
    try {
        program.parse(argc, argv);
        static const std::string activity =
            fmt::format("running \"delassus {}\"", program.get_subcommands().front()->get_name());
        set_activity(activity.c_str());
        watch(program.get_subcommands().front()->get_name());
        static_cast<void>(is_traced());  // begins the trace, to which processes add that this one starts
        exit_code = action.run();
    } catch (const CLI::ParseError& error) {
        exit_code = program.exit(error) == 0 ? exit_solved : exit_bad_input;
    }
    flush_output();
    return exit_code;
}

/// Writes one sentence to standard error; allocates nothing. Whether it was taken.
bool say(const char* sentence) {
    return std::fputs("delassus: ", stderr) >= 0 && std::fputs(sentence, stderr) >= 0 &&
           std::fputs(memory_has_ended() ? " (after an allocation had failed: out of memory)\n" : "\n", stderr) >= 0;
}

}  // namespace
}  // namespace delassus::command

int main(int argc, char** argv) {
    using namespace delassus;
    using namespace delassus::command;
    open_standard_descriptors();
    make_output_printable();
    prepare_for_out_of_memory(exit_bad_input);
    keep_freed_memory();
    let_blas_start_alone();
    std::signal(SIGXFSZ, SIG_IGN);  // writing beyond the size limit then fails with a sentence
    int exit_code = exit_bad_input;
    std::string unsaid;
    try {
        exit_code = parse_and_run(argc, argv);
    } catch (const Unsupported& error) {
        if (!say(error.what())) unsaid = error.what();
        exit_code = exit_unsupported;
    } catch (const std::bad_alloc&) {
        say_out_of_memory();
    } catch (const std::exception& error) {
        if (const std::string sentence = sentence_of(error); !say(sentence.c_str())) unsaid = sentence;
    }
    say_last_word(exit_code, unsaid.c_str());
    return exit_code;
}
