// SPDX-License-Identifier: BSD-3-Clause
// delassus documents: the manual page and the completions of shells, from the command line's own tables. For the build,
// which installs them, and for the completions, which ask for names.
#include <fmt/format.h>

#include <iterator>
#include <map>
#include <string_view>
#include <utility>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/timestepper.hpp"
#include "delassus/version.hpp"

namespace delassus::command {

namespace {

/// What a person may choose: no hidden ones.
std::vector<const CLI::App*> subcommands(const CLI::App& app) {
    auto result = app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); });
    return {result.begin(), result.end()};
}

std::vector<const CLI::Option*> options(const CLI::App& app) {
    return app.get_options([](const CLI::Option* one) { return !one->get_group().empty() && one->nonpositional(); });
}

std::vector<const CLI::Option*> positionals(const CLI::App& app) {
    return app.get_options([](const CLI::Option* one) { return one->get_positional(); });
}

/// "--solver", "-o"; the long ones first.
std::vector<std::string> flags(const CLI::Option& option) {
    std::vector<std::string> result;
    for (const auto& name : option.get_lnames()) result.push_back("--" + name);
    for (const auto& name : option.get_snames()) result.push_back("-" + name);
    return result;
}

bool takes_a_value(const CLI::Option& option) {
    return option.get_items_expected_max() > 0;
}

std::string first_line(const std::string& text) {
    return text.substr(0, text.find('\n'));
}

std::string replaced(const std::string& text, const std::map<char, std::string>& by) {
    std::string result;
    for (const char c : text) {
        const auto found = by.find(c);
        if (found == by.end()) {
            result += c;
        } else {
            result += found->second;
        }
    }
    return result;
}

/// What completes the values of some options: words, or a command whose lines are the words. Others take files.
constexpr std::pair<std::string_view, std::string_view> completed[] = {
    {"--solver", "$(delassus documents solvers 2>/dev/null)"},
    {"--solvers", "$(delassus documents solvers 2>/dev/null)"},
    {"--integrator", "$(delassus documents integrators 2>/dev/null)"},
    {"--law", "associated coulomb"}};

std::string words_of(std::string_view flag) {
    for (const auto& [option, words] : completed)
        if (option == flag) return std::string(words);
    return "";
}

using Output = fmt::memory_buffer;
template <class... Values>
void put(Output& out, fmt::format_string<Values...> text, Values&&... values) {
    fmt::format_to(std::back_inserter(out), text, std::forward<Values>(values)...);
}

// ---- man ----

std::string roff(const std::string& text) {
    std::string result = replaced(text, {{'\\', "\\e"}, {'-', "\\-"}, {'\n', " "}});
    if (!result.empty() && (result.front() == '.' || result.front() == '\'')) result.insert(0, "\\&");
    return result;
}

void put_arguments(Output& out, const CLI::App& app) {
    for (const CLI::Option* one : positionals(app))
        put(out, ".TP\n\\fI{}\\fR\n{}\n", roff(one->get_name(true)), roff(one->get_description()));
    for (const CLI::Option* one : options(app)) {
        std::string names;
        for (const auto& flag : flags(*one)) names += (names.empty() ? "" : ", ") + ("\\fB" + roff(flag) + "\\fR");
        const std::string value = takes_a_value(*one) ? " \\fI" + roff(one->get_type_name()) + "\\fR" : "";
        put(out, ".TP\n{}{}\n{}\n", names, value, roff(one->get_description()));
    }
}

void put_command(Output& out, const CLI::App& app, const std::string& before) {
    const std::string name = before + " " + app.get_name();
    put(out, ".SS {}\n{}.\n", roff(name), roff(app.get_description()));
    put_arguments(out, app);
    for (const CLI::App* one : subcommands(app)) put_command(out, *one, name);
}

void manual(Output& out, const CLI::App& program) {
    put(out, ".TH DELASSUS 1 \"\" \"delassus {}\" \"User commands\"\n", DELASSUS_VERSION);
    put(out, ".SH NAME\ndelassus \\- {}\n", roff("solve, compare and simulate constrained mechanical systems"));
    put(out, ".SH SYNOPSIS\n\\fBdelassus\\fR \\fIcommand\\fR [\\fIoptions\\fR]\n");
    put(out, ".SH DESCRIPTION\n");
    const std::string description = program.get_description();
    const auto codes = description.find("Exit codes: ");
    put(out, "{}\n", roff(description.substr(0, codes)));
    put(out, ".SH OPTIONS\n");
    put_arguments(out, program);
    put(out, ".SH COMMANDS\n");
    for (const CLI::App* one : subcommands(program)) put_command(out, *one, "delassus");
    if (codes != std::string::npos) put(out, ".SH EXIT STATUS\n{}\n", roff(description.substr(codes + 12)));
    put(out, ".SH ENVIRONMENT\n.TP\n\\fBDELASSUS_PLUGIN_PATH\\fR\n{}\n",
        roff("Folders to search for plugins, separated by colons."));
}

// ---- bash ----

std::string all_words(const CLI::App& app) {
    std::string words;
    for (const CLI::App* one : subcommands(app)) words += one->get_name() + " ";
    for (const CLI::Option* one : options(app))
        for (const auto& flag : flags(*one)) words += flag + " ";
    if (!words.empty()) words.pop_back();
    return words;
}

