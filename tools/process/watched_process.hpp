// SPDX-License-Identifier: BSD-3-Clause
// A process of a run of several, watched by a small one of its own: launchers report a killed process in words and exit
// codes of their own.
#pragma once

#include <string>

namespace delassus {

/// Forks. The child returns and goes on; it dies with its parent. The parent only waits, passes SIGINT and SIGTERM on,
/// and ends as the child ends; if a signal ended it (out of memory on its node, say), with a sentence on standard error
/// that begins with `who`, and this exit code. To be called while there is one thread, and before MPI starts. Throws
/// Error if the system grants no process.
void continue_in_watched_child(const std::string& who, int exit_code);

}  // namespace delassus
