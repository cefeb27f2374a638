// SPDX-License-Identifier: BSD-3-Clause
// A question to a worker process (bench/worker.hpp), and what to make of the way in which it ended.
#pragma once

#include <functional>
#include <string>

#include "bench/json_text.hpp"
#include "bench/measurement.hpp"
#include "process/child_process.hpp"

namespace delassus::bench {

/// Seconds for reading a problem, and for everything else that is not a solver's run.
inline constexpr double loading_limit = 600.0;
/// Seconds for a launcher to start processes that do nothing.
inline constexpr double start_limit = 60.0;
/// Seconds for the process to end after its last word.
inline constexpr double exit_limit = 10.0;

/// Starts a worker with the request, or several by the launcher, of which the first answers. hear: takes a line of its
/// answer, and returns the seconds until the next one must have come. Throws Error if no process can be started.
ChildResult ask(const WorkerSettings& worker, const Json& request, const std::function<double(const Json&)>& hear,
                int processes = 1);

/// For a request that is answered by facts, without runs. what: their subject, for messages. Throws InputError with the
/// worker's sentence, or that the process ended; Error if it was interrupted.
void ask_for_facts(const WorkerSettings& worker, const Json& request, const std::string& what,
                   const std::function<void(const std::string& event, const Json& line)>& hear, int processes = 1);

/// Sets the status by how the process of a run ended, if that tells more than its output did, and appends a sentence to
/// the message. status: of its result, empty if it gave none. done: it said that it had finished. reached: how far it
/// had come, "after iteration 3", or empty. A complete result keeps its status.
void judge_end(std::string& status, std::string& message, const ChildResult& child, const WorkerSettings& worker,
               double time_limit, bool done, const std::string& reached);

/// The status of a run whose worker said that it failed: memory, input (bad input, refused with a sentence) or error.
[[nodiscard]] std::string status_of_failure(const std::string& kind);

/// Of what was written to standard error the last line of Delassus' own, or else the last line: often the cause.
[[nodiscard]] std::string last_line(std::string text);

/// Adds to the message which plugins a worker loaded that were built without optimisation, and tells the worker's
/// settings. line: its last one.
void hear_builds(const Json& line, const WorkerSettings& worker, std::string& message);

/// Adds the sentence to the message, after a semicolon.
void append(std::string& message, const std::string& sentence);

}  // namespace delassus::bench
