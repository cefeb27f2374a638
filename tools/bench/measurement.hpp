// SPDX-License-Identifier: BSD-3-Clause
// Questions to worker processes (bench/worker.hpp), one process each.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/results.hpp"
#include "delassus/solver_config.hpp"

namespace delassus::bench {

/// How worker processes are run.
struct WorkerSettings {
    std::filesystem::path command;  ///< the delassus command, absolute
    std::vector<std::filesystem::path> plugin_path;
    std::uint64_t memory_limit = 0;    ///< bytes of address space for each; 0 for none
    std::function<bool()> cancelled;   ///< true: end the one that runs with what it has reached. May be empty.
    std::uint64_t resident_limit = 0;  ///< bytes resident in each; 0 for none
};

/// Where a worker takes a problem from: a file, or a generator with its parameters (delassus/generate.hpp).
struct ProblemSource {
    std::filesystem::path path;  ///< problem folder or FCLib file; empty for a generator
    std::string generator;
    std::map<std::string, double> parameters;

    ProblemSource() = default;
    ProblemSource(std::filesystem::path file) : path(std::move(file)) {}  // NOLINT: a path is a source
    /// The path, or the command that makes the problem.
    [[nodiscard]] std::string text() const;
};

/// One solver on one problem.
struct MeasureRequest {
    ProblemSource problem;
    SolverConfig solver;  ///< name and options; the rest is in settings
    ComparisonSettings settings;
    std::filesystem::path solution;        ///< folder for x and λ, which must not exist; may be empty
    std::filesystem::path reference = {};  ///< solution folder that velocities are compared with; may be empty
};

/// Seconds beyond the time limit after which a solver that gives no sign counts as hung.
[[nodiscard]] double grace_of(double time_limit);

/// "pgs", or "pgs(omega=1.2)" with its options; the file's name for a solver given by its path.
[[nodiscard]] std::string label_of(const SolverConfig& solver);

/// Runs the solver in a process of its own; whatever it does there is a row. on_sample is called as the recorded run
/// goes; may be empty. Throws Error only if no process can be started at all.
[[nodiscard]] Measurement measure(const WorkerSettings& worker, const MeasureRequest& request,
                                  const std::function<void(const CurveSample&)>& on_sample = {});

/// Reads the problem in a process of its own. Throws InputError with its sentence if it cannot be read.
[[nodiscard]] ProblemFacts describe(const WorkerSettings& worker, const ProblemSource& problem, const std::string& law);

/// ‖x − x*‖_H / ‖x*‖_H of each solution folder against the reference; unknown where there is no such folder, or if
/// the worker fails.
[[nodiscard]] std::vector<double> velocity_errors(const WorkerSettings& worker, const ProblemSource& problem,
                                                  const std::filesystem::path& reference,
                                                  const std::vector<std::filesystem::path>& solutions);

}  // namespace delassus::bench
