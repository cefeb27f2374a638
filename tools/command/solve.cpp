// SPDX-License-Identifier: BSD-3-Clause
// delassus solve: one problem, one solver.
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <optional>

#include "command.hpp"
#include "delassus/communicator.hpp"
#include "delassus/config.hpp"
#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/generate_partitioned.hpp"
#include "delassus/partitioned_files.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/solver.hpp"
#include "on_all_processes.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "process/terminal.hpp"
#include "solve_in_parts.hpp"
#include "support/output_folder.hpp"

namespace delassus::command {

namespace {

struct SolveArguments {
    std::filesystem::path problem;
    std::string solver;
    std::vector<std::string> settings;
    std::string law, partition = "auto";
    std::optional<double> tolerance, time_limit;
    std::optional<std::int64_t> max_iterations;
    std::filesystem::path warm_start, solution, config;
    std::vector<std::filesystem::path> plugin_path;
    bool json = false, curve = false;
};

/// The file's configuration with the flags on top.
Config configuration(const SolveArguments& arguments) {
    Config config = arguments.config.empty() ? Config{} : read_config(arguments.config);
    auto& solver = config.solver;
    if (!arguments.solver.empty()) choose(solver, arguments.solver);
    if (solver.name.empty()) solver.name = "auto";
    for (const auto& setting : arguments.settings) {
        auto [key, text] = parse_setting(setting);
        solver.options.insert_or_assign(std::move(key), std::move(text));
    }
    if (arguments.tolerance) solver.tolerance = arguments.tolerance;
    if (arguments.time_limit) solver.time_limit = arguments.time_limit;
    if (arguments.max_iterations) solver.max_iterations = arguments.max_iterations;
    if (!arguments.law.empty()) solver.law = law_of(arguments.law);
    auto folders = absolute(arguments.plugin_path);
    folders.insert(folders.end(), config.plugin_path.begin(), config.plugin_path.end());
    config.plugin_path = std::move(folders);
    return config;
}

/// A solver that can share the problem, and several processes; or one, where the problem is in a file that is made to
/// be shared and the solver was named.
bool is_partitioned_run(const Registry& registry, const SolverConfig& solver, const std::filesystem::path& problem) {
    const bool made_to_be_shared = is_partitioned_file(problem) || is_generated_problem(problem.string());
    if (process_count() == 1 && (solver.name == "auto" || !made_to_be_shared)) return false;
    const std::uint64_t capabilities = is_library_path(solver.name) ? registry.load(solver.name)->info().capabilities
                                                                    : solver_info(registry, solver.name).capabilities;
    return (capabilities & DELASSUS_CAN_PARTITIONED) != 0;
}

int solve_whole(const SolveArguments& arguments, const Registry& registry, const Config& config) {
    SolveSettings settings = config.solver.settings();
    settings.record_curve = arguments.curve;

    Problem data = read_problem(arguments.problem);
    if (config.solver.law) data.law = *config.solver.law;
    const PreparedProblem problem(std::move(data));
    Solution solution;
    if (!arguments.warm_start.empty()) {
        solution = read_solution(arguments.warm_start, problem.problem().n(), problem.problem().m());
        settings.warm_start = true;
    }

    const std::string& name = config.solver.name;
    const bool terminal = isatty(STDERR_FILENO) != 0 && process_rank() == 0;
    settings.cancelled = interrupted;
    if (terminal) {
        settings.record_curve = true;
        settings.on_progress = [](const CurveSample& sample) {
            show_line(fmt::format("  iteration {}  {:.1f} s  natural {:.2e} ", sample.iteration, sample.seconds,
                                  sample.natural));
        };
    }
    install_interrupt_handler();

    StdoutGuard guard;
    SolveReport report = make_solver(registry, config.solver).solve(problem, solution, settings);
    if (const auto bytes = guard.release())
        fmt::print(stderr, "delassus: the solver {} wrote {} bytes to standard output; they were dropped\n", name,
                   bytes);
    if (terminal) show_line("");
    if (!arguments.curve) report.curve.clear();

    if (process_rank() == 0) {
        const std::string json = to_json(report);
        if (!arguments.solution.empty()) write_solution(solution, json, arguments.solution);
        if (arguments.json) {
            fmt::print("{}", json);
        } else {
            print_report(report);
        }
    }
    return report.status == Status::Solved ? exit_solved : exit_not_converged;
}

int solve(const SolveArguments& arguments) {
    const bool several = process_count() > 1;
    const auto body = [&](const std::shared_ptr<const Communicator>& run) {
        const Config config = configuration(arguments);
        if (!arguments.solution.empty()) require_replaceable(arguments.solution, "solution");
        const Registry registry(config.plugin_path);
        if (is_partitioned_run(registry, config.solver, arguments.problem))
            if (const auto code =
                    solve_in_parts(run,
                                   {arguments.problem, arguments.warm_start, arguments.solution, arguments.json,
                                    arguments.curve, partitioning_of(arguments.partition)},
                                   registry, config))
                return *code;
        return solve_whole(arguments, registry, config);
    };
    return several ? on_all_processes(body) : body(single_process());
}

}  // namespace

void print_report(const SolveReport& report) {
    fmt::print("{} with {} {}: {}", report.problem, report.solver, report.version, name_of(report.status));
    fmt::print(" after {} iterations, {:.3g} s setup + {:.3g} s solve\n", report.iterations, report.seconds_setup,
               report.seconds_solve);
    if (!report.message.empty()) fmt::print("  {}\n", report.message);
    fmt::print("  error");
    for (const ErrorMeasure& measure : error_measures)
        if (measure.is_error) fmt::print("  {} {:.2e}", measure.name, report.error.*measure.value);
    fmt::print("\n");
}

void add_solve(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<SolveArguments>();
    auto* command = program.add_subcommand("solve", "Solve a problem with one solver");
    command
        ->add_option("problem", arguments->problem,
                     "Problem folder, or FCLib file (.hdf5), or HDF5 file of a problem (.h5)")
        ->required()
        ->type_name("PROBLEM");
    command->add_option("--solver", arguments->solver, "Name of a plugin, or path of a shared library [auto]")
        ->type_name("SOLVER[(KEY=VALUE,…)]");
    command->add_option("--set", arguments->settings, "Option of the solver; see `delassus plugins info NAME`")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->take_all();
    add_law(*command, arguments->law, "Friction law in place of the problem's own");
    command->add_option("--tolerance", arguments->tolerance, "Natural error to reach [1e-8]")->type_name("REAL");
    command->add_option("--max-iterations", arguments->max_iterations, "Limit of iterations [1000000]")->type_name("N");
    command->add_option("--time-limit", arguments->time_limit, "Limit of the solver's own time [none]")
        ->type_name("SECONDS");
    command->add_option("--warm-start", arguments->warm_start, "Solution folder to start from")->type_name("DIR");
    command
        ->add_option("--solution", arguments->solution,
                     "Folder to write the solution to; in parts and of an HDF5 problem, a file")
        ->type_name("DIR");
    command
        ->add_option("--partition", arguments->partition,
                     "Under mpirun, who gets which bodies; file: by the order of the file [auto]")
        ->type_name("auto|file|scotch");
    command->add_option("--config", arguments->config, "YAML file with the same settings; flags override it")
        ->type_name("FILE");
    add_plugin_path(*command, arguments->plugin_path);
    command->add_flag("--curve", arguments->curve, "Add the error-against-time curve to the report");
    command->add_flag("--json", arguments->json, "Print the report as JSON");
    command->callback([arguments, &action] { action.run = [arguments] { return solve(*arguments); }; });
}

}  // namespace delassus::command
