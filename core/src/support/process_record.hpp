// SPDX-License-Identifier: BSD-3-Clause
// What a process notes for the one that watches it: whose code it is calling, until when that must return, and its last
// word. So the end of a process, however it came about, is told with its cause (tools/process/watched_process.hpp).
#pragma once

#include <array>
#include <atomic>
#include <cfenv>
#include <cstdint>
#include <limits>
#include <string_view>

#include "delassus/export.hpp"

namespace delassus {

/// Seconds on the clock of deadlines, which all processes share.
DELASSUS_API double watch_seconds();

/// How often this process is the child of a fork since this was first asked.
unsigned count_of_forks();

/// Plain memory that two processes can share.
struct ProcessRecord {
    struct Call {
        std::atomic<std::uint64_t> number{0};  ///< calls are numbered as they begin; 0: this place is free
        std::atomic<double> deadline{std::numeric_limits<double>::infinity()};  ///< of watch_seconds()
        std::atomic<double> limit{std::numeric_limits<double>::infinity()};     ///< the seconds behind it
        std::array<char, 160> who{};                                            ///< "the solver pgs"
        std::array<char, 48> what{};                                            ///< "in solve"; may be empty
    };
    std::atomic<std::uint64_t> begun{0};
    std::atomic<int> last_word{-1};  ///< the exit code with which the process is about to end by itself
    std::array<char, 512> unsaid{};  ///< the sentence that goes with it, where standard error did not take it
    std::array<Call, 64> calls;
};

/// That of this process.
DELASSUS_API ProcessRecord& process_record();

/// From now on this process notes in `shared`, which stays; its children by fork do not. To be called while it has one
/// thread.
DELASSUS_API void share_process_record(ProcessRecord* shared);

/// Code of others runs while it lives: of a plugin, of a library. If that code forks and comes back twice, the copy of
/// this process ends here without a word. Rounding, traps and flushing of tiny numbers are then as they were before.
class ForeignCall {
public:
    /// limit: seconds after which whoever watches this process ends it; infinity for never.
    DELASSUS_API ForeignCall(std::string_view who, std::string_view what,
                             double limit = std::numeric_limits<double>::infinity());
    DELASSUS_API ~ForeignCall();
    ForeignCall(const ForeignCall&) = delete;
    ForeignCall& operator=(const ForeignCall&) = delete;

    /// The code has shown that it is alive: it has its time once more.
    void renew() {
        if (call_ && limit_ < std::numeric_limits<double>::infinity())
            call_->deadline.store(watch_seconds() + limit_, std::memory_order_relaxed);
    }

    /// Seconds in which what has no time limit of its own (loading, making, destroying) must be done.
    static constexpr double patience = 600.0;

private:
    ProcessRecord::Call* call_ = nullptr;  // null: no place was free
    double limit_;
    unsigned forks_;
    std::fenv_t arithmetic_;
};

}  // namespace delassus
