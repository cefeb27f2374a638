// SPDX-License-Identifier: BSD-3-Clause
// What a report says of a set of results as a whole (docs/benchmarks.md).
#pragma once

#include "bench/results_file.hpp"

namespace delassus::bench {

/// Shift of the geometric means of times, s.
inline constexpr double mean_shift = 1e-3;
/// Times below this count as this in performance profiles, s.
inline constexpr double least_time = 1e-5;

/// Setup and solve together of a row with seconds, s; NaN where one is missing.
[[nodiscard]] double total_seconds(const Json& solve);

/// {"classes": [{"name", "problems", "tolerances": [{"tolerance", "problems", "solved_by_any", "solvers": [{"solver",
/// "ratios", "mean", "solved", "supported", "false_claims", "memory"}]}], "sizes": [{"from", "problems",
/// "tolerances"}]}], "scaling": […], "orders": […], "failures": [{"solver", "cause", "count"}], "recording": {"ratio",
/// "runs"}}
/// `sizes` has the same for the problems of each decade [from, 10 from) of sizes, and is empty where there is but one.
[[nodiscard]] Json analyse(const ResultSet& results);

/// The part "processes" of it: {"strong": [{"problem", "size", "law", "solver", "tolerance", "points"}], "weak":
/// [{"family", "load", …, "points"}], "traffic": [{"family", "processes", …, "points": [[size, bytes]], "fit"}],
/// "beyond_cores"}. A point: {"problem", "size", "processes", "seconds", "efficiency", "iterations",
/// "efficiency_of_an_iteration", "bytes_an_iteration", "peak_memory", "ghosts", "imbalance", "phases"}.
[[nodiscard]] Json analyse_processes(const ResultSet& results);

}  // namespace delassus::bench
