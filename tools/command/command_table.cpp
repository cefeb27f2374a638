// SPDX-License-Identifier: BSD-3-Clause
#include "command_table.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace delassus::command {

namespace {

/// How values are completed, by their names in --help.
const std::map<std::string, Completion>& completions() {
    const auto named = [](const std::string& kind, bool list = false) {
        Completion result;
        result.names = kind;
        result.list = list;
        return result;
    };
    const auto files = [](std::vector<std::string> suffixes, const std::string& names = "") {
        Completion result;
        result.files = true;
        result.names = names;
        result.suffixes = std::move(suffixes);
        return result;
    };
    Completion folders;
    folders.folders = true;
    const Completion nothing;
    static const std::map<std::string, Completion> table = {
        {"NAME|LIB", files({".so"}, "solvers")},
        {"SOLVER[(KEY=VALUE,…)]", named("solvers")},
        {"A,B,C(KEY=VALUE)", named("solvers", true)},
        {"METHOD[(KEY=VALUE,…)]", named("integrators")},
        {"KIND", named("kinds")},
        {"SUITE", files({".yaml", ".yml"}, "suites")},
        {"SCENE", files({".yaml", ".yml"})},
        {"PROBLEM", files({".h5", ".hdf5"})},
        {"IN", files({".h5", ".hdf5"})},
        {"MODEL", files({".xml", ".mjcf", ".urdf", ".sdf", ".world"})},
        {"LIB", files({".so"})},
        {"FILE|DIR", files({})},
        {"PLUGIN", named("solvers")},
        {"OUT", files({})},
        {"FILE", files({})},
        {"DIR", folders},
        {"KEY=VALUE", nothing},
        {"PATH=VALUE", nothing},
        {"NAME", nothing},
        {"AXIS", nothing},
        {"WHERE", nothing},
        {"REAL", nothing},
        {"EPS", nothing},
        {"SECONDS", nothing},
        {"METRES", nothing},
        {"MINUTES", nothing},
        {"M_OR_RAD", nothing},
        {"SHARE", nothing},
        {"MIB", nothing},
        {"N", nothing},
        {"1", nothing},
    };
    return table;
}

bool are_choices(const std::string& type) {
    return type.find('|') != std::string::npos && std::none_of(type.begin(), type.end(), [](unsigned char c) {
               return std::isupper(c) != 0 || std::isspace(c) != 0;
           });
}

void add_paths(std::vector<CommandPath>& paths, const CLI::App& app, const std::vector<std::string>& words) {
    paths.push_back({words, &app});
    for (const CLI::App* one : subcommands(app)) {
        auto longer = words;
        longer.push_back(one->get_name());
        add_paths(paths, *one, longer);
    }
}

}  // namespace

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

std::vector<std::string> flags(const CLI::Option& option) {
    std::vector<std::string> result;
    for (const auto& name : option.get_lnames()) result.push_back("--" + name);
    for (const auto& name : option.get_snames()) result.push_back("-" + name);
    return result;
}

bool takes_a_value(const CLI::Option& option) {
    return option.get_items_expected_max() > 0;
}

bool may_be_repeated(const CLI::Option& option) {
    return option.get_items_expected_max() > 1 || option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
}

Completion completion_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    if (are_choices(type)) {
        Completion result;
        std::istringstream choices(type);
        for (std::string word; std::getline(choices, word, '|');) result.words.push_back(word);
        return result;
    }
    const auto row = completions().find(type);
    if (row == completions().end())
        throw std::logic_error(
            fmt::format("{} takes a value of the type \"{}\"; the table of completions "
                        "(tools/command/command_table.cpp) has no such row",
                        option.get_name(), type));
    return row->second;
}

std::vector<CommandPath> command_paths(const CLI::App& program) {
    std::vector<CommandPath> paths;
    add_paths(paths, program, {});
    return paths;
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

std::string joined(const std::vector<std::string>& words, std::string_view between) {
    return fmt::format("{}", fmt::join(words, between));
}

}  // namespace delassus::command
