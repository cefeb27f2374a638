// SPDX-License-Identifier: BSD-3-Clause
// Results of a benchmark as people and other programs read them.
#pragma once

#include <string>

#include "bench/results_file.hpp"

namespace delassus::bench {

/// summary.md: GitHub's tables, also readable on a terminal. analysis: of the same results.
[[nodiscard]] std::string summary_markdown(const ResultSet& results, const Json& analysis);

/// results.csv: one line for each run of a solver, RFC 4180; what is not known is empty.
[[nodiscard]] std::string solves_csv(const ResultSet& results);
/// simulations.csv: likewise for each run of a scene.
[[nodiscard]] std::string simulations_csv(const ResultSet& results);

/// cells.csv: likewise for each cell of an axis.
[[nodiscard]] std::string cells_csv(const ResultSet& results);
/// The part of summary.md on axes: where each method breaks along each. Empty without cells.
[[nodiscard]] std::string axes_markdown(const ResultSet& results);

/// The part of summary.md on runs in parts: strong and weak scaling, what is sent, what the time goes to. Empty without
/// such runs.
[[nodiscard]] std::string processes_markdown(const ResultSet& results, const Json& analysis);

/// report.html, whole in one file. Throws InputError if a part of the page is missing (support/html_page.hpp).
[[nodiscard]] std::string bench_page(const ResultSet& results, const Json& analysis);

}  // namespace delassus::bench