void bash(Output& out, const CLI::App& program) {
    std::string commands;
    for (const CLI::App* one : subcommands(program)) commands += (commands.empty() ? "" : "|") + one->get_name();
    put(out, "# Completions of delassus for bash; written by `delassus documents bash`.\n_delassus() {{\n");
    put(out,
        "    local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} command= words= i\n");
    put(out, "    for ((i = 1; i < COMP_CWORD; ++i)); do\n        case ${{COMP_WORDS[i]}} in\n");
    put(out, "            {}) command=${{COMP_WORDS[i]}}; break ;;\n        esac\n    done\n", commands);
    put(out, "    case $previous in\n");
    for (const auto& [flag, values] : completed)
        put(out, "        {}) COMPREPLY=($(compgen -W \"{}\" -- \"$current\")); return ;;\n", flag, values);
    put(out, "    esac\n    case $command in\n        \"\") words=\"{}\" ;;\n", all_words(program));
    for (const CLI::App* one : subcommands(program))
        put(out, "        {}) words=\"{}\" ;;\n", one->get_name(), all_words(*one));
    put(out,
        "    esac\n    COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
        "    if [[ -n $command && $current != -* ]]; then COMPREPLY+=($(compgen -f -- \"$current\")); fi\n}}\n"
        "complete -o filenames -F _delassus delassus\n");
}

// ---- zsh ----

/// Within single quotes, in the descriptions of _describe and _arguments.
std::string zsh_text(const std::string& text) {
    return replaced(first_line(text), {{'\'', "'\\''"}, {':', "\\:"}, {'[', "\\["}, {']', "\\]"}});
}

void zsh(Output& out, const CLI::App& program) {
    put(out, "#compdef delassus\n# Completions of delassus for zsh; written by `delassus documents zsh`.\n");
    put(out, "_delassus() {{\n  if (( CURRENT == 2 )); then\n    local -a commands=(\n");
    for (const CLI::App* one : subcommands(program))
        put(out, "      '{}:{}'\n", one->get_name(), zsh_text(one->get_description()));
    put(out,
        "    )\n    _describe command commands\n    return\n  fi\n  shift words\n  (( CURRENT-- ))\n  case $words[1] "
        "in\n");
    for (const CLI::App* one : subcommands(program)) {
        put(out, "    {})\n      _arguments \\\n", one->get_name());
        for (const CLI::Option* option : options(*one))
            for (const auto& flag : flags(*option)) {
                const std::string words = words_of(flag);
                const std::string value = words.empty() ? "_files" : "(" + words + ")";
                put(out, "        '*{}[{}]{}' \\\n", flag, zsh_text(option->get_description()),
                    takes_a_value(*option) ? "':value:\"" + value + "\"'" : "");
            }
        std::string nested;
        for (const CLI::App* inner : subcommands(*one)) nested += (nested.empty() ? "" : " ") + inner->get_name();
        if (!nested.empty()) put(out, "        '1:command:({})' \\\n", nested);
        put(out, "        '*:file:_files' ;;\n");
    }
    put(out, "  esac\n}}\n_delassus \"$@\"\n");
}

// ---- fish ----

void fish(Output& out, const CLI::App& program) {
    const auto quoted = [](const std::string& text) {
        return "'" + replaced(first_line(text), {{'\'', "\\'"}, {'\\', "\\\\"}}) + "'";
    };
    put(out, "# Completions of delassus for fish; written by `delassus documents fish`.\n");
    const auto put_options = [&](const CLI::App& app, const std::string& condition) {
        for (const CLI::Option* option : options(app)) {
            put(out, "complete -c delassus -n {}", condition);
            for (const auto& name : option->get_lnames()) put(out, " -l {}", name);
            for (const auto& name : option->get_snames()) put(out, " -s {}", name);
            std::string words;
            for (const auto& flag : flags(*option))
                if (words.empty()) words = words_of(flag);
            if (!words.empty() && words.starts_with("$(")) words = words.substr(1);  // fish writes (command)
            if (takes_a_value(*option)) put(out, "{}", words.empty() ? " -r" : " -x -a " + quoted(words));
            put(out, " -d {}\n", quoted(option->get_description()));
        }
    };
    put_options(program, "__fish_use_subcommand");
    for (const CLI::App* one : subcommands(program)) {
        put(out, "complete -c delassus -n __fish_use_subcommand -a {} -d {}\n", one->get_name(),
            quoted(one->get_description()));
        const std::string condition = "'__fish_seen_subcommand_from " + one->get_name() + "'";
        for (const CLI::App* inner : subcommands(*one))
            put(out, "complete -c delassus -n {} -a {} -d {}\n", condition, inner->get_name(),
                quoted(inner->get_description()));
        put_options(*one, condition);
    }
}

void print_names(const std::string& kind) {
    if (kind == "integrators") {
        for (const auto& info : timesteppers()) fmt::print("{}\n", info.name);
        return;
    }
    fmt::print("auto\n");
    const Registry registry;
    for (const auto& plugin : registry.plugins()) fmt::print("{}\n", plugin.name);
}

}  // namespace

void add_documents(CLI::App& program, Action& action) {
    auto kind = std::make_shared<std::string>();
    auto* command = program.add_subcommand("documents", "Prints the manual page, completions, and names for these");
    command->group("");  // hidden from --help
    command->add_option("kind", *kind, "man, bash, zsh, fish, solvers or integrators")->required();
    command->callback([&program, kind, &action] {
        action.run = [&program, kind] {
            static const std::map<std::string, void (*)(Output&, const CLI::App&)> writers = {
                {"man", &manual}, {"bash", &bash}, {"zsh", &zsh}, {"fish", &fish}};
            if (*kind == "solvers" || *kind == "integrators") {
                print_names(*kind);
                return exit_solved;
            }
            const auto writer = writers.find(*kind);
            if (writer == writers.end())
                throw InputError(fmt::format(
                    "there is no document \"{}\"; it must be man, bash, zsh, fish, solvers or integrators", *kind));
            Output out;
            writer->second(out, program);
            fmt::print("{}", fmt::to_string(out));
            return exit_solved;
        };
    });
}

}  // namespace delassus::command
