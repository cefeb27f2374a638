// SPDX-License-Identifier: BSD-3-Clause
// The lines of results.jsonl (docs/benchmarks.md describes them).
#pragma once

#include <string>

#include "bench/json_text.hpp"
#include "bench/results.hpp"
#include "bench/results_file.hpp"
#include "bench/scene_measurement.hpp"
#include "bench/suite.hpp"

namespace delassus::bench {

inline constexpr const char* rows_format = "delassus-bench";
inline constexpr int rows_version = 1;

/// The part of a row that compare's results.json has as well.
[[nodiscard]] Json json_of(const Measurement& row);
[[nodiscard]] Json json_of(const Machine& machine);
[[nodiscard]] Json json_of(const Build& build);

/// Why a run counts as failed: unsupported, iteration_limit, time_limit, memory, diverged, stalled, infeasible,
/// numerical_failure, crashed, false_claim, error. Empty for one that was solved.
[[nodiscard]] std::string cause_of(const Measurement& row);
/// unsupported, unsolved, step_failure, diverged, time_limit, memory, crashed, error; empty for one that finished.
[[nodiscard]] std::string cause_of(const SimulationMeasurement& row);

[[nodiscard]] Json problem_row(const ProblemFacts& facts, const SuiteProblem& problem);
/// tolerance: what was asked for. problem: its hash.
[[nodiscard]] Json solve_row(const std::string& key, const std::string& problem, const std::string& law,
                             double tolerance, const Measurement& row);
/// The row of a run that was left out, as the same solver with the same options ended that way at a looser tolerance.
[[nodiscard]] Json skipped_row(const std::string& key, const std::string& problem, const std::string& law,
                               double tolerance, const SolverConfig& solver, int processes, const RunEnd& end,
                               double looser);
/// as_is, forced: of the scene as it is, and of the same with nothing left out, whose end is compared with the
/// former's.
[[nodiscard]] Json leaving_out_row(const std::string& key, const SuiteScene& scene, const SceneFacts& facts,
                                   const SimulationMeasurement& as_is, const SimulationMeasurement& forced);
[[nodiscard]] Json simulation_row(const std::string& key, const std::string& scene, const SimulateRequest& request,
                                  const SimulationMeasurement& row);

}  // namespace delassus::bench
