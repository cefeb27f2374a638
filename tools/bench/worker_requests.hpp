// SPDX-License-Identifier: BSD-3-Clause
// What the requests of a worker (bench/worker.hpp) say, and its answers, whole problems and parts alike.
#pragma once

#include <filesystem>
#include <vector>

#include "bench/json_text.hpp"
#include "delassus/problem.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"

namespace delassus::bench {

/// The problem of "problem": a path, or a generator with its parameters.
[[nodiscard]] Problem read_source(const Json& source);
[[nodiscard]] SolverConfig solver_of(const Json& request);
[[nodiscard]] SolveSettings settings_of(const Json& request);
[[nodiscard]] std::vector<std::filesystem::path> plugin_path_of(const Json& request);
/// How often a run that ended so is to be made again.
[[nodiscard]] int repeats_of(const Json& request, const SolveReport& report);

[[nodiscard]] Json sample_json(const CurveSample& sample);
[[nodiscard]] Json recorded_json(const SolveReport& report, double velocity, double speed);
[[nodiscard]] Json repeat_json(const SolveReport& report);

}  // namespace delassus::bench
