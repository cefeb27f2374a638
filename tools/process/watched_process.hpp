// SPDX-License-Identifier: BSD-3-Clause
// A command, or a process of a run of several, watched by a small process of its own: what plugins and libraries do to
// their process (a crash, an exit, no answer) becomes a sentence and an exit code.
#pragma once

#include <string>

namespace delassus {

/// Forks. The child returns and goes on, noting what it calls (support/process_record.hpp); it dies with its parent.
/// The parent only waits, passes SIGINT and SIGTERM on, and ends as the child ends: with its exit code, or by the
/// signal that the user sent. Any other end, and a call that is not back by its deadline, which it ends by SIGKILL,
/// gets a sentence on standard error that names whose code was running, and this exit code. `who`, "process 1 of 3"
/// say, tells processes of one launcher apart, which have exit codes only; empty where there is one. To be called while
/// there is one thread, and before MPI starts. Throws Error if the system grants no process.
void continue_in_watched_child(const std::string& who, int exit_code);

/// The last word of a watched process: it ends by itself, with this exit code. What its libraries do afterwards makes
/// no success of it any more.
/// unsaid: a sentence that standard error did not take, for whoever watches; or "".
void say_last_word(int exit_code, const char* unsaid);

}  // namespace delassus
