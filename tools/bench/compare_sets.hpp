// SPDX-License-Identifier: BSD-3-Clause
// Two sets of results side by side: before and after a change.
#pragma once

#include <string>

#include "bench/results_file.hpp"

namespace delassus::bench {

/// Runs of the same content in both, as ratios B / A of setup and solve together, with what the repeats allow:
/// {"solvers": [{"solver", "runs", "ratio", "low", "high", "faster", "slower"}], "runs": [{"problem", "law", "solver",
/// "tolerance", "a", "b", "ratio", "low", "high", "certain"}], "changed": [{…, "a": cause, "b": cause}],
/// "simulations": [{"scene", "timestepper", "step", "solver", "a", "b", "ratio", "low", "high", "certain"}]}.
/// Ratios of a solver are geometric means. Throws InputError, saying why, for sets of different machines (unless
/// any_machine) or limits, or with no run in common.
[[nodiscard]] Json compare_sets(const ResultSet& before, const ResultSet& after, bool any_machine);

/// As tables for a terminal.
[[nodiscard]] std::string compare_text(const Json& comparison);

}  // namespace delassus::bench
