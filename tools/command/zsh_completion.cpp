// SPDX-License-Identifier: BSD-3-Clause
// Completions for zsh: a function for each command, which hands its table to _arguments.
#include "command_table.hpp"

namespace delassus::command {

namespace {

/// Within single quotes, in the descriptions of _describe and _arguments.
std::string zsh_quoted(const std::string& text) {
    return replaced(first_line(text), {{'\'', "'\\''"}, {':', "\\:"}, {'[', "\\["}, {']', "\\]"}});
}

/// An action of _arguments. It begins with a space where the function wants no options of compadd before its arguments.
std::string zsh_action(const Completion& completion) {
    if (!completion.words.empty()) return "(" + joined(completion.words) + ")";
    std::vector<std::string> ends;
    for (const auto& suffix : completion.suffixes) ends.push_back(suffix.substr(1));
    std::string pattern = ends.empty() ? "*" : "*." + joined(ends, "|");
    if (ends.size() > 1) pattern = "*.(" + joined(ends, "|") + ")";  // of one, zsh would make qualifiers
    if (completion.list) return " _delassus_list " + completion.names;
    if (!completion.names.empty())
        return " _delassus_names " + completion.names + (completion.files ? " \"" + pattern + "\"" : "");
    if (completion.files) return "_files -g \"" + pattern + "\"";
    return completion.folders ? "_files -/" : " ";
}

void put_zsh_options(Output& out, const CLI::App& app) {
    for (const CLI::Option* one : options(app)) {
        const auto names = flags(*one);
        const std::string value = takes_a_value(*one) ? ":" + zsh_quoted(replaced(one->get_type_name(), {{':', ""}})) +
                                                            ":" + zsh_action(completion_of(*one))
                                                      : "";
        for (const auto& flag : names)
            put(out, "    '{}{}[{}]{}' \\\n", may_be_repeated(*one) ? "*" : "(" + joined(names) + ")", flag,
                zsh_quoted(one->get_description()), value);
    }
}

void put_zsh_function(Output& out, const CommandPath& path) {
    const std::string name = path.words.empty() ? "" : "_" + joined(path.words, "_");
    const auto inner = subcommands(*path.app);
    put(out, "\n_delassus{}() {{\n", name);
    if (!inner.empty()) {
        put(out, "  local -a commands=(\n");
        for (const CLI::App* one : inner)
            put(out, "    '{}:{}'\n", one->get_name(), zsh_quoted(one->get_description()));
        put(out, "  )\n  if (( CURRENT > 2 )); then\n    shift words\n    (( CURRENT-- ))\n    case $words[1] in\n");
        for (const CLI::App* one : inner)
            put(out, "      {}) _delassus{}_{} ;;\n", one->get_name(), name, one->get_name());
        put(out,
            "    esac\n    return\n  fi\n  if [[ $PREFIX != -* ]]; then\n    _describe command commands\n    return\n  "
            "fi\n");
    }
    put(out, "  _arguments -S \\\n");
    put_zsh_options(out, *path.app);
    int number = 1;
    for (const CLI::Option* one : positionals(*path.app))
        put(out, "    '{}:{}:{}' \\\n", may_be_repeated(*one) ? "*" : std::to_string(number++),
            zsh_quoted(one->get_name(true)), zsh_action(completion_of(*one)));
    put(out, "    && return\n}}\n");
}

constexpr const char* zsh_functions = R"SH(
# Names that delassus knows, and files of a pattern where one is given.
_delassus_names() {
  local -a names=(${(f)"$(delassus documents $1 2>/dev/null)"})
  compadd -a names
  (( $# < 2 )) || _files -g "$2"
}

# Names that follow one another, separated by commas.
_delassus_list() {
  local -a names=(${(f)"$(delassus documents $1 2>/dev/null)"})
  compset -P '*,'
  compadd -S '' -a names
}
)SH";

}  // namespace

void write_zsh_completion(Output& out, const CLI::App& program) {
    put(out, "#compdef delassus\n# Completions of delassus for zsh; written by `delassus documents zsh`.\n{}",
        zsh_functions);
    for (const auto& path : command_paths(program)) put_zsh_function(out, path);
    put(out,
        "\nif [[ $funcstack[1] == _delassus ]]; then\n  _delassus \"$@\"\nelse\n  compdef _delassus delassus\nfi\n");
}

}  // namespace delassus::command
