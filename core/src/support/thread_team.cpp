// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/thread_team.hpp"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <time.h>

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
        caller = pthread_self();
        const auto begin = Clock::now();
        barrier(true);
        body(argument, 0);
        barrier(true);
        judge(std::chrono::duration<double>(Clock::now() - begin).count());
    }

    /// Whether the calling thread should work alone for now: others keep the members from running.
    [[nodiscard]] bool rests() const { return patient && Clock::now() < rest_until; }

    /// Called after each task of so many seconds.
    void judge(double seconds) {
        worked += seconds;
        if (worked < 0.005) return;
        if (lost > 0.3 * worked) {
            rest = std::min(2 * rest, std::chrono::milliseconds(3200));
            rest_until = Clock::now() + rest;
        } else {
            rest = std::chrono::milliseconds(50);
        }
        worked = lost = 0.0;
    }

    /// Seconds of processor time that the other members have had.
    [[nodiscard]] double processor_time() {
        double sum = 0.0;
        for (std::thread& worker : workers) {
            clockid_t clock;
            timespec time{};
            if (pthread_getcpuclockid(worker.native_handle(), &clock) == 0 && clock_gettime(clock, &time) == 0)
                sum += static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
        }
        return sum;
    }

    void barrier(bool by_caller) {
        const std::uint32_t now = turn.load(std::memory_order_relaxed);
        if (arrived.fetch_add(1, std::memory_order_acq_rel) + 1 == size) {
            arrived.store(0, std::memory_order_relaxed);
            turn.store(now + 1, std::memory_order_release);
            turn.notify_all();
            return;
        }
        if (patient && appears(now)) return;
        const bool counts = patient && by_caller;
        const double before = counts ? processor_time() : 0.0;
        const auto begin = Clock::now();
        while (turn.load(std::memory_order_acquire) == now) turn.wait(now, std::memory_order_acquire);
        if (!counts) return;
        // Waiting for members that work is not lost.
        const double waited = std::chrono::duration<double>(Clock::now() - begin).count();
        lost += std::max(0.0, waited - (processor_time() - before));
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
            barrier(false);
            if (!task) return;
            task(data, index);
            barrier(false);
        }
    }

    void dismiss() {
        if (workers.empty()) return;
        task = nullptr;
        barrier(false);
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
    // Of the calling thread alone.
    pthread_t caller = pthread_self();
    double worked = 0.0, lost = 0.0;  // s since the last judgement
    std::chrono::milliseconds rest{50};
    Clock::time_point rest_until{};
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

sdk::Team ThreadTeam::team() const {
    return threads_ && threads_->rests() ? sdk::Team() : sdk::Team(&raw_);
}

void ThreadTeam::run(void* context, void (*task)(void* data, std::int32_t member), void* data) {
    auto& self = *static_cast<ThreadTeam*>(context);
    if (self.threads_ && self.threads_->born != forks().load()) static_cast<void>(self.threads_.release());
    if (!self.threads_) self.threads_ = std::make_unique<Threads>(self.raw_.size);
    self.threads_->run(task, data);
}

void ThreadTeam::wait(void* context) {
    Threads& threads = *static_cast<ThreadTeam*>(context)->threads_;
    threads.barrier(pthread_equal(threads.caller, pthread_self()) != 0);
}

}  // namespace delassus
