// SPDX-License-Identifier: BSD-3-Clause
#include "process/out_of_memory.hpp"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

namespace delassus {

namespace {

constexpr std::size_t reserve_bytes = 256 * 1024;

std::atomic<void*> reserve{nullptr};
std::atomic<const char*> activity{nullptr};
int last_exit_code = 1;
std::terminate_handler former_handler = nullptr;
std::atomic<bool> allocation_failed{false};

/// Called by operator new in place of a failing allocation.
void give_up_reserve() {
    allocation_failed = true;
    std::free(reserve.exchange(nullptr));
    throw std::bad_alloc();
}

void on_terminate() {
    // A std::bad_alloc in a noexcept function of the standard library (directory_iterator has one) is not current here.
    bool by_memory = allocation_failed;
    try {
        if (const auto cause = std::current_exception()) std::rethrow_exception(cause);
    } catch (const std::bad_alloc&) {
        by_memory = true;
    } catch (...) {
        by_memory = false;
    }
    if (!by_memory) former_handler();
    say_out_of_memory();
    _exit(last_exit_code);
}

}  // namespace

void prepare_for_out_of_memory(int exit_code) {
    last_exit_code = exit_code;
    reserve = std::malloc(reserve_bytes);
    std::set_new_handler(give_up_reserve);
    former_handler = std::set_terminate(on_terminate);
}

void set_activity(const char* now) {
    activity = now;
}

bool memory_has_ended() {
    return allocation_failed;
}

void say_out_of_memory() {
    const auto say = [](const char* text) { return write(STDERR_FILENO, text, std::strlen(text)) >= 0; };
    const char* what = activity;
    if (say("delassus: out of memory") && what != nullptr && say(" while ")) say(what);
    say("\n");
}

}  // namespace delassus
