// SPDX-License-Identifier: BSD-3-Clause
#include "solve_in_parts.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "command.hpp"
#include "delassus/error.hpp"
#include "delassus/generate_partitioned.hpp"
#include "delassus/partitioned_files.hpp"
#include "delassus/prepared_part.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/repartition.hpp"
#include "delassus/solver_config.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "process/terminal.hpp"

namespace delassus::command {

namespace {

/// Own entries of a vector that every process has in the order that the problem had before it was moved.
std::vector<double> own_of(const std::vector<double>& all, const std::vector<std::int64_t>& start, int rank,
                           const std::vector<std::int64_t>& origin) {
    const auto r = static_cast<std::size_t>(rank);
    if (origin.empty()) return {all.begin() + start[r], all.begin() + start[r + 1]};
    std::vector<double> own;
    for (const auto number : origin) own.push_back(all[static_cast<std::size_t>(number)]);
    return own;
}

/// A solution folder that every process reads, or a file of which each reads its slice.
Solution read_start(const Communicator& run, const std::filesystem::path& path, const PartitionedProblem& part) {
    if (std::filesystem::is_regular_file(path)) return read_partitioned_solution(run, path, part);
    Solution own;
    together(run, [&] {
        if (std::max(part.n_all(), part.m_all()) > std::numeric_limits<std::int32_t>::max())
            throw InputError(fmt::format("{}: a folder holds no solution of this size; give a file", path.string()));
        const Solution start =
            read_solution(path, static_cast<std::int32_t>(part.n_all()), static_cast<std::int32_t>(part.m_all()));
        own = {own_of(start.x, part.column_start, run.rank(), part.column_origin),
               own_of(start.lambda, part.row_start, run.rank(), part.row_origin)};
    });
    return own;
}

/// On process 0 the vector of which every process has a part, in the order that it had before it was moved.
std::vector<double> whole_of(const Communicator& run, const std::vector<double>& own,
                             const std::vector<std::int64_t>& start, const std::vector<std::int64_t>& origin) {
    struct Entry {
        std::int64_t place;
        double value;
    };
    std::vector<Entry> entries;
    for (std::size_t k = 0; k < own.size(); ++k)
        entries.push_back(
            {origin.empty() ? start[static_cast<std::size_t>(run.rank())] + static_cast<std::int64_t>(k) : origin[k],
             own[k]});
    std::vector<std::vector<std::byte>> to(static_cast<std::size_t>(run.size()));
    const auto* bytes = reinterpret_cast<const std::byte*>(entries.data());
    to[0].assign(bytes, bytes + entries.size() * sizeof(Entry));
    std::vector<double> whole(run.rank() == 0 ? static_cast<std::size_t>(start.back()) : 0);
    for (const auto& from : run.exchange(to)) {
        const auto* first = reinterpret_cast<const Entry*>(from.data());
        for (const Entry& entry : std::span(first, from.size() / sizeof(Entry)))
            whole[static_cast<std::size_t>(entry.place)] = entry.value;
    }
    return whole;
}

void print_processes(const std::vector<ProcessReport>& processes) {
    constexpr double MiB = 1048576.0;
    for (std::size_t p = 0; p < processes.size(); ++p) {
        const ProcessReport& one = processes[p];
        fmt::print("  process {}: {} columns, {} rows, {} ghosts; {:.1f} MiB at most, {:.1f} MiB sent by the core", p,
                   one.n, one.m, one.ghosts, static_cast<double>(one.peak_memory) / MiB,
                   static_cast<double>(one.bytes_sent) / MiB);
        if (one.cost.bytes_sent >= 0)
            fmt::print(", {:.1f} MiB by the solver", static_cast<double>(one.cost.bytes_sent) / MiB);
        fmt::print("\n");
    }
    // Seconds by phase, where the solver tells them: a table.
    std::vector<delassus_phase> told;
    for (int k = 0; k < DELASSUS_PHASE_COUNT; ++k)
        if (std::any_of(processes.begin(), processes.end(),
                        [k](const ProcessReport& one) { return one.cost.phases[static_cast<std::size_t>(k)] > 0.0; }))
            told.push_back(static_cast<delassus_phase>(k));
    if (told.empty()) return;
    const auto heading = [](std::string name) {
        std::replace(name.begin(), name.end(), '_', ' ');
        fmt::print("  {:>14}", name);
    };
    fmt::print("  seconds  ");
    heading("setup");
    for (const delassus_phase phase : told) heading(std::string(name_of(phase)));
    heading("other");
    fmt::print("\n");
    for (std::size_t p = 0; p < processes.size(); ++p) {
        const SolveCost& cost = processes[p].cost;
        double other = cost.solve;
        fmt::print("  {:>9}  {:>14.3g}", p, cost.setup);
        for (const delassus_phase phase : told) {
            const double seconds = cost.phases[static_cast<std::size_t>(phase)];
            fmt::print("  {:>14.3g}", seconds);
            if (seconds > 0.0) other -= seconds;
        }
        fmt::print("  {:>14.3g}\n", std::max(0.0, other));
    }
}

}  // namespace

std::optional<int> solve_in_parts(const std::shared_ptr<const Communicator>& run, const PartsArguments& arguments,
                                  const Registry& registry, const Config& config) {
    SolveSettings settings = config.solver.settings();
    settings.record_curve = arguments.curve;
    bool file = false;
    together(*run, [&] { file = is_partitioned_file(arguments.problem); });
    const auto read = [&] {
        if (is_generated_problem(arguments.problem.string()))
            return generate_partitioned(*run, pile_parameters(arguments.problem.string()));
        if (file) return read_partitioned(*run, arguments.problem);
        Problem data;
        together(*run, [&] { data = read_problem(arguments.problem); });
        return part_of(*run, std::move(data));
    };
    const auto placed = [&] {
        PartitionedProblem part = repartition(*run, read(), arguments.partition);
        if (config.solver.law) part.law = *config.solver.law;
        return part;
    };
    const PreparedPart problem(run, placed());
    // The linear solvers that get the whole problem factor it once; what a file holds may be too large for that.
    const bool made_to_be_shared = file || is_generated_problem(arguments.problem.string());
    const bool linear = (problem.needs() & UINT64_C(0xffff) & ~DELASSUS_CAN_FREE) == 0;
    if (config.solver.name == "auto" && linear && !made_to_be_shared) return std::nullopt;
    Solution own;
    if (!arguments.warm_start.empty()) {
        own = read_start(*run, arguments.warm_start, problem.problem());
        settings.warm_start = true;
    }

    const std::string& name = config.solver.name;
    const bool terminal = isatty(STDERR_FILENO) != 0 && run->rank() == 0;
    settings.cancelled = interrupted;
    if (terminal)
        settings.on_progress = [](const CurveSample& sample) {
            show_line(fmt::format("  iteration {}  {:.1f} s ", sample.iteration, sample.seconds));
        };
    install_interrupt_handler();

    StdoutGuard guard;
    SolveReport report;
    {
        Solver solver = make_solver(registry, config.solver, *run);
        const std::string refusal = solver.refusal(problem, settings);
        if (!refusal.empty() && name == "auto") return std::nullopt;
        report = solver.solve(problem, own, settings);
    }
    if (const auto bytes = guard.release(); bytes > 0 && run->rank() == 0)
        fmt::print(stderr, "delassus: the solver {} wrote {} bytes to standard output; they were dropped\n", name,
                   bytes);
    if (terminal) show_line("");
    const auto processes = process_reports(problem, report.cost);
    const std::string json = to_json(report, processes);
    if (!arguments.solution.empty()) {
        if (made_to_be_shared) {
            write_partitioned_solution(*run, arguments.solution, problem.problem(), own.x, own.lambda, json);
        } else {
            const PartitionedProblem& part = problem.problem();
            const Solution whole = {whole_of(*run, own.x, part.column_start, part.column_origin),
                                    whole_of(*run, own.lambda, part.row_start, part.row_origin)};
            together(*run, [&] {
                if (run->rank() == 0) write_solution(whole, json, arguments.solution);
            });
        }
    }
    if (run->rank() == 0) {
        if (arguments.json) {
            fmt::print("{}", json);
        } else {
            print_report(report);
            print_processes(processes);
        }
    }
    return report.status == Status::Solved ? exit_solved : exit_not_converged;
}

}  // namespace delassus::command
