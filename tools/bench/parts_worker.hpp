// SPDX-License-Identifier: BSD-3-Clause
// The worker (bench/worker.hpp) for problems in parts: one process, or several that a launcher has started.
//
//   {"do": "measure", "parts": true, …}   as in bench/worker.hpp, but without "solution" and "reference"
//       processes   the figures of each process, after "recorded" and after each "repeat"
//   {"do": "describe", "parts": true, …}  facts of a problem that is made to be shared
//   {"do": "ping"}                        "done" after all processes have met
#pragma once

#include <memory>

#include "bench/channel.hpp"
#include "bench/json_text.hpp"
#include "delassus/communicator.hpp"

namespace delassus::bench {

/// Collective. The channel is silent on all processes but the first.
void measure_in_parts(const Channel& channel, const Json& request, const std::shared_ptr<const Communicator>& run);
/// Collective.
void describe_in_parts(const Channel& channel, const Json& request, const std::shared_ptr<const Communicator>& run);

/// One of several workers, from its start: takes a core of its own if there are enough, reads the request (process 0,
/// from standard input), and does what run_worker() does. Returns the exit code.
int run_worker_together(int channel);

}  // namespace delassus::bench
