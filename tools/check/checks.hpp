// SPDX-License-Identifier: BSD-3-Clause
// The checks of the suite, a function for each group.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "check/subject.hpp"

namespace delassus::check {

/// One check: run returns figures for the report, or throws Failure, Warning or Skip. It is called in a process of its
/// own.
struct Check {
    std::string name;
    std::function<std::string(const Subject&)> run;
};

[[nodiscard]] std::vector<Check> identity_checks();    ///< the descriptor, the sidecar
[[nodiscard]] std::vector<Check> option_checks();      ///< the option table
[[nodiscard]] std::vector<Check> capability_checks();  ///< known answers, refusals, tolerances
[[nodiscard]] std::vector<Check> reuse_checks();       ///< warm start, new right-hand sides, values and patterns
[[nodiscard]] std::vector<Check> instance_checks();    ///< two solvers at once, determinism, leaks, the end
[[nodiscard]] std::vector<Check> progress_checks();    ///< progress, cancel, limits
[[nodiscard]] std::vector<Check> failure_checks();     ///< problems without a solution, impossible wishes

}  // namespace delassus::check
