// SPDX-License-Identifier: BSD-3-Clause
// A few threads that work together within one solve, with barriers of less than a microsecond.
//
// A team lives for one call of solve(): between calls there is no thread that could burn time, keep a process from
// ending, or be missing in the child of a fork. A member that waits first watches a counter for about as long as a
// sweep takes, and then sleeps. It sleeps at once if the team is larger than the number of processors that the process
// may use (a benchmark pins its runs to one).
#pragma once

#include <pthread.h>
#include <sched.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

namespace delassus::sdk {

/// Processors that this thread may use, by its affinity.
inline int usable_processors() {
    cpu_set_t set;
    CPU_ZERO(&set);
    if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// As many threads as were asked for, and no more than there are processors: more would only wait for one another.
inline int useful_threads(std::int64_t asked) {
    return static_cast<int>(std::clamp<std::int64_t>(asked, 1, usable_processors()));
}

/// Threads that run one task together; the calling thread is a member.
class Team {
public:
    /// size: members, the calling thread among them; ≥ 1. Throws std::system_error if a thread cannot be started.
    explicit Team(int size) : size_(size) {
        if (size == 1) return;
        if (size <= usable_processors()) patience_ = 4000;
        // Signals belong to the host's threads.
        sigset_t all, before;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before);
        try {
            for (int index = 1; index < size; ++index) workers_.emplace_back([this, index] { work(index); });
        } catch (...) {
            pthread_sigmask(SIG_SETMASK, &before, nullptr);
            size_ = static_cast<int>(workers_.size()) + 1;
            dismiss();
            throw;
        }
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
    }
    ~Team() { dismiss(); }
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;

    [[nodiscard]] int size() const { return size_.load(std::memory_order_relaxed); }

    /// body(index) by every member at once, index 0 by the caller; returns when all are done. body must not throw.
    template <class Body>
    void run(const Body& body) {
        if (size() == 1) return body(0);
        task_ = std::cref(body);
        barrier();
        body(0);
        barrier();
    }

    /// Called by every member inside run(): no member goes on before all have come.
    void barrier() {
        if (size() == 1) return;
        const std::uint32_t turn = turn_.load(std::memory_order_relaxed);
        const int arrived = arrived_.fetch_add(1, std::memory_order_acq_rel) + 1;
        if (arrived == size_.load(std::memory_order_relaxed)) {
            arrived_.store(0, std::memory_order_relaxed);
            turn_.store(turn + 1, std::memory_order_release);
            turn_.notify_all();
            return;
        }
        for (int k = 0; k < patience_; ++k) {
            if (turn_.load(std::memory_order_acquire) != turn) return;
            if (k % looks_between_yields == looks_between_yields - 1) {
                std::this_thread::yield();  // the one that is waited for may need this very processor
            } else {
                pause();
            }
        }
        while (turn_.load(std::memory_order_acquire) == turn) turn_.wait(turn, std::memory_order_acquire);
    }

    /// The part of 0 … count − 1 that falls to a member: [first, second).
    [[nodiscard]] std::pair<std::size_t, std::size_t> share(std::size_t count, int index) const {
        const auto members = static_cast<std::size_t>(size()), member = static_cast<std::size_t>(index);
        return {count * member / members, count * (member + 1) / members};
    }

private:
    static void pause() {
#if defined(__x86_64__)
        __builtin_ia32_pause();
#endif
    }

    void work(int index) {
        while (true) {
            barrier();
            if (!task_) return;
            task_(index);
            barrier();
        }
    }

    void dismiss() {
        if (workers_.empty()) return;
        task_ = nullptr;
        barrier();
        for (std::thread& worker : workers_) worker.join();
    }

    std::atomic<int> size_;
    static constexpr int looks_between_yields = 64;
    int patience_ = 0;  // looks at the counter before sleeping
    alignas(64) std::atomic<int> arrived_{0};
    alignas(64) std::atomic<std::uint32_t> turn_{0};
    alignas(64) std::function<void(int)> task_;
    std::vector<std::thread> workers_;
};

}  // namespace delassus::sdk
