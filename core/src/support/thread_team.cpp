// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/thread_team.hpp"

#include <pthread.h>
#include <sched.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace delassus {

int usable_processors() {
    cpu_set_t set;
    CPU_ZERO(&set);
    if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

namespace {

/// How often this process is the child of a fork since the first team.
std::atomic<unsigned>& forks() {
    static std::atomic<unsigned> count = 0;
    static const int registered = pthread_atfork(nullptr, nullptr, [] { forks().fetch_add(1); });
    static_cast<void>(registered);
    return count;
}

void pause() {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
}

/// All signals are blocked while it lives: threads started meanwhile get none.
class WithoutSignals {
public:
    WithoutSignals() {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before_);
    }
    ~WithoutSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    WithoutSignals(const WithoutSignals&) = delete;
    WithoutSignals& operator=(const WithoutSignals&) = delete;

private:
    sigset_t before_;
};

}  // namespace

struct ThreadTeam::Threads {
    using Task = void (*)(void* data, std::int32_t member);

    explicit Threads(int members) : size(members), patient(members <= usable_processors()) {
        const WithoutSignals blocked;
        try {
            for (int index = 1; index < members; ++index) workers.emplace_back([this, index] { work(index); });
        } catch (...) {
            size = static_cast<int>(workers.size()) + 1;
            dismiss();
            throw;
        }
    }
    ~Threads() { dismiss(); }

    void run(Task body, void* argument) {
        task = body;
        data = argument;
        barrier();
        body(argument, 0);
        barrier();
    }

    void barrier() {
        const std::uint32_t now = turn.load(std::memory_order_relaxed);
        if (arrived.fetch_add(1, std::memory_order_acq_rel) + 1 == size) {
            arrived.store(0, std::memory_order_relaxed);
            turn.store(now + 1, std::memory_order_release);
            turn.notify_all();
            return;
        }
        if (patient && appears(now)) return;
        while (turn.load(std::memory_order_acquire) == now) turn.wait(now, std::memory_order_acquire);
    }

    /// Looks for the next turn for a while; whether it came.
    [[nodiscard]] bool appears(std::uint32_t now) const {
        const auto end = Clock::now() + patience;
        do {
            for (int k = 0; k < looks_between_yields; ++k) {
                if (turn.load(std::memory_order_acquire) != now) return true;
                pause();
            }
            std::this_thread::yield();  // the one that is waited for may need this very processor
        } while (Clock::now() < end);
        return false;
    }

    void work(int index) {
        while (true) {
            barrier();
            if (!task) return;
            task(data, index);
            barrier();
        }
    }

    void dismiss() {
        if (workers.empty()) return;
        task = nullptr;
        barrier();
        for (std::thread& worker : workers) worker.join();
    }

    using Clock = std::chrono::steady_clock;
    // Waking a sleeper takes about as long; a sweep over a thousand contacts takes less.
    static constexpr std::chrono::microseconds patience{30};
    static constexpr int looks_between_yields = 64;

    int size;
    const bool patient;
    const unsigned born = forks().load();
    Task task = nullptr;
    void* data = nullptr;
    alignas(64) std::atomic<int> arrived{0};
    alignas(64) std::atomic<std::uint32_t> turn{0};
    std::vector<std::thread> workers;
};

ThreadTeam::ThreadTeam(int size)
    : raw_{sizeof(delassus_team), std::max(size, 1), this, &ThreadTeam::run, &ThreadTeam::wait} {}

// Threads that a fork left behind cannot be joined: what describes them stays.
ThreadTeam::~ThreadTeam() {
    if (threads_ && threads_->born != forks().load()) static_cast<void>(threads_.release());
}

std::shared_ptr<ThreadTeam> ThreadTeam::for_threads(std::optional<std::int64_t> asked) {
    const int processors = usable_processors();
    return std::make_shared<ThreadTeam>(asked ? static_cast<int>(std::clamp<std::int64_t>(*asked, 1, processors))
                                              : processors);
}

void ThreadTeam::run(void* context, void (*task)(void* data, std::int32_t member), void* data) {
    auto& self = *static_cast<ThreadTeam*>(context);
    if (self.threads_ && self.threads_->born != forks().load()) static_cast<void>(self.threads_.release());
    if (!self.threads_) self.threads_ = std::make_unique<Threads>(self.raw_.size);
    self.threads_->run(task, data);
}

void ThreadTeam::wait(void* context) {
    static_cast<ThreadTeam*>(context)->threads_->barrier();
}

}  // namespace delassus
