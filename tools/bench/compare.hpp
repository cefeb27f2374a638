// SPDX-License-Identifier: BSD-3-Clause
// Several solvers on several problems, one after the other: measurements never run side by side.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/measurement.hpp"
#include "bench/results.hpp"
#include "delassus/registry.hpp"

namespace delassus::bench {

struct ComparePlan {
    std::vector<std::filesystem::path> problems;
    std::vector<SolverConfig> solvers;
    ComparisonSettings settings;
    WorkerSettings worker;
};

struct CompareListener {
    /// A solver begins; numbers count from 1 over the whole comparison.
    std::function<void(const ProblemFacts&, const std::string& label, std::size_t number, std::size_t total)> on_begin;
    std::function<void(const CurveSample&)> on_sample;
    /// A problem is through, or as far as it got; the comparison so far.
    std::function<void(const Comparison&)> on_problem;
};

/// Parses the arguments of --solvers: "a,b(key=value,key=value)". An empty list means all plugins of the registry, by
/// name. Throws InputError on a name or an option that does not exist, a solver that is listed twice, or if there is
/// none at all. Loads nothing.
[[nodiscard]] std::vector<SolverConfig> solvers_of(const std::vector<std::string>& texts, const Registry& registry);

/// Reads every problem once to see that it can be read (InputError), then measures. Ends early, with what it has,
/// when plan.worker.cancelled says so. The members of the listener may be empty.
[[nodiscard]] Comparison compare(const ComparePlan& plan, const CompareListener& listener);

/// The command line quoted for a shell.
[[nodiscard]] std::string shell_line(const std::vector<std::string>& arguments);

}  // namespace delassus::bench
