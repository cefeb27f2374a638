// SPDX-License-Identifier: BSD-3-Clause
// A benchmark suite: what is to be run with what (docs/benchmarks.md lists the keys of its file).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/measurement.hpp"
#include "bench/scene_measurement.hpp"
#include "bench/suite_axis.hpp"
#include "delassus/registry.hpp"

namespace delassus::bench {

struct SuiteProblem {
    ProblemSource source;
    std::string name;    ///< empty: the problem's own
    std::string family;  ///< problems that differ in size only share it; empty: none
};

/// A scene, the problems of whose steps become problems of the suite.
struct SuiteDump {
    SceneSource scene;
    std::int64_t every = 1;  ///< steps
    std::string place;       ///< in the suite's file, for messages
};

struct SuiteTimestepper {
    std::string text;           ///< "name" or "name(key=value,…)"
    std::vector<double> steps;  ///< s; empty: the suite's
};

struct SuiteScene {
    SceneSource source;
    std::string name;                            ///< the file's, without its ending, if none is given
    std::vector<double> steps;                   ///< s, in place of the timesteppers' and the suite's; may be empty
    std::vector<SuiteTimestepper> timesteppers;  ///< in place of the suite's; may be empty
    // What the end is measured against.
    std::string reference_timestepper;  ///< empty: the suite's
    double reference_step = 0.0;        ///< s; 0: the suite's fraction of the smallest step
};

struct SuiteReferences {
    std::vector<std::string> solvers;  ///< tried in order, the first that solves the problem counts
    std::vector<std::string> confirm;  ///< likewise; one that had no part in the first
    std::string timestepper;           ///< empty: the scene's own
    double step_fraction = 0.1;        ///< of the smallest step of a scene
    double time_limit = 30.0;          ///< s
};

struct Suite {
    std::filesystem::path file;
    std::string text;  ///< of the file
    std::string title, description;
    std::vector<SuiteProblem> problems;
    std::vector<SuiteDump> dumps;
    std::vector<SolverConfig> solvers;
    std::vector<std::string> laws = {""};                 ///< "" is each problem's own
    std::vector<double> tolerances = {1e-3, 1e-6, 1e-9};  ///< the loosest first
    std::vector<int> processes = {1};  ///< of each run of a solver, ascending; {1}: no problem is in parts
    [[nodiscard]] bool in_parts() const { return processes != std::vector<int>{1}; }
    bool skip_after_failure = true;  ///< a solver that failed on a problem is not run on it to a tighter tolerance
    std::vector<SuiteScene> scenes;
    std::vector<SuiteScene> leaving_out;           ///< run as they are, and with nothing left out
    std::vector<SuiteTimestepper> timesteppers;    ///< empty: the scene's own
    std::vector<double> steps;                     ///< s; empty: the scene's own
    std::vector<std::string> step_solvers = {""};  ///< of scenes; "" is the scene's own, or by need
    std::vector<SuiteAxis> axes;
    SuiteReferences references;
    int repeats = 3;
    double time_limit = 10.0;   ///< s of the solver's own time, or of stepping, for each run
    double memory_limit = 0.0;  ///< MiB resident; 0: none
    std::int64_t max_iterations = 100000000;
    std::vector<std::string> left_out;  ///< sentences: optional files that are not there, solvers that were not built
};

/// Reads the suite; folders are listed and sweeps expanded, nothing is loaded or run. Throws InputError with file,
/// line, key and the nearest valid key.
[[nodiscard]] Suite read_suite(const std::filesystem::path& file, const Registry& registry);

/// Keeps only the named axes. Throws InputError for a name that none has.
void keep_axes(Suite& suite, const std::vector<std::string>& names);

struct ShippedSuite {
    std::string name, title, description;
    std::filesystem::path file;
};

/// The folder of the suites that come with the library.
[[nodiscard]] std::filesystem::path suite_folder();
/// By name. A suite that cannot be read has its complaint as description.
[[nodiscard]] std::vector<ShippedSuite> shipped_suites(const Registry& registry);
/// The file of that path, or of the shipped suite of that name. Throws InputError naming the suites.
[[nodiscard]] std::filesystem::path find_suite(const std::string& name_or_path);

}  // namespace delassus::bench
