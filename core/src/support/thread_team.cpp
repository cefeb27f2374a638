// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/thread_team.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <system_error>
#include <thread>
#include <vector>

#include "delassus/error.hpp"
#include "support/process_record.hpp"

namespace delassus {

int usable_processors() {
    cpu_set_t set;
    CPU_ZERO(&set);
    if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

namespace {

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

// A task has a part for each member. Whoever comes first does a part: the member, or the caller once it has done its
// own. So the caller waits for nobody who has not begun, but inside a barrier of the task.
struct ThreadTeam::Threads {
    using Task = void (*)(void* data, std::int32_t member);

    explicit Threads(int members)
        : size(members), patient(members <= usable_processors()), parts(static_cast<std::size_t>(members)) {
        const WithoutSignals blocked;
        try {
            for (int index = 1; index < members; ++index) workers.emplace_back([this, index] { work(index); });
        } catch (const std::system_error& error) {
            dismiss();
            throw Error(
                fmt::format("{} threads cannot be started ({}): a limit of the system on threads or memory is reached; "
                            "the setting \"threads: 1\" of solvers needs none",
                            members - 1, error.code().message()));
        }
    }
    ~Threads() { dismiss(); }

    void run(Task body, void* argument) {
        const auto begin = Clock::now();
        caller = pthread_self();
        task = body;
        data = argument;
        left.store(size - 1, std::memory_order_relaxed);
        const std::uint64_t now = 2 * ++tasks;
        for (Part& part : parts) part.state.store(now, std::memory_order_release);
        publish(turn, static_cast<std::uint32_t>(tasks));
        body(argument, 0);
        for (int index = 1; index < size; ++index)
            if (take(index, now)) finish(index);
        await(
            left, [](int count) { return count == 0; }, true);
        judge(std::chrono::duration<double>(Clock::now() - begin).count());
    }

    void barrier(bool by_caller) {
        const std::uint32_t now = passed.load(std::memory_order_relaxed);
        if (arrived.fetch_add(1, std::memory_order_acq_rel) + 1 == size) {
            arrived.store(0, std::memory_order_relaxed);
            publish(passed, now + 1);
            return;
        }
        await(
            passed, [now](std::uint32_t value) { return value != now; }, by_caller);
    }

    /// Whether the calling thread should work alone for now: others keep the members from running.
    [[nodiscard]] bool rests() const { return patient && Clock::now() < rest_until; }

private:
    using Clock = std::chrono::steady_clock;
    // Waking a sleeper takes a good part of that; between two sweeps of a pile there is less.
    static constexpr std::chrono::microseconds patience{100};
    static constexpr int looks_between_yields = 64;

    /// A member's part of the task: twice the number of the task, and one more when somebody has taken it.
    struct alignas(64) Part {
        std::atomic<std::uint64_t> state{0};
    };

    [[nodiscard]] bool take(int index, std::uint64_t now) {
        return parts[static_cast<std::size_t>(index)].state.compare_exchange_strong(now, now + 1,
                                                                                    std::memory_order_acq_rel);
    }
    void finish(int index) {
        task(data, index);
        if (left.fetch_sub(1, std::memory_order_acq_rel) == 1) left.notify_all();
    }

    template <class Value>
    static void publish(std::atomic<Value>& where, Value value) {
        where.store(value, std::memory_order_release);
        where.notify_all();
    }

    /// Waits until the value is as wanted: looks for a while, then sleeps.
    template <class Value, class Wanted>
    void await(std::atomic<Value>& where, const Wanted& wanted, bool by_caller) {
        Value value = where.load(std::memory_order_acquire);
        if (patient) {
            const auto end = Clock::now() + patience;
            for (int k = 1; !wanted(value); ++k, value = where.load(std::memory_order_acquire)) {
                if (k % looks_between_yields != 0) {
                    pause();
                } else if (Clock::now() < end) {
                    std::this_thread::yield();  // the one that is waited for may need this very processor
                } else {
                    break;
                }
            }
        }
        if (wanted(value)) return;
        const bool counts = patient && by_caller;
        const double before = counts ? processor_time() : 0.0;
        const auto begin = Clock::now();
        for (; !wanted(value); value = where.load(std::memory_order_acquire))
            where.wait(value, std::memory_order_acquire);
        if (!counts) return;
        // Waiting for members that work is not lost.
        const double waited = std::chrono::duration<double>(Clock::now() - begin).count();
        lost += std::max(0.0, waited - (processor_time() - before));
    }

    void work(int index) {
        std::uint32_t seen = 0;
        while (true) {
            await(
                turn, [seen](std::uint32_t value) { return value != seen; }, false);
            seen = turn.load(std::memory_order_acquire);
            if (ended.load(std::memory_order_acquire)) return;
            const std::uint64_t state = parts[static_cast<std::size_t>(index)].state.load(std::memory_order_acquire);
            if (state % 2 == 0 && take(index, state)) finish(index);
        }
    }

    void dismiss() {
        ended.store(true, std::memory_order_release);
        publish(turn, turn.load(std::memory_order_relaxed) + 1);
        for (std::thread& worker : workers) worker.join();
    }

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

public:
    const int size;
    const unsigned born = count_of_forks();
    pthread_t caller = pthread_self();

private:
    const bool patient;
    Task task = nullptr;
    void* data = nullptr;
    std::uint64_t tasks = 0;
    std::vector<Part> parts;
    alignas(64) std::atomic<int> left{0};  // parts that are not done
    alignas(64) std::atomic<std::uint32_t> turn{0};
    alignas(64) std::atomic<int> arrived{0};
    alignas(64) std::atomic<std::uint32_t> passed{0};
    std::atomic<bool> ended{false};
    // Of the calling thread alone.
    double worked = 0.0, lost = 0.0;  // s since the last judgement
    std::chrono::milliseconds rest{50};
    Clock::time_point rest_until{};
    std::vector<std::thread> workers;
};

ThreadTeam::ThreadTeam(int size)
    : raw_{sizeof(delassus_team), std::max(size, 1), this, &ThreadTeam::run, &ThreadTeam::wait} {}

// Threads that a fork left behind cannot be joined: what describes them stays.
ThreadTeam::~ThreadTeam() {
    if (threads_ && threads_->born != count_of_forks()) static_cast<void>(threads_.release());
}

std::shared_ptr<ThreadTeam> ThreadTeam::for_threads(std::optional<std::int64_t> asked) {
    const int processors = usable_processors();
    return std::make_shared<ThreadTeam>(asked ? static_cast<int>(std::clamp<std::int64_t>(*asked, 1, processors))
                                              : processors);
}

// A team that rests has one member. It shrinks at the end of a task and grows here, so that its size stays while a task
// is prepared and run.
sdk::Team ThreadTeam::team() const {
    if (threads_ && raw_.size != threads_->size && !threads_->rests())
        const_cast<ThreadTeam*>(this)->raw_.size = threads_->size;
    return sdk::Team(&raw_);
}

void ThreadTeam::run(void* context, void (*task)(void* data, std::int32_t member), void* data) {
    auto& self = *static_cast<ThreadTeam*>(context);
    if (self.raw_.size == 1) return task(data, 0);
    if (self.threads_ && self.threads_->born != count_of_forks()) static_cast<void>(self.threads_.release());
    if (!self.threads_) self.threads_ = std::make_unique<Threads>(self.raw_.size);
    self.threads_->run(task, data);
    if (self.threads_->rests()) self.raw_.size = 1;
}

void ThreadTeam::wait(void* context) {
    const ThreadTeam& self = *static_cast<ThreadTeam*>(context);
    if (self.raw_.size == 1) return;
    Threads& threads = *self.threads_;
    threads.barrier(pthread_equal(threads.caller, pthread_self()) != 0);
}

}  // namespace delassus
