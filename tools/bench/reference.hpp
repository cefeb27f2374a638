// SPDX-License-Identifier: BSD-3-Clause
// References: solutions for the velocity error, and ends of trajectories. Each has an error of its own and is kept in a
// cache by the hash of what it belongs to.
#pragma once

#include <filesystem>
#include <string>

#include "bench/rows.hpp"
#include "bench/suite.hpp"

namespace delassus::bench {

/// The largest natural error of a reference.
inline constexpr double reference_accuracy = 1e-9;

struct Reference {
    std::filesystem::path place;  ///< solution folder, or file of a trajectory's end; empty: there is none
    Json row;                     ///< for results.jsonl
};

/// $XDG_CACHE_HOME/delassus/references, ~/.cache/delassus/references, or the folder if there is no home.
[[nodiscard]] std::filesystem::path cache_folder(const std::filesystem::path& otherwise);

/// The most accurate solution that references.solvers reach: solved at 1e-10, then 1e-12 and 1e-14 as long as that goes
/// well. The first of references.confirm that had no part in it and solves the problem confirms it; the difference of
/// the two velocities is the reference's own error. law: the one in force.
[[nodiscard]] Reference find_reference(const WorkerSettings& worker, const SuiteReferences& references,
                                       const ProblemSource& problem, const ProblemFacts& facts, const std::string& law,
                                       const std::filesystem::path& cache);

/// The end of the scene with a small step. Its own error is its distance from the end with twice that step.
[[nodiscard]] Reference find_step_reference(const WorkerSettings& worker, const SuiteReferences& references,
                                            const SuiteScene& scene, const SceneFacts& facts, double smallest_step,
                                            const std::string& code, const std::filesystem::path& cache);

}  // namespace delassus::bench
