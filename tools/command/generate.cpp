// SPDX-License-Identifier: BSD-3-Clause
// delassus generate: problems of real mechanics, made from a few parameters.
#include <fmt/format.h>

#include <charconv>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/problem_files.hpp"

namespace delassus::command {

namespace {

struct GenerateArguments {
    std::string kind;
    std::vector<std::string> settings;
    std::filesystem::path output;
    bool list = false;
};

double number(const std::string& key, const std::string& text) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
        throw InputError(fmt::format("parameter \"{}\" is \"{}\"; it must be a number", key, text));
    return value;
}

void print_parameters(const Generator& generator) {
    fmt::print("{}: {}\n", generator.name, generator.doc);
    for (const auto& parameter : generator.parameters)
        fmt::print("  {}={} {}\n      {} (from {} to {})\n", parameter.key, parameter.default_value, parameter.unit,
                   parameter.doc, parameter.minimum, parameter.maximum);
}

int generate_problem(const GenerateArguments& arguments) {
    if (arguments.list) {
        for (const auto& generator : generators())
            if (arguments.kind.empty() || arguments.kind == generator.name) print_parameters(generator);
        return exit_solved;
    }
    if (arguments.kind.empty() || arguments.output.empty())
        throw InputError("give a kind and the folder or file to write, or --list");
    std::map<std::string, double> values;
    for (const auto& setting : arguments.settings) {
        const auto [key, text] = parse_setting(setting);
        values[key] = number(key, text);
    }
    const Problem problem = generate(arguments.kind, values);
    write_problem(problem, arguments.output);
    fmt::print("{}: n = {}, m = {}\n", arguments.output.string(), problem.n(), problem.m());
    return exit_solved;
}

}  // namespace

void add_generate(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<GenerateArguments>();
    auto* command = program.add_subcommand("generate", "Make a problem of real mechanics from a few parameters");
    command->add_option("kind", arguments->kind, "What to make; see --list")->type_name("KIND");
    command->add_option("output", arguments->output, "Problem folder, or FCLib file (.hdf5)")->type_name("OUT");
    command->add_option("--set", arguments->settings, "Parameter of the kind")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->take_all();
    command->add_flag("--list", arguments->list, "List the kinds and their parameters");
    command->callback([arguments, &action] { action.run = [arguments] { return generate_problem(*arguments); }; });
}

}  // namespace delassus::command
