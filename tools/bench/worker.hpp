// SPDX-License-Identifier: BSD-3-Clause
// The worker: a process of its own for each solver, so that a crash or a hang is a row in a table.
//
// A problem is the path of a folder or a file, or {"generate": kind, "parameters": {…}}.
//
// It reads one request (a JSON object) from standard input and answers with lines of JSON on standard output, each with
// an "event". What the solver itself prints is kept away from there. bench/parts_worker.hpp has the requests about
// problems in parts; the others:
//
//   {"do": "describe", "problem", "law"}
//       problem   name, law, structure, n, m, cones, hash, source
//   {"do": "measure", "problem", "law", "solver", "options", "tolerance", "max_iterations", "time_limit", "repeats",
//    "plugin_path", "solution", "reference"}
//       problem   as above
//       refused   message
//       begin     a run begins: the solver has its time limit from now
//       sample    iteration, seconds, natural: as the recorded run goes
//       recorded  the report of the run with the curve; x and λ are in the folder `solution` then
//       repeat    status, setup, solve: a run without recording
//   {"do": "plan", "scene", "settings", "end", "forced", "plugin_path"}
//       plan      systems: what the scene needs and what is left out
//   {"do": "simulate", "scene", "settings", "end", "forced", "timestepper", "step", "solver", "repeats", "plugin_path",
//    "state", "reference", "watch", "reverse", "body"}
//       scene     hash, title, step, end
//       refused   message
//       begin     a run begins
//       recorded  what the run did and how far its end is from the reference's; its end is in the file `state` then
//       repeat    seconds of a run
//   {"do": "velocity", "problem", "law", "reference", "solutions"}
//       velocity  errors: ‖x − x*‖_H / ‖x*‖_H for each solution folder, null where there is none
//
// and for all of them
//       failed    kind ("input", "memory" or "error"), message: nothing more comes
//       done      printed: bytes that the solver wrote to standard output; libraries: files mapped into the process;
//                 unoptimized: names of the plugins that it loaded and that were built without optimisation
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "bench/channel.hpp"
#include "delassus/communicator.hpp"

namespace delassus::bench {

/// Does what the request asks for, writing to the file descriptor. Returns the exit code: 0, or 2 after "failed".
int run_worker(const std::string& request, int channel);

/// The same for one of several workers too. failed: called before and after the answer of a request that fails; where
/// there are several, it waits for all (meet_in_failure). Collective.
int answer(const std::string& request, const Channel& channel, const std::shared_ptr<const Communicator>& run,
           const std::function<void(const std::string& sentence)>& failed);

}  // namespace delassus::bench
