// SPDX-License-Identifier: BSD-3-Clause
// The threads that solvers, collision and assembly share their work among.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "delassus/export.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus {

/// Processors that this thread may use, by its affinity; at least 1.
[[nodiscard]] DELASSUS_API int usable_processors();

/// A few threads for tasks that one caller at a time runs, with barriers of less than a microsecond. They are started
/// by the first task and stay until the object ends. A member that waits looks for the next task for a few microseconds
/// and then sleeps. It sleeps at once where the team is larger than the number of processors that the process may use.
///
/// Where other programs keep the members from running, so that most of the time goes by waiting for them, tasks are
/// left to the calling thread for a while, from a tenth of a second to some seconds: results do not depend on it.
///
/// In the child of a fork the threads are missing; the first task there starts others. Signals are left to the threads
/// of the program.
class ThreadTeam {
public:
    /// size: members, the calling thread among them; ≥ 1. Starts nothing yet.
    DELASSUS_API explicit ThreadTeam(int size);
    DELASSUS_API ~ThreadTeam();
    ThreadTeam(const ThreadTeam&) = delete;
    ThreadTeam& operator=(const ThreadTeam&) = delete;

    /// As many members as were asked for and no more than there are processors, since more would wait for one another;
    /// without a number as many as there are processors.
    [[nodiscard]] DELASSUS_API static std::shared_ptr<ThreadTeam> for_threads(std::optional<std::int64_t> asked);

    /// For the work at hand; valid as long as this object. A task throws std::system_error if a thread cannot be
    /// started.
    [[nodiscard]] DELASSUS_API sdk::Team team() const;

private:
    struct Threads;
    static void run(void* context, void (*task)(void* data, std::int32_t member), void* data);
    static void wait(void* context);

    std::unique_ptr<Threads> threads_;
    delassus_team raw_{};
};

}  // namespace delassus
