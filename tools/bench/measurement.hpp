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
    /// Told the name of each plugin that ran and was built without optimisation. May be empty.
    std::function<void(const std::string& plugin)> unoptimized = {};
    std::filesystem::path launcher = {};  ///< mpirun, absolute; empty where no run has several processes
};

/// Where a worker takes a problem from: a file, or a generator with its parameters (delassus/generate.hpp).
struct ProblemSource {
    std::filesystem::path path;  ///< problem folder, HDF5 file or FCLib file; empty for a generator
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
    /// 0: the problem goes to the solver as a whole. Else it is solved in parts by so many processes, started by the
    /// worker's launcher if there are several; no solution is then written and no velocities are compared.
    int processes = 0;
};

/// Seconds beyond the time limit after which a solver that gives no sign counts as hung.
[[nodiscard]] double grace_of(double time_limit);

/// "pgs", or "pgs(omega=1.2)" with its options; the file's name for a solver given by its path.
[[nodiscard]] std::string label_of(const SolverConfig& solver);

/// The method's name in reports when it runs in so many processes.
[[nodiscard]] std::string label_in_parts(const std::string& method, int processes);

/// Runs the solver in a process, or processes, of its own; whatever it does there is a row. on_sample is called as the
/// recorded run goes; may be empty. Throws Error only if no process can be started at all.
[[nodiscard]] Measurement measure(const WorkerSettings& worker, const MeasureRequest& request,
                                  const std::function<void(const CurveSample&)>& on_sample = {});

/// Reads the problem in a process of its own. Throws InputError with its sentence if it cannot be read. processes: 0,
/// or the number of processes that it is going to be shared among at most: one that is made for that, a generated pile
/// or an HDF5 file, is then not brought into one process.
[[nodiscard]] ProblemFacts describe(const WorkerSettings& worker, const ProblemSource& problem, const std::string& law,
                                    int processes = 0);

/// The program mpirun, after it has started so many workers that ended well. Throws InputError with one sentence if
/// there is none, or it did not, or this build cannot use MPI.
[[nodiscard]] std::filesystem::path find_launcher(const WorkerSettings& worker, int processes);

/// ‖x − x*‖_H / ‖x*‖_H of each solution folder against the reference; unknown where there is no such folder, or if
/// the worker fails.
[[nodiscard]] std::vector<double> velocity_errors(const WorkerSettings& worker, const ProblemSource& problem,
                                                  const std::filesystem::path& reference,
                                                  const std::vector<std::filesystem::path>& solutions);

}  // namespace delassus::bench
