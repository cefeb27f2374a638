// SPDX-License-Identifier: BSD-3-Clause
// What a comparison finds out, as plain data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "delassus/errors.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"

namespace delassus::bench {

inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// What the table's head says of a problem.
struct ProblemFacts {
    std::string name, law, structure;
    std::int64_t n = 0, m = 0;
    std::vector<std::pair<std::string, std::int64_t>> cones;  ///< blocks of each kind that occurs
    std::string hash = {};                                    ///< of everything but names and law, 16 digits
    std::string source = {};                                  ///< where it came from, as the problem says
};

/// The solver's own seconds in one run that recorded no curve.
struct Repeat {
    double setup = 0.0, solve = 0.0;
};

/// What one of several processes had of a problem in parts, and what the fastest run cost it.
struct ProcessFigures {
    std::int64_t n = 0, m = 0, ghosts = 0;
    std::int64_t peak_memory = 0;                        ///< bytes
    std::optional<std::int64_t> bytes_sent;              ///< by the solver; empty if it does not tell
    std::vector<std::pair<std::string, double>> phases;  ///< s, of setup, solve and the phases of the solve
};

/// One solver on one problem.
struct Measurement {
    std::string label;   ///< "pgs", "pgs(omega=1.2)" or "apgd_petsc, 2 processes"
    std::string method;  ///< the label without the processes
    int processes = 1;
    std::vector<ProcessFigures> by_process;  ///< by rank; empty where the problem was not in parts
    std::string solver, version;
    OptionTexts options;  ///< those that were chosen
    /// The name of a Status, or unsupported (message: the refusal), crashed, hung (killed), input (refused as bad
    /// input), memory (killed at its limit, or out of memory).
    std::string status;
    std::string message;  ///< what a person should know; may be empty

    std::optional<std::int64_t> iterations;
    double setup = unknown, solve = unknown;  ///< seconds, the least of the repeats
    std::vector<Repeat> repeats;              ///< empty where the recorded run stands for itself
    Repeat recorded{unknown, unknown};        ///< of the run with the curve, which is the warm-up
    std::vector<std::string> stages;          ///< solvers that worked one after another; empty if one did it all
    std::vector<std::string> libraries;       ///< files of shared libraries in its process, versions in their names
    std::optional<Errors> error;              ///< of the recorded run's result; empty if it gave none
    double velocity = unknown;                ///< ‖x − x*‖_H / ‖x*‖_H; unknown without a reference
    double speed = unknown;                   ///< largest entry of |x| of the recorded run's result, m/s or rad/s
    std::int64_t peak_memory = 0;             ///< bytes resident in its process, the problem included
    std::int64_t analyses = 0, factorizations = 0;
    std::vector<CurveSample> curve;  ///< also of a run that did not end
};

struct ProblemResults {
    std::filesystem::path path;  ///< as the user gave it
    ProblemFacts facts;
    std::string velocity_reference;  ///< label of the result that velocities are compared with; may be empty
    std::vector<Measurement> results;
};

struct Machine {
    std::string processor, system;
    int cores = 0;
    std::int64_t memory = 0;  ///< bytes
    double load = unknown;    ///< runnable processes, mean of the last minute: what measurements have to share
};

struct Build {
    std::string version, compiler, type, flags;
};

/// The machine and the build that this process runs on and is.
[[nodiscard]] Machine this_machine();
[[nodiscard]] Build this_build();

/// ISO 8601, UTC.
[[nodiscard]] std::string now();

/// What all solvers were given.
struct ComparisonSettings {
    double tolerance = 1e-6;
    double time_limit = 30.0;  ///< seconds of the solver's own time, for each run
    std::int64_t max_iterations = 100000000;
    int repeats = 3;
    std::string law;  ///< empty: each problem's own
};

struct Comparison {
    std::string created;  ///< ISO 8601, UTC
    std::string command;  ///< that repeats it, from `folder`
    std::string folder;
    Machine machine;
    Build build;
    ComparisonSettings settings;
    bool interrupted = false;
    std::vector<ProblemResults> problems;

    /// Whether each problem was solved by at least one solver.
    [[nodiscard]] bool all_solved() const;
};

}  // namespace delassus::bench
