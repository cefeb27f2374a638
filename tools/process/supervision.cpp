// SPDX-License-Identifier: BSD-3-Clause
#include "process/supervision.hpp"

#include <csignal>
#include <ctime>

namespace delassus {

namespace {

volatile std::sig_atomic_t was_interrupted = 0;
timespec first_interrupt{};

double seconds_between(const timespec& from, const timespec& to) {
    return static_cast<double>(to.tv_sec - from.tv_sec) + 1e-9 * static_cast<double>(to.tv_nsec - from.tv_nsec);
}

// The first interrupt asks for an end, a later one insists. One request may arrive as two signals: `timeout` sends to
// the process and again to its group.
void on_interrupt(int signal_number) {
    constexpr double one_request = 0.5;  // s
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    if (!was_interrupted) {
        first_interrupt = now;
        was_interrupted = 1;
    } else if (seconds_between(first_interrupt, now) > one_request) {
        std::signal(signal_number, SIG_DFL);
        raise(signal_number);
    }
}

}  // namespace

void install_interrupt_handler() {
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
}

bool interrupted() {
    return was_interrupted != 0;
}

}  // namespace delassus
