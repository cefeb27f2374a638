// SPDX-License-Identifier: BSD-3-Clause
#include "process/watched_process.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <limits>
#include <new>

#include "delassus/error.hpp"
#include "process/child_process.hpp"
#include "support/process_record.hpp"

namespace delassus {

namespace {

/// Seconds for a process to end after its last word, and after the user insisted.
constexpr double exit_limit = 10.0, insistence = 2.0;
/// Signals this soon after the first belong to the same request (process/supervision.hpp).
constexpr double one_request = 0.5;
constexpr long poll_nanoseconds = 50'000'000;

/// Signals by which users and shells end processes.
bool is_request_to_end(int signal_number) {
    return signal_number == SIGINT || signal_number == SIGTERM || signal_number == SIGHUP || signal_number == SIGQUIT ||
           signal_number == SIGPIPE;
}

/// What code does wrong to be ended by this signal; null for signals that others send.
const char* fault_of(int signal_number) {
    switch (signal_number) {
        case SIGSEGV:
            return "a segmentation fault";
        case SIGFPE:
            return "an arithmetic fault";
        case SIGABRT:
            return "an abort";
        case SIGBUS:
            return "a bus error";
        case SIGILL:
            return "an illegal instruction";
        default:
            return nullptr;
    }
}

/// The call that began last; null if there is none.
const ProcessRecord::Call* latest(const ProcessRecord& record) {
    const ProcessRecord::Call* found = nullptr;
    std::uint64_t number = 0;
    for (const auto& call : record.calls)
        if (const std::uint64_t own = call.number.load(std::memory_order_acquire); own > number) {
            number = own;
            found = &call;
        }
    return found;
}

/// The parent's side.
class Watcher {
public:
    Watcher(const std::string& who, int exit_code, pid_t child, const ProcessRecord& record, const sigset_t& signals)
        : who_(who), exit_code_(exit_code), child_(child), record_(record), signals_(signals) {}

    [[noreturn]] void watch() {
        int status = 0;
        while (true) {
            const timespec patience{0, poll_nanoseconds};
            const int got = sigtimedwait(&signals_, nullptr, &patience);
            if (got == SIGINT || got == SIGTERM) pass_on(got);
            const pid_t ended = waitpid(child_, &status, WNOHANG);
            if (ended == child_) finish(status);
            if (ended < 0 && errno != EINTR) _exit(exit_code_);
            enforce();
        }
    }

private:
    void pass_on(int signal_number) {
        kill(child_, signal_number);
        if (asked_ == 0) {
            asked_ = signal_number;
            asked_at_ = watch_seconds();
        } else if (!std::isfinite(insisted_at_) && watch_seconds() - asked_at_ > one_request) {
            insisted_at_ = watch_seconds();
        }
    }

    /// Kills the child where its time is over, with a sentence that says whose fault that is.
    void enforce() {
        if (killed_) return;
        const double now = watch_seconds();
        if (record_.last_word.load() >= 0) {
            last_word_at_ = std::min(last_word_at_, now);
            if (now - last_word_at_ > exit_limit)
                end_child(fmt::format("{} did not end after its last word and was killed", program()));
            return;
        }
        if (now - insisted_at_ > insistence) return end_child("");
        for (const auto& call : record_.calls)
            if (call.number.load(std::memory_order_acquire) != 0 && now > call.deadline.load())
                return end_child(fmt::format("{} did not answer for {:.3g} s{}", call.who.data(), call.limit.load(),
                                             place_of(call)));
    }

    void end_child(const std::string& sentence) {
        killed_ = true;
        if (!sentence.empty()) say(sentence);
        kill(child_, SIGKILL);
    }

