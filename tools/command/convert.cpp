// SPDX-License-Identifier: BSD-3-Clause
// delassus convert: between problem folders, problems in one file and FCLib files.
#include <fmt/format.h>

#include "command.hpp"
#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "support/output_folder.hpp"

namespace delassus::command {

namespace {

struct ConvertArguments {
    std::filesystem::path input, output;
    std::string law;
};

int convert(const ConvertArguments& arguments) {
    if (process_count() > 1) throw InputError("convert works in one process; start it without mpirun");
    require_replaceable(arguments.output, "problem");
    Problem problem = read_problem(arguments.input);
    if (!arguments.law.empty()) problem.law = law_of(arguments.law);
    write_problem(problem, arguments.output);
    fmt::print("{}: n = {}, m = {}\n", arguments.output.string(), problem.n(), problem.m());
    return exit_solved;
}

}  // namespace

void add_convert(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<ConvertArguments>();
    auto* command = program.add_subcommand(
        "convert",
        "Convert a problem; the name decides the form: .h5 is one HDF5 file, .hdf5 FCLib, anything else a folder");
    command->add_option("input", arguments->input, "Problem folder, or HDF5 file (.h5, .hdf5)")
        ->required()
        ->type_name("IN");
    command
        ->add_option("output", arguments->output,
                     "Problem folder, or HDF5 file (.h5, .hdf5); replaced only if delassus wrote it")
        ->required()
        ->type_name("OUT");
    add_law(*command, arguments->law, "Friction law of the result (FCLib files mean coulomb)");
    command->callback([arguments, &action] { action.run = [arguments] { return convert(*arguments); }; });
}

}  // namespace delassus::command
