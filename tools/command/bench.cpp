// SPDX-License-Identifier: BSD-3-Clause
// delassus bench: suites of solvers on problems and timesteppers on scenes; reports; results before and after a change.
#include <fmt/format.h>

#include "bench/analysis.hpp"
#include "bench/bench_writers.hpp"
#include "bench/compare.hpp"
#include "bench/compare_sets.hpp"
#include "bench/reference.hpp"
#include "bench/run_suite.hpp"
#include "bench_relations.hpp"
#include "command.hpp"
#include "delassus/error.hpp"
#include "measuring.hpp"
#include "process/child_process.hpp"
#include "process/supervision.hpp"
#include "support/json.hpp"

namespace delassus::command {

namespace {

namespace fs = std::filesystem;

struct BenchArguments {
    std::string suite;
    fs::path output, cache, folder, before, after;
    std::vector<fs::path> plugin_path;
    std::vector<std::string> only;
    bool any_machine = false, json = false;
    RelationsArguments relations;
};

/// Writes all that is made of results.jsonl, prints the summary and the path of the page.
void report(OutputFolder& output) {
    const fs::path& folder = output.path();
    const bench::ResultSet results = bench::read_results(folder);
    const bench::Json analysis = bench::analyse(results);
    const std::string summary = bench::summary_markdown(results, analysis);
    std::vector<std::pair<std::string, std::string>> files = {{"summary.md", summary},
                                                              {"results.csv", bench::solves_csv(results)}};
    if (!results.cells.empty()) files.emplace_back("cells.csv", bench::cells_csv(results));
    if (!results.simulations.empty()) files.emplace_back("simulations.csv", bench::simulations_csv(results));
    const auto no_page =
        write_report_files(output, files, "report.html", [&] { return bench::bench_page(results, analysis); });
    fmt::print("{}\n{}\n", summary,
               (folder / (no_page.empty() ? "report.html" : "summary.md")).lexically_normal().string());
    if (!no_page.empty()) fmt::print(stderr, "delassus: {}\n", no_page);
}

int run_bench(BenchArguments& arguments) {
    const auto folders = absolute(arguments.plugin_path);
    if (is_relations(arguments.suite)) {
        arguments.relations.output = arguments.output;
        arguments.relations.only = arguments.only;
        arguments.relations.plugin_path = folders;
        return run_relations(arguments.relations);
    }
    if (const auto* option = arguments.relations.given())
        throw InputError(fmt::format("{} is for `delassus bench run relations`", option->get_name()));
    const Registry registry(folders);
    bench::RunPlan plan;
    plan.suite = bench::read_suite(bench::find_suite(arguments.suite), registry);
    if (!arguments.only.empty()) bench::keep_axes(plan.suite, arguments.only);
    OutputFolder output = bench::open_results(
        !arguments.output.empty() ? arguments.output : fs::path("delassus-bench-" + plan.suite.file.stem().string()));
    plan.output = &output;
    const fs::path own_cache = output.path() / "references";
    plan.cache = fs::absolute(!arguments.cache.empty() ? arguments.cache : bench::cache_folder(own_cache));
    if (plan.cache == fs::absolute(own_cache)) output.add_folder("references");
    plan.worker.command = own_program();
    plan.worker.plugin_path = folders;
    plan.worker.cancelled = interrupted;
    plan.command = bench::shell_line(own_command_line());
    plan.folder = fs::current_path().string();
    UnoptimizedPlugins unoptimized;
    plan.worker.unoptimized = unoptimized.listener();
    install_interrupt_handler();
    bench::RunCounts counts;
    {
        MeasuringProgress progress;
        bench::RunListener listener;
        listener.on_begin = [&](const std::string& what, std::size_t number, std::size_t total) {
            progress.begin(fmt::format("[{}/{}] {}", number, total, what));
        };
        listener.on_sample = [&](const CurveSample& sample) { progress.sample(sample); };
        counts = bench::run_suite(plan, registry, listener);
    }
    for (const auto& sentence : plan.suite.left_out) fmt::print(stderr, "delassus: left out: {}\n", sentence);
    if (counts.skipped > 0)
        fmt::print(stderr, "delassus: {} runs were done before and are taken from {}\n", counts.skipped,
                   (output.path() / "results.jsonl").string());
    report(output);
    unoptimized.warn();
    if (!counts.interrupted) return exit_solved;
    fmt::print(stderr, "delassus: interrupted; the same command goes on from there\n");
    return exit_not_converged;
}

int compare_results(const BenchArguments& arguments) {
    const auto comparison = bench::compare_sets(bench::read_results(arguments.before),
                                                bench::read_results(arguments.after), arguments.any_machine);
    if (arguments.json) {
        fmt::print("{}\n", json_text(comparison, 1));
    } else {
        fmt::print("A is {}, B is {}; ratios of setup and solve, below 1 where B is faster\n\n{}",
                   arguments.before.string(), arguments.after.string(), bench::compare_text(comparison));
    }
    return exit_solved;
}

int list_suites(const BenchArguments& arguments) {
    const Registry registry(absolute(arguments.plugin_path));
    for (const auto& suite : bench::shipped_suites(registry))
        fmt::print("{}: {}\n    {}\n    {}\n", suite.name, suite.title, suite.description, suite.file.string());
    fmt::print("{}\n", about_relations());
    return exit_solved;
}

}  // namespace

void add_bench(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<BenchArguments>();
    auto* bench = program.add_subcommand(
        "bench", "Run suites of solvers on problems and timesteppers on scenes, and report what they cost and reach");
    bench->require_subcommand(1);

    auto* run = bench->add_subcommand(
        "run",
        "Run a suite, or what is left of it, and write the report. Exit code 0 if all of it was run (and, of "
        "`relations`, nothing was violated), else 3");
    run->add_option("suite", arguments->suite, "Suite file (YAML), or the name of one of `delassus bench list`")
        ->required()
        ->type_name("SUITE");
    run->add_option("-o,--output", arguments->output,
                    "Folder for results.jsonl, report.html, summary.md and CSV files [delassus-bench-SUITE]")
        ->type_name("DIR");
    run->add_option("--only", arguments->only, "Run only the axis, or the relation, of this name; may be given again")
        ->type_name("AXIS")
        ->allow_extra_args(false);
    run->add_option("--cache", arguments->cache, "Folder of reference solutions [~/.cache/delassus/references]")
        ->type_name("DIR");
    add_relations_options(*run, arguments->relations);
    add_plugin_path(*run, arguments->plugin_path);
    run->callback([arguments, &action] { action.run = [arguments] { return run_bench(*arguments); }; });

    auto* again = bench->add_subcommand("report", "Write the report of results again");
    again->add_option("folder", arguments->folder, "Folder of `delassus bench run`")->required()->type_name("DIR");
    again->callback([arguments, &action] {
        action.run = [arguments] {
            static_cast<void>(bench::read_results(arguments->folder));
            OutputFolder output = bench::open_results(arguments->folder);
            report(output);
            return exit_solved;
        };
    });

    auto* compare =
        bench->add_subcommand("compare", "Compare the times of two folders of results, as ratios with their spread");
    compare->add_option("a", arguments->before, "Results before a change")->required()->type_name("DIR");
    compare->add_option("b", arguments->after, "Results after it")->required()->type_name("DIR");
    compare->add_flag("--any-machine", arguments->any_machine, "Compare results even if their machines differ");
    compare->add_flag("--json", arguments->json, "Print the comparison as JSON");
    compare->callback([arguments, &action] { action.run = [arguments] { return compare_results(*arguments); }; });

    auto* list = bench->add_subcommand("list", "List the suites that come with the library");
    add_plugin_path(*list, arguments->plugin_path);
    list->callback([arguments, &action] { action.run = [arguments] { return list_suites(*arguments); }; });
}

}  // namespace delassus::command
