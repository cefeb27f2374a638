// SPDX-License-Identifier: BSD-3-Clause
// What a process does that cannot tell whether the others have failed too.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "delassus/communicator.hpp"

namespace delassus {

/// Ends the run of all processes with a sentence and exit code 3 unless destroyed within two seconds. A process that
/// has failed holds one while it waits for the others: they come if they have failed as well, and never if they wait
/// for it somewhere else.
class AloneAlarm {
public:
    AloneAlarm(const Communicator& communicator, const std::string& sentence);
    ~AloneAlarm();
    AloneAlarm(const AloneAlarm&) = delete;
    AloneAlarm& operator=(const AloneAlarm&) = delete;

private:
    std::mutex mutex_;
    std::condition_variable condition_;
    bool done_ = false;
    std::thread thread_;
};

/// Ends the run of all processes at once with a sentence of this one and exit code 3.
[[noreturn]] void fail_alone(const Communicator& communicator, const std::string& sentence);

}  // namespace delassus
