// SPDX-License-Identifier: BSD-3-Clause
#include "process/supervision.hpp"

#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace delassus {

namespace {

volatile std::sig_atomic_t interrupt_count = 0;

void on_interrupt(int signal_number) {
    interrupt_count = interrupt_count + 1;
    std::signal(signal_number, SIG_DFL);
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
    return interrupt_count > 0;
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
