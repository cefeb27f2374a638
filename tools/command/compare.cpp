// SPDX-License-Identifier: BSD-3-Clause
// delassus compare: every solver on every problem, each in a process of its own.
#include "bench/compare.hpp"

#include <fmt/format.h>
#include <cmath>

#include "bench/writers.hpp"
#include "command.hpp"
#include "delassus/error.hpp"
#include "measuring.hpp"
#include "process/child_process.hpp"
#include "process/supervision.hpp"

namespace delassus::command {

namespace {

namespace fs = std::filesystem;

struct CompareArguments {
    std::vector<fs::path> problems;
    std::vector<std::string> solvers;
    bench::ComparisonSettings settings;
    std::string law;
    double memory_limit = 0.0;
    fs::path output = "delassus-compare";
    std::vector<fs::path> plugin_path;
    int jobs = 1;
    bool json = false;
    std::vector<std::string> command_line;
};

void check(const CompareArguments& arguments) {
    const auto& settings = arguments.settings;
    const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
    if (!positive(settings.tolerance))
        throw InputError(fmt::format("the tolerance is {}; it must be positive", settings.tolerance));
    if (!positive(settings.time_limit))
        throw InputError(fmt::format("the time limit is {} s; it must be positive and finite", settings.time_limit));
    if (settings.max_iterations < 0)
        throw InputError(fmt::format("the iteration limit is {}; it must not be negative", settings.max_iterations));
    if (settings.repeats < 1)
        throw InputError(fmt::format("the number of repeats is {}; it must be at least 1", settings.repeats));
    if (arguments.jobs != 1)
        throw InputError("--jobs must be 1: measurements that run side by side disturb one another");
    if (!(arguments.memory_limit >= 0.0) || arguments.memory_limit > 1e12)
        throw InputError(
            fmt::format("the memory limit is {} MiB; it must be a size, or 0 for none", arguments.memory_limit));
    if (!arguments.law.empty()) static_cast<void>(law_of(arguments.law));
}

/// Writes the three files; the sentence why there is no page, or nothing.
std::string write_files(const bench::Comparison& comparison, OutputFolder& folder) {
    return write_report_files(
        folder, {{"results.json", bench::json_text(comparison)}, {"results.csv", bench::csv_text(comparison)}},
        "report.html", [&] { return bench::html_text(comparison); });
}

int compare(const CompareArguments& arguments) {
    check(arguments);
    const auto folders = absolute(arguments.plugin_path);
    const Registry registry(folders);
    bench::ComparePlan plan;
    plan.problems = arguments.problems;
    plan.solvers = bench::solvers_of(arguments.solvers, registry);
    plan.settings = arguments.settings;
    plan.settings.law = arguments.law;
    plan.worker = {own_program(), folders, bytes_of_mebibytes(arguments.memory_limit), interrupted};
    UnoptimizedPlugins unoptimized;
    plan.worker.unoptimized = unoptimized.listener();
    OutputFolder output(arguments.output, "compare");

    install_interrupt_handler();
    std::string no_page;
    const auto complete = [&](bench::Comparison comparison) {
        comparison.command = bench::shell_line(arguments.command_line);
        comparison.folder = fs::current_path().string();
        return comparison;
    };
    bench::Comparison result;
    {
        MeasuringProgress progress;
        bench::CompareListener listener;
        listener.on_begin = [&](const bench::ProblemFacts& facts, const std::string& label, std::size_t number,
                                std::size_t total) {
            progress.begin(fmt::format("[{}/{}] {}  {}", number, total, facts.name, label));
        };
        listener.on_sample = [&](const CurveSample& sample) { progress.sample(sample); };
        listener.on_problem = [&](const bench::Comparison& so_far) {
            progress.clear();
            no_page = write_files(complete(so_far), output);
            if (arguments.json) return;
            fmt::print("{}\n", bench::table_text(so_far.problems.back()));
            std::fflush(stdout);
        };
        result = complete(bench::compare(plan, listener));
    }
    no_page = write_files(result, output);
    if (arguments.json) {
        fmt::print("{}", bench::json_text(result));
    } else {
        const fs::path shown = no_page.empty() ? arguments.output / "report.html" : arguments.output / "results.json";
        fmt::print("{}\n", shown.lexically_normal().string());
    }
    if (!no_page.empty()) fmt::print(stderr, "delassus: {}\n", no_page);
    unoptimized.warn();
    if (result.interrupted) fmt::print(stderr, "delassus: interrupted; the files hold what was reached\n");
    return result.all_solved() ? exit_solved : exit_not_converged;
}

}  // namespace

void add_compare(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<CompareArguments>();
    auto& settings = arguments->settings;
    auto* command = program.add_subcommand(
        "compare",
        "Compare solvers: a table, CSV, JSON, and error against time for a browser. Exit code 0 if each "
        "problem was solved by at least one solver, else 3");
    command->add_option("problem", arguments->problems, "Problem folders, or FCLib files (.hdf5)")
        ->required()
        ->type_name("PROBLEM");
    command
        ->add_option("--solvers", arguments->solvers, "Solvers by name or path, with options; all plugins if not given")
        ->type_name("A,B,C(KEY=VALUE)")
        ->expected(1)
        ->take_all();
    add_law(*command, arguments->law, "Friction law in place of the problems' own");
    command->add_option("--tolerance", settings.tolerance, "Natural error to reach [1e-6]")->type_name("REAL");
    command->add_option("--time-limit", settings.time_limit, "Limit of a solver's own time in one run [30]")
        ->type_name("SECONDS");
    command->add_option("--max-iterations", settings.max_iterations, "Limit of iterations [1e8]")->type_name("N");
    command
        ->add_option("--repeats", settings.repeats,
                     "Timed runs, of which the least time counts; only one if a run takes more than 5 s [3]")
        ->type_name("N");
    command->add_option("--memory-limit", arguments->memory_limit, "Address space of each solver's process [none]")
        ->type_name("MIB");
    command->add_option("--jobs", arguments->jobs, "Number of runs at a time; only 1 is allowed")->type_name("1");
    command->add_option("-o,--output", arguments->output, "Folder for report.html, results.json and results.csv")
        ->capture_default_str()
        ->type_name("DIR");
    add_plugin_path(*command, arguments->plugin_path);
    command->add_flag("--json", arguments->json, "Print results.json in place of the tables");
    command->callback([arguments, &action] {
        action.run = [arguments] {
            arguments->command_line = own_command_line();
            return compare(*arguments);
        };
    });
}

}  // namespace delassus::command
