// SPDX-License-Identifier: BSD-3-Clause
// Completions for bash: a table of what each command takes, and functions that look a word up in it.
#include "command_table.hpp"

namespace delassus::command {

namespace {

/// One word of the shell that the function _delassus_offer understands: "names:solvers", "list:solvers",
/// "files:.so,.h5", "folders", "words:a|b"; several are joined by ";".
std::string bash_how(const Completion& completion) {
    std::vector<std::string> parts;
    if (!completion.words.empty()) parts.push_back("words:" + joined(completion.words, "|"));
    if (!completion.names.empty()) parts.push_back((completion.list ? "list:" : "names:") + completion.names);
    if (completion.files) parts.push_back("files:" + joined(completion.suffixes, ","));
    if (completion.folders) parts.emplace_back("folders");
    return parts.empty() ? "nothing" : joined(parts, ";");
}

void put_bash_row(Output& out, const CommandPath& path) {
    std::vector<std::string> commands, names, valued, arguments;
    for (const CLI::App* one : subcommands(*path.app)) commands.push_back(one->get_name());
    for (const CLI::Option* one : options(*path.app))
        for (const auto& flag : flags(*one)) {
            names.push_back(flag);
            if (takes_a_value(*one)) valued.push_back("[" + flag + "]='" + bash_how(completion_of(*one)) + "'");
        }
    bool repeats = false;
    for (const CLI::Option* one : positionals(*path.app)) {
        arguments.push_back("'" + bash_how(completion_of(*one)) + "'");
        repeats = may_be_repeated(*one);
    }
    put(out, "        '{}')\n            commands='{}'\n            options='{}'\n", joined(path.words),
        joined(commands), joined(names));
    put(out, "            valued=({})\n            arguments=({}) repeats={} ;;\n", joined(valued), joined(arguments),
        repeats ? "1" : "");
}

constexpr const char* bash_functions = R"SH(
# Adds what begins with $current to COMPREPLY: of words, of names that delassus knows, of files.
_delassus_offer() {
    local part parts name suffix head found
    IFS=';' read -ra parts <<< "$1"
    for part in "${parts[@]}"; do
        case $part in
            words:*)
                part=${part#words:}
                COMPREPLY+=($(compgen -W "${part//|/ }" -- "$current")) ;;
            names:*) COMPREPLY+=($(compgen -W "$(delassus documents "${part#*:}" 2> /dev/null)" -- "$current")) ;;
            list:*)
                head=${current%"${current##*,}"}
                compopt -o nospace 2> /dev/null
                COMPREPLY+=($(compgen -P "$head" -W "$(delassus documents "${part#*:}" 2> /dev/null)" -- \
                    "${current##*,}")) ;;
            folders|files:*)
                compopt -o filenames 2> /dev/null
                while IFS= read -r name; do COMPREPLY+=("$name"); done < <(compgen -d -- "$current")
                [[ $part != folders ]] || continue
                while IFS= read -r name; do
                    [[ ! -d $name ]] || continue
                    found=
                    for suffix in ${part//,/ }; do
                        [[ $name != *"${suffix#files:}" ]] || found=1
                    done
                    [[ -z $found ]] || COMPREPLY+=("$name")
                done < <(compgen -f -- "$current") ;;
        esac
    done
}

_delassus() {
    local current=${COMP_WORDS[COMP_CWORD]} path='' count=0 awaited='' word i
    local commands options repeats arguments
    local -A valued
    COMPREPLY=()
    _delassus_table ''
    for ((i = 1; i < COMP_CWORD; ++i)); do
        word=${COMP_WORDS[i]}
        if [[ $word == '=' ]]; then
            continue
        elif [[ -n $awaited ]]; then
            awaited=
        elif [[ $word == -* ]]; then
            awaited=${valued[$word]-}
        elif [[ " $commands " == *" $word "* ]]; then
            path=${path:+$path }$word
            _delassus_table "$path"
        else
            ((++count))
        fi
    done
    [[ $current != '=' ]] || current=
    if [[ -n $awaited ]]; then
        _delassus_offer "$awaited"
    elif [[ $current == -* ]]; then
        COMPREPLY=($(compgen -W "$options" -- "$current"))
    elif [[ -n $commands ]]; then
        COMPREPLY=($(compgen -W "$commands" -- "$current"))
    else
        [[ -z $repeats || $count -lt ${#arguments[@]} ]] || count=$((${#arguments[@]} - 1))
        [[ $count -ge ${#arguments[@]} ]] || _delassus_offer "${arguments[count]}"
    fi
}
complete -F _delassus delassus
)SH";

}  // namespace

void write_bash_completion(Output& out, const CLI::App& program) {
    put(out, "# Completions of delassus for bash; written by `delassus documents bash`.\n");
    put(out,
        "# What a command takes: commands of its own, options, how values of options and arguments are completed.\n");
    put(out, "_delassus_table() {{\n    case $1 in\n");
    for (const auto& path : command_paths(program)) put_bash_row(out, path);
    put(out, "    esac\n}}\n{}", bash_functions);
}

}  // namespace delassus::command
