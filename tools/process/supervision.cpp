// SPDX-License-Identifier: BSD-3-Clause
#include "process/supervision.hpp"

#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
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

// Signal handlers may only touch what is laid out beforehand.
std::array<char, 512> crash_sentence{};
int crash_exit_code = 1;
std::array<char, 65536> crash_stack{};

void on_crash(int signal_number) {
    const char* cause = signal_number == SIGSEGV   ? "a segmentation fault"
                        : signal_number == SIGFPE  ? "an arithmetic fault"
                        : signal_number == SIGABRT ? "an abort"
                        : signal_number == SIGBUS  ? "a bus error"
                                                   : "an illegal instruction";
    const auto say = [](const char* text) { return write(STDERR_FILENO, text, std::strlen(text)) >= 0; };
    if (!say(crash_sentence.data()) || !say(cause) || !say("\n")) _exit(crash_exit_code);
    _exit(crash_exit_code);
}

}  // namespace

void install_interrupt_handler() {
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
}

bool interrupted() {
    return was_interrupted != 0;
}

void install_crash_handler(const std::string& who, int exit_code) {
    std::snprintf(crash_sentence.data(), crash_sentence.size(), "delassus: %s crashed: ", who.c_str());
    crash_exit_code = exit_code;
    stack_t stack{};
    stack.ss_sp = crash_stack.data();
    stack.ss_size = crash_stack.size();
    sigaltstack(&stack, nullptr);
    struct sigaction action {};
    action.sa_handler = on_crash;
    action.sa_flags = SA_ONSTACK;
    for (const int signal_number : {SIGSEGV, SIGFPE, SIGABRT, SIGBUS, SIGILL})
        sigaction(signal_number, &action, nullptr);
}

Watchdog::Watchdog(double seconds, std::string sentence, int exit_code) {
    if (!std::isfinite(seconds)) return;
    thread_ = std::thread([this, seconds, text = std::move(sentence), exit_code] {
        std::unique_lock lock(mutex_);
        if (condition_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return done_; })) return;
        std::fprintf(stderr, "delassus: %s\n", text.c_str());
        _exit(exit_code);
    });
}

Watchdog::~Watchdog() {
    {
        const std::lock_guard lock(mutex_);
        done_ = true;
    }
    condition_.notify_all();
    if (thread_.joinable()) thread_.join();
}

}  // namespace delassus
