// SPDX-License-Identifier: BSD-3-Clause
// One scene run by one timestepper with one step, in a process of its own.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/json_text.hpp"
#include "bench/measurement.hpp"

namespace delassus::bench {

/// A scene with what is changed in it.
struct SceneSource {
    std::filesystem::path file;
    std::map<std::string, std::string> settings;  ///< paths of keys to values in YAML, as `delassus run --set`
    double end = -1.0;                            ///< s; negative: the file's
    bool forced = false;                          ///< solved as if the scene needed everything: `leave_out: false`
};

/// What a scene is before it runs.
struct SceneFacts {
    std::string hash;  ///< of all but `end`, 16 digits
    std::string title;
    double step = 0.0, end = 0.0;  ///< s, as the file has them with the settings in place
    std::string integrator;        ///< of the first system
    Json plan;                     ///< as `delassus plan --json` gives it
};

struct SimulateRequest {
    SceneSource scene;
    std::string timestepper;  ///< "name" or "name(key=value,…)"; empty: the scene's own
    double step = 0.0;        ///< s; 0: the scene's own
    std::string solver;       ///< "name" or "name(key=value,…)"; empty: the scene's own, or by need
    double time_limit = 0.0;  ///< s of stepping
    int repeats = 1;
    bool watch = false;               ///< look at every step of the first run, for `watched`
    bool reverse = false;             ///< go back with turned velocities after it, for `watched` too
    std::string body;                 ///< whose place at the end is wanted; empty: none
    std::filesystem::path state;      ///< file for the end's state, to be a reference; may be empty
    std::filesystem::path reference;  ///< such a file, to measure the end against; may be empty
};

struct SimulationMeasurement {
    /// finished, unsolved (steps missed the solver's tolerance), failed (a step could not be taken), diverged,
    /// time_limit, unsupported, crashed, hung, memory, input (refused as bad input), cancelled, error.
    std::string status;
    std::string message;
    double setup = unknown, seconds = unknown;      ///< s, the least of the repeats
    std::vector<double> repeats;                    ///< s of stepping of each
    double position = unknown, velocity = unknown;  ///< distance of the end from the reference's, relative (docs)
    Json totals = Json::object();   ///< steps, most rows of a problem, iterations, energy, drift, penetration, …
    Json watched = Json::object();  ///< measures of scenes (suite_axis.hpp), and "place" of the body
    std::int64_t peak_memory = 0;   ///< bytes resident
    std::vector<std::string> libraries;
};

/// Reads the scene and plans it in a process of its own. Throws InputError with its sentence.
[[nodiscard]] SceneFacts describe_scene(const WorkerSettings& worker, const SceneSource& scene);

/// Whatever happens there is a row. Throws Error only if no process can be started at all.
[[nodiscard]] SimulationMeasurement simulate(const WorkerSettings& worker, const SimulateRequest& request);

}  // namespace delassus::bench
