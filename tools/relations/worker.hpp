// SPDX-License-Identifier: BSD-3-Clause
// The process in which scenes run: what they do to it is a result.
//
// Request, one object of JSON on standard input:
//   {"plugin_path": […], "run_limit": s, "scratch": folder, "only": [relation, …],
//    "seed": S, "numbers": [counter, …]}   or, in place of the last line, "scenes": [document, …]
// Answer, lines of JSON: for each scene, in this order, {"event": "begin", "number": k}, any number of
// {"event": "alive"}, and {"event": "judged", "number": k, "seconds": s, "outcomes": [{relation, verdict, detail}, …]};
// number is the counter, or the place in "scenes". At the end {"event": "done"}, or {"event": "failed", "message": …}.
#pragma once

#include <string>

namespace delassus::relations {

/// Answers the request on this descriptor. Returns the exit code.
int run_worker(const std::string& request, int channel);

}  // namespace delassus::relations
