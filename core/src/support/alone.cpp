// SPDX-License-Identifier: BSD-3-Clause
#include "support/alone.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <system_error>

#include "support/process_record.hpp"

namespace delassus {

namespace {
constexpr int exit_of_a_failed_run = 3;
}

AloneAlarm::AloneAlarm(const Communicator& communicator, const std::string& sentence) {
    if (communicator.size() == 1) return;
    try {
        thread_ = std::thread([this, &communicator, sentence] {
            std::unique_lock lock(mutex_);
            if (!condition_.wait_for(lock, std::chrono::seconds(2), [this] { return done_; }))
                fail_alone(communicator, sentence);
        });
    } catch (const std::system_error&) {  // no thread can be started: nobody would notice that the others do not come
        fail_alone(communicator, sentence);
    }
}

AloneAlarm::~AloneAlarm() {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        done_ = true;
    }
    condition_.notify_one();
    thread_.join();
}

void meet_in_failure(const Communicator& last_words, const std::string& sentence) {
    const AloneAlarm alarm(last_words, sentence);
    static_cast<void>(last_words.all(0));
}

void fail_alone(const Communicator& communicator, const std::string& sentence) {
    fmt::print(stderr, "delassus: process {} of {} failed, so the others end too: {}\n", communicator.rank(),
               communicator.size(), sentence);
    std::fflush(stderr);
    process_record().last_word.store(exit_of_a_failed_run);
    communicator.abort(exit_of_a_failed_run);
    std::_Exit(exit_of_a_failed_run);  // not reached
}

}  // namespace delassus
