// SPDX-License-Identifier: BSD-3-Clause
// Runs what a suite asks for and is not done yet, one after the other: measurements never run side by side.
#pragma once

#include <functional>
#include <string>

#include "bench/results_file.hpp"
#include "bench/suite.hpp"
#include "support/output_folder.hpp"

namespace delassus::bench {

struct RunPlan {
    Suite suite;
    WorkerSettings worker;           ///< its resident_limit comes from the suite
    OutputFolder* output = nullptr;  ///< kept with the first thing that is written
    std::filesystem::path cache;     ///< of references
    std::string command;             ///< that repeats it, from the folder below
    std::string folder;
};

struct RunListener {
    /// A run begins; numbers count from 1 over what is to be done. May be empty.
    std::function<void(const std::string& what, std::size_t number, std::size_t total)> on_begin;
    std::function<void(const CurveSample&)> on_sample;
};

/// Hash of the files of the library, the command and the plugins: results of other builds do not count as done.
[[nodiscard]] std::string code_hash(const Registry& registry, const std::filesystem::path& command);

struct RunCounts {
    std::size_t done = 0, skipped = 0;
    bool interrupted = false;
};

/// Reads every problem and scene once to see that it can be read (InputError, nothing has been written then). Rows go
/// to results.jsonl in plan.output as they come. Ends early when plan.worker.cancelled says so.
RunCounts run_suite(const RunPlan& plan, const Registry& registry, const RunListener& listener);

}  // namespace delassus::bench
