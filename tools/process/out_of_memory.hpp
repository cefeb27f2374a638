// SPDX-License-Identifier: BSD-3-Clause
// The end of memory: a sentence and an exit code, whatever was being done.
#pragma once

namespace delassus {

/// Prepares this process for an allocation that fails. Some memory is kept back and freed at that moment, so that the
/// exception can travel up: destructors allocate too (those of nlohmann::json do), and one that fails there ends the
/// process by std::terminate. If that happens all the same, the process ends with say_out_of_memory() and this exit
/// code.
void prepare_for_out_of_memory(int exit_code);

/// What this process does, for the sentence: "solving", say. The text must live on.
void set_activity(const char* activity);

/// Whether an allocation has failed in this process. Streams swallow the exception, so a later error may hide this
/// cause.
[[nodiscard]] bool memory_has_ended();

/// "delassus: out of memory while solving" to standard error. Allocates nothing.
void say_out_of_memory();

}  // namespace delassus