    [[noreturn]] void finish(int status) {
        const int last_word = record_.last_word.load();
        if (last_word >= 0 && record_.unsaid[0] != '\0') say(record_.unsaid.data());
        if (WIFEXITED(status)) {
            const int code = WEXITSTATUS(status);
            if (last_word >= 0) _exit(last_word == 0 ? code : last_word);
            say(fmt::format("{} ended the process by itself, with exit code {}{}", culprit(), code, place()));
            _exit(exit_code_);
        }
        const int killer = WTERMSIG(status);
        const bool requested = killed_ || is_request_to_end(killer);
        if (last_word >= 0) {
            if (!requested)
                say(fmt::format("a library crashed when the process of {} ended: {}", program(), signal_name(killer)));
            _exit(last_word);
        }
        if (requested && asked_ != 0) end_by(asked_);
        if (killed_) _exit(exit_code_);
        if (requested) end_by(killer);
        if (const char* fault = fault_of(killer)) {
            say(fmt::format("{} crashed: {}{}", culprit(), fault, place()));
        } else if (killer == SIGKILL) {
            say(fmt::format("{} was ended by {}, as when its node is out of memory{}", program(), signal_name(killer),
                            ending()));
        } else {
            say(fmt::format("{} was ended by {}{}", culprit(), signal_name(killer), place()));
        }
        _exit(exit_code_);
    }

    /// As the shell expects of who was asked to end; a launcher would report that in words of its own.
    [[noreturn]] void end_by(int signal_number) {
        if (!who_.empty()) _exit(exit_code_);
        std::signal(signal_number, SIG_DFL);
        sigset_t one;
        sigemptyset(&one);
        sigaddset(&one, signal_number);
        raise(signal_number);
        sigprocmask(SIG_UNBLOCK, &one, nullptr);
        _exit(exit_code_);
    }

    [[nodiscard]] std::string program() const { return who_.empty() ? "delassus" : who_; }
    /// Whose code was running.
    [[nodiscard]] std::string culprit() const {
        const auto* call = latest(record_);
        if (!call) return program();
        return who_.empty() ? call->who.data() : fmt::format("{}, with {},", who_, call->who.data());
    }
    [[nodiscard]] static std::string place_of(const ProcessRecord::Call& call) {
        return call.what[0] == '\0' ? std::string() : fmt::format(", {}", call.what.data());
    }
    [[nodiscard]] std::string place() const {
        const auto* call = latest(record_);
        return (call ? place_of(*call) : "; no solver or library was running") + ending();
    }
    [[nodiscard]] std::string ending() const { return who_.empty() ? "" : "; so the others end too"; }

    static void say(const std::string& sentence) {
        std::fprintf(stderr, "delassus: %s\n", sentence.c_str());
        std::fflush(stderr);
    }

    const std::string& who_;
    const int exit_code_;
    const pid_t child_;
    const ProcessRecord& record_;
    const sigset_t& signals_;
    int asked_ = 0;  // the signal by which the user did
    bool killed_ = false;
    double asked_at_ = 0.0, insisted_at_ = std::numeric_limits<double>::infinity(),
           last_word_at_ = std::numeric_limits<double>::infinity();
};

ProcessRecord* new_shared_record() {
    void* memory = mmap(nullptr, sizeof(ProcessRecord), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw Error(fmt::format("no memory can be shared: {}", std::strerror(errno)));
    return new (memory) ProcessRecord;
}

}  // namespace

void continue_in_watched_child(const std::string& who, int exit_code) {
    std::fflush(nullptr);
    std::signal(SIGCHLD, SIG_DFL);  // ignored, as some launchers leave it, it would hide how the child ended
    ProcessRecord* const record = new_shared_record();
    sigset_t signals, before;
    sigemptyset(&signals);
    for (const int number : {SIGCHLD, SIGINT, SIGTERM}) sigaddset(&signals, number);
    sigprocmask(SIG_BLOCK, &signals, &before);
    const pid_t parent = getpid(), child = fork();
    if (child < 0) {
        const int cause = errno;
        sigprocmask(SIG_SETMASK, &before, nullptr);
        throw Error(fmt::format("no process could be started beside this one: {}", std::strerror(cause)));
    }
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) _exit(exit_code);
        sigprocmask(SIG_SETMASK, &before, nullptr);
        const rlimit no_core{0, 0};
        setrlimit(RLIMIT_CORE, &no_core);
        share_process_record(record);
        return;
    }
    prctl(PR_SET_NAME, "delassus-watch");
    Watcher(who, exit_code, child, *record, signals).watch();
}

void say_last_word(int exit_code, const char* unsaid) {
    std::snprintf(process_record().unsaid.data(), process_record().unsaid.size(), "%s", unsaid);
    process_record().last_word.store(exit_code);
}

}  // namespace delassus
