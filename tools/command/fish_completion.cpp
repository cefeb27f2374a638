// SPDX-License-Identifier: BSD-3-Clause
// Completions for fish: one line for each option, with the command for which it holds as a condition.
#include "command_table.hpp"

namespace delassus::command {

namespace {

std::string fish_quoted(const std::string& text) {
    return "'" + replaced(first_line(text), {{'\'', "\\'"}, {'\\', "\\\\"}}) + "'";
}

/// What `complete` is told of a value or an argument.
std::string fish_values(const Completion& completion) {
    std::vector<std::string> sources;
    if (!completion.words.empty()) sources.push_back(joined(completion.words));
    if (!completion.names.empty())
        sources.push_back((completion.list ? "(__delassus_list " : "(__delassus_names ") + completion.names + ")");
    if (completion.folders) sources.emplace_back("(__fish_complete_directories)");
    if (completion.files && !completion.suffixes.empty())
        sources.push_back("(__delassus_files " + joined(completion.suffixes) + ")");
    if (completion.files && completion.suffixes.empty()) return "";
    return sources.empty() ? " -f" : " -f -a " + fish_quoted(joined(sources));
}

void put_fish_command(Output& out, const CommandPath& path) {
    const std::string at = joined(path.words);
    const auto line = [&](const std::string& condition) { put(out, "complete -c delassus -n '{}'", condition); };
    const std::string here = "__delassus_at " + at;
    for (const CLI::App* one : subcommands(*path.app)) {
        line("__delassus_argument 1 " + at);
        put(out, " -f -a {} -d {}\n", one->get_name(), fish_quoted(one->get_description()));
    }
    for (const CLI::Option* one : options(*path.app)) {
        line(here);
        for (const auto& name : one->get_lnames()) put(out, " -l {}", name);
        for (const auto& name : one->get_snames()) put(out, " -s {}", name);
        if (takes_a_value(*one)) put(out, " -r{}", fish_values(completion_of(*one)));
        put(out, " -d {}\n", fish_quoted(one->get_description()));
    }
    int number = 1;
    for (const CLI::Option* one : positionals(*path.app)) {
        line(fmt::format("__delassus_argument {} {}", may_be_repeated(*one) ? 0 : number++, at));
        put(out, "{}\n", fish_values(completion_of(*one)));
    }
}

constexpr fmt::string_view fish_functions = R"SH(
# The words before the cursor without options and their values: the command's, then its arguments.
function __delassus_words
    set -l skip 0
    for word in (commandline -opc)[2..]
        if test $skip = 1
            set skip 0
        else if contains -- $word {}
            set skip 1
        else if not string match -q -- '-*' $word
            echo $word
        end
    end
end

# How many of them name the command: two where it is one of a group.
function __delassus_depth
    set -l words (__delassus_words)
    if test (count $words) -ge 2; and contains -- $words[1] {}
        echo 2
    else
        math "min(1, $(count $words))"
    end
end

# Is this the command at the cursor?
function __delassus_at
    set -l words (__delassus_words)
    set -l depth (__delassus_depth)
    test $depth -eq (count $argv); or return 1
    test $depth -eq 0; or test "$words[1..$depth]" = "$argv"
end

# Is the cursor at the argument of this number (0: at any) of this command?
function __delassus_argument
    __delassus_at $argv[2..]; or return 1
    test $argv[1] = 0; or test (math (count (__delassus_words)) - (__delassus_depth) + 1) -eq $argv[1]
end

function __delassus_names
    delassus documents $argv[1] 2>/dev/null
end

# Names that follow one another, separated by commas.
function __delassus_list
    set -l head (string match -r '^.*,' -- (commandline -ct))
    for name in (delassus documents $argv[1] 2>/dev/null)
        echo $head$name
    end
end

# Folders, and files with one of the suffixes.
function __delassus_files
    for path in (complete -C "'' "(commandline -ct))
        for suffix in / $argv
            string match -- "*$suffix" $path
        end
    end
end

)SH";

}  // namespace

void write_fish_completion(Output& out, const CLI::App& program) {
    put(out, "# Completions of delassus for fish; written by `delassus documents fish`.\n");
    std::vector<std::string> outer, valued;
    for (const auto& path : command_paths(program)) {
        if (!path.words.empty() && !subcommands(*path.app).empty()) outer.push_back(joined(path.words));
        for (const CLI::Option* one : options(*path.app))
            if (takes_a_value(*one))
                for (const auto& flag : flags(*one)) valued.push_back(flag);
    }
    put(out, fish_functions, joined(valued), joined(outer));
    for (const auto& path : command_paths(program)) put_fish_command(out, path);
}

}  // namespace delassus::command
