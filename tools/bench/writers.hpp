// SPDX-License-Identifier: BSD-3-Clause
// A comparison as people and programs read it.
#pragma once

#include <string>

#include "bench/results.hpp"

namespace delassus::bench {

/// The table of one problem for a terminal, refusals and other remarks below it.
[[nodiscard]] std::string table_text(const ProblemResults& problem);

/// One line for each problem and solver, RFC 4180; what is not known is empty.
[[nodiscard]] std::string csv_text(const Comparison& comparison);

/// Everything, curves included; format "delassus-comparison", version 1 (docs/comparison.md).
[[nodiscard]] std::string json_text(const Comparison& comparison);

/// One HTML file that needs nothing else: charts of error against time, and the tables. Throws InputError if a part of
/// the page is missing (support/html_page.hpp).
[[nodiscard]] std::string html_text(const Comparison& comparison);

}  // namespace delassus::bench
