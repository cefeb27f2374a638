// SPDX-License-Identifier: BSD-3-Clause
// What the processes of one run tell each other. The library links no MPI: a module does, and is loaded where a
// launcher has started several processes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "delassus/export.hpp"

namespace delassus {

/// All operations are collective: every process calls the same ones in the same order. A process that throws alone
/// leaves the others waiting: see together().
class DELASSUS_API Communicator {
public:
    virtual ~Communicator();

    [[nodiscard]] virtual int rank() const = 0;  ///< of this process, from 0
    [[nodiscard]] virtual int size() const = 0;  ///< number of processes, ≥ 1
    /// What delassus_local_problem::communicator holds: MPI_Comm_c2f of a communicator of these processes; 0 where
    /// there is one process.
    [[nodiscard]] virtual std::int32_t handle() const = 0;

    /// Each entry ← the sum, or the largest, of that entry on all processes: the same bits on all.
    virtual void sum(std::span<double> values) const = 0;
    virtual void sum(std::span<std::int64_t> values) const = 0;
    virtual void max(std::span<double> values) const = 0;
    virtual void max(std::span<std::int64_t> values) const = 0;

    /// The value of every process, by rank.
    [[nodiscard]] virtual std::vector<std::int64_t> all(std::int64_t value) const = 0;
    /// Entry p of `to` goes to process p; entry p of the result came from it. Any sizes, beyond 2³¹ bytes too.
    [[nodiscard]] virtual std::vector<std::vector<std::byte>> exchange(
        const std::vector<std::vector<std::byte>>& to) const = 0;
    /// The text of process `from`, on all.
    [[nodiscard]] virtual std::string broadcast(const std::string& text, int from = 0) const = 0;

    /// Bytes that this process has sent to others since the start.
    [[nodiscard]] virtual std::int64_t bytes_sent() const = 0;
    /// Ends the run of all processes at once with this exit code, whatever they are doing.
    [[noreturn]] virtual void abort(int exit_code) const = 0;
};

/// The run that no launcher started: one process.
[[nodiscard]] DELASSUS_API std::shared_ptr<const Communicator> single_process();

/// That of this run: single_process() unless process_count() > 1. Throws InputError if this build cannot use MPI.
[[nodiscard]] DELASSUS_API std::shared_ptr<const Communicator> communicator_of_run();

/// Runs body, which must not be collective itself, on every process; if it throws on any of several, all throw:
/// InputError with the sentence of the first process, in the order of ranks, on which it did. Where there is one
/// process, what it throws passes. Collective.
DELASSUS_API void together(const Communicator& communicator, const std::function<void()>& body);

/// For a process that has failed and cannot tell whether the others have too: waits for all of them to call this. Those
/// that do not come within two seconds wait for this one somewhere else: the run of all then ends with this sentence
/// and exit code 3. Nothing else may be called on this communicator.
DELASSUS_API void meet_in_failure(const Communicator& last_words, const std::string& sentence);

}  // namespace delassus
