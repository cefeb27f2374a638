// SPDX-License-Identifier: BSD-3-Clause
// What a worker does with scenes (the requests are in bench/worker.hpp).
#pragma once

#include "bench/channel.hpp"

namespace delassus::bench {

void send_plan(const Channel& channel, const Json& request);

/// Runs a scene to its end: once to warm up, then as often as asked. Setup is making the simulation, not reading files.
void simulate(const Channel& channel, const Json& request);

}  // namespace delassus::bench
