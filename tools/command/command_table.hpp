// SPDX-License-Identifier: BSD-3-Clause
// The command line as CLI11 knows it, in the form that the manual page and the completions of shells need.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace delassus::command {

/// The subcommands, options and arguments that a person may choose: no hidden ones.
[[nodiscard]] std::vector<const CLI::App*> subcommands(const CLI::App& app);
[[nodiscard]] std::vector<const CLI::Option*> options(const CLI::App& app);
[[nodiscard]] std::vector<const CLI::Option*> positionals(const CLI::App& app);

/// "--solver", "-o"; the long ones first.
[[nodiscard]] std::vector<std::string> flags(const CLI::Option& option);
[[nodiscard]] bool takes_a_value(const CLI::Option& option);
[[nodiscard]] bool may_be_repeated(const CLI::Option& option);

/// What a shell offers for a value: words, files, or nothing.
struct Completion {
    std::vector<std::string> words;     ///< the choices themselves
    std::string names;                  ///< the kind of names that `delassus documents KIND` prints at completion time
    bool list = false;                  ///< words or names follow one another, separated by commas
    bool files = false;                 ///< files with one of the suffixes, and folders on the way to them
    bool folders = false;               ///< folders
    std::vector<std::string> suffixes;  ///< ".yaml"; none: all files
};

/// Follows from the name of the value in --help: "associated|coulomb" are choices, others are rows of a table. Throws
/// std::logic_error if the table has no such row.
[[nodiscard]] Completion completion_of(const CLI::Option& option);

/// A subcommand with the words that lead to it: {"bench", "run"}; the program itself has none.
struct CommandPath {
    std::vector<std::string> words;
    const CLI::App* app;
};
/// All of them, the program first, each before its own subcommands.
[[nodiscard]] std::vector<CommandPath> command_paths(const CLI::App& program);

[[nodiscard]] std::string first_line(const std::string& text);
/// The text with some characters written otherwise.
[[nodiscard]] std::string replaced(const std::string& text, const std::map<char, std::string>& by);
[[nodiscard]] std::string joined(const std::vector<std::string>& words, std::string_view between = " ");

using Output = fmt::memory_buffer;
template <class... Values>
void put(Output& out, fmt::format_string<Values...> text, Values&&... values) {
    fmt::format_to(std::back_inserter(out), text, std::forward<Values>(values)...);
}

/// The documents.
void write_manual_page(Output& out, const CLI::App& program);
void write_bash_completion(Output& out, const CLI::App& program);
void write_zsh_completion(Output& out, const CLI::App& program);
void write_fish_completion(Output& out, const CLI::App& program);

}  // namespace delassus::command
