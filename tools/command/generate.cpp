// SPDX-License-Identifier: BSD-3-Clause
// delassus generate: problems of real mechanics, made from a few parameters.
#include <fmt/format.h>

#include <charconv>

#include "command.hpp"
#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/generate_partitioned.hpp"
#include "delassus/partitioned_files.hpp"
#include "delassus/problem_files.hpp"
#include "on_all_processes.hpp"
#include "partition_report.hpp"
#include "support/output_folder.hpp"

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

/// Each process makes and writes its share.
int generate_in_parts(const std::map<std::string, double>& values, const std::filesystem::path& output) {
    return on_all_processes([&](const std::shared_ptr<const Communicator>& run) {
        std::string text = "pile:";
        for (const auto& [key, value] : values) text += fmt::format("{}={},", key, value);
        const PartitionedProblem part = generate_partitioned(*run, pile_parameters(text));
        write_partitioned(*run, part, output);
        const PartitionQuality quality = measure_partition(*run, part);
        if (run->rank() == 0) {
            fmt::print("{}: n = {}, m = {}, {} contacts\n", output.string(), part.n_all(), part.m_all(), quality.cones);
            print_quality(quality, run->size());
        }
        print_memory(*run);
        return static_cast<int>(exit_solved);
    });
}

int generate_problem(const GenerateArguments& arguments) {
    if (arguments.list) {
        for (const auto& generator : generators())
            if (arguments.kind.empty() || arguments.kind == generator.name) print_parameters(generator);
        return exit_solved;
    }
    if (arguments.kind.empty() || arguments.output.empty())
        throw InputError("give a kind and the folder or file to write, or --list");
    require_replaceable(arguments.output, "problem");
    std::map<std::string, double> values;
    for (const auto& setting : arguments.settings) {
        const auto [key, text] = parse_setting(setting);
        values[key] = number(key, text);
    }
    if (arguments.kind == "pile" && arguments.output.extension() == ".h5")
        return generate_in_parts(values, arguments.output);
    if (process_count() > 1)
        throw InputError("several processes can only make a pile in a file that ends in .h5; start one process");
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
    command
        ->add_option("output", arguments->output,
                     "Problem folder, or HDF5 file (.h5, .hdf5 for FCLib); replaced only if delassus wrote it")
        ->type_name("OUT");
    command->add_option("--set", arguments->settings, "Parameter of the kind")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->take_all();
    command->add_flag("--list", arguments->list, "List the kinds and their parameters");
    command->callback([arguments, &action] { action.run = [arguments] { return generate_problem(*arguments); }; });
}

}  // namespace delassus::command
