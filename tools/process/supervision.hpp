// SPDX-License-Identifier: BSD-3-Clause
// Protects the user from plugins in this process: interrupts, crashes and hangs.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace delassus {

/// Makes Ctrl-C a request: interrupted() turns true. A second Ctrl-C, more than half a second later, ends the process
/// at once; an earlier one belongs to the same request (`timeout -s INT` sends two).
void install_interrupt_handler();
[[nodiscard]] bool interrupted();

/// If this process dies of a fault from now on, one sentence naming who was at work goes to standard error, and the
/// process ends with this exit code.
void install_crash_handler(const std::string& who, int exit_code);

/// Ends the process with a sentence and an exit code unless destroyed within the given seconds; for solvers that do
/// not answer. An infinite limit watches nothing.
class Watchdog {
public:
    Watchdog(double seconds, std::string sentence, int exit_code);
    ~Watchdog();
    Watchdog(const Watchdog&) = delete;
    Watchdog& operator=(const Watchdog&) = delete;

private:
    std::mutex mutex_;
    std::condition_variable condition_;
    bool done_ = false;
    std::thread thread_;
};

}  // namespace delassus
