// SPDX-License-Identifier: BSD-3-Clause
#include "support/process_record.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>

namespace delassus {

namespace {

static_assert(std::atomic<double>::is_always_lock_free && std::atomic<std::uint64_t>::is_always_lock_free,
              "locks are not shared between processes");

ProcessRecord own_record;
std::atomic<ProcessRecord*> record{&own_record};

std::atomic<unsigned> forks_so_far{0};

template <std::size_t size>
void copy(std::string_view text, std::array<char, size>& to) {
    const std::size_t length = std::min(text.size(), size - 1);
    std::copy_n(text.data(), length, to.data());
    to[length] = '\0';
}

}  // namespace

unsigned count_of_forks() {
    static const int registered = pthread_atfork(nullptr, nullptr, [] {
        forks_so_far.fetch_add(1);
        record.store(&own_record);
    });
    static_cast<void>(registered);
    return forks_so_far.load();
}

double watch_seconds() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

ProcessRecord& process_record() {
    return *record.load(std::memory_order_acquire);
}

void share_process_record(ProcessRecord* shared) {
    static_cast<void>(count_of_forks());
    record.store(shared, std::memory_order_release);
}

ForeignCall::ForeignCall(std::string_view who, std::string_view what, double limit)
    : limit_(limit), forks_(count_of_forks()) {
    std::fegetenv(&arithmetic_);
    ProcessRecord& notes = process_record();
    const std::uint64_t number = notes.begun.fetch_add(1) + 1;
    for (ProcessRecord::Call& call : notes.calls) {
        std::uint64_t free = 0;
        if (call.number.load(std::memory_order_relaxed) != 0 || !call.number.compare_exchange_strong(free, number))
            continue;
        copy(who, call.who);
        copy(what, call.what);
        call.limit.store(limit, std::memory_order_relaxed);
        call.deadline.store(watch_seconds() + limit, std::memory_order_release);
        call_ = &call;
        return;
    }
}

ForeignCall::~ForeignCall() {
    if (count_of_forks() != forks_) _exit(0);
    std::fesetenv(&arithmetic_);
    if (!call_) return;
    call_->deadline.store(std::numeric_limits<double>::infinity(), std::memory_order_relaxed);
    call_->number.store(0, std::memory_order_release);
}

}  // namespace delassus
