// SPDX-License-Identifier: BSD-3-Clause
#include "check/isolated.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "delassus/error.hpp"

namespace delassus::check {

namespace {

using Verdict = CheckResult::Verdict;
using Clock = std::chrono::steady_clock;

/// What the child writes to the pipe: one letter for the verdict, then the detail.
constexpr char passed_mark = 'P', failed_mark = 'F', skipped_mark = 'S', warning_mark = 'W';

std::string message_of(const std::function<std::string()>& body) {
    try {
        return passed_mark + body();
    } catch (const Skip& reason) {
        return skipped_mark + std::string(reason.what());
    } catch (const Warning& reason) {
        return warning_mark + std::string(reason.what());
    } catch (const Failure& reason) {
        return failed_mark + std::string(reason.what());
    } catch (const Error& error) {
        return failed_mark + std::string(error.what());
    } catch (const std::exception& error) {
        return failed_mark + fmt::format("an exception came through the plugin border: {}", error.what());
    } catch (...) {
        return failed_mark + std::string("an exception came through the plugin border");
    }
}

/// Signals as a plugin's author knows them.
std::string cause_of(int signal_number) {
    switch (signal_number) {
        case SIGSEGV:
            return "segmentation fault";
        case SIGFPE:
            return "arithmetic fault";
        case SIGABRT:
            return "abort";
        case SIGBUS:
            return "bus error";
        case SIGILL:
            return "illegal instruction";
        default:
            return fmt::format("signal {}", signal_number);
    }
}

[[noreturn]] void run_child(int answer, int printed, Leave leave, const std::function<std::string()>& body) {
    // Its own process group, so that a time limit ends what the plugin started as well.
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    for (const int number : {SIGSEGV, SIGFPE, SIGABRT, SIGBUS, SIGILL, SIGINT, SIGTERM}) std::signal(number, SIG_DFL);
    dup2(printed, STDOUT_FILENO);

    const std::string message = message_of(body);
    for (std::size_t written = 0; written < message.size();) {
        const auto count = write(answer, message.data() + written, message.size() - written);
        if (count <= 0) break;
        written += static_cast<std::size_t>(count);
    }
    close(answer);
    if (leave == Leave::ByExit) std::exit(0);
    std::fflush(stdout);
    _exit(0);
}

/// Reads what is there; false at the end of the pipe.
bool read_some(int descriptor, std::string& text) {
    std::array<char, 4096> buffer;
    const auto count = read(descriptor, buffer.data(), buffer.size());
    if (count > 0) text.append(buffer.data(), static_cast<std::size_t>(count));
    return count > 0;
}

/// Waits for the child until the deadline; false if it had to be killed.
bool wait_for(pid_t child, int descriptor, double seconds, std::string& message, int& status) {
    const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
    bool open = true;
    while (Clock::now() < deadline) {
        pollfd waiting{descriptor, POLLIN, 0};
        if (open && poll(&waiting, 1, 20) > 0) open = read_some(descriptor, message);
        if (!open) usleep(1000);
        if (waitpid(child, &status, WNOHANG) == child) {
            fcntl(descriptor, F_SETFL, O_NONBLOCK);
            while (read_some(descriptor, message)) {
            }
            return true;
        }
    }
    kill(-child, SIGKILL);
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return false;
}

IsolatedOutcome judge(bool returned, double seconds, int status, const std::string& message) {
    IsolatedOutcome outcome;
    outcome.returned = returned;
    if (!returned) {
        outcome.detail = fmt::format("did not return within {} s", seconds);
        return outcome;
    }
    const char* when = message.empty() ? "" : " while the process ended, after the check was done";
    if (WIFSIGNALED(status)) {
        outcome.detail = fmt::format("crashed{}: {}", when, cause_of(WTERMSIG(status)));
    } else if (message.empty() || WEXITSTATUS(status) != 0) {
        outcome.detail = fmt::format("ended the process with exit code {}{}", WEXITSTATUS(status), when);
    } else {
        outcome.verdict = message[0] == passed_mark    ? Verdict::Passed
                          : message[0] == skipped_mark ? Verdict::Skipped
                          : message[0] == warning_mark ? Verdict::Warning
                                                       : Verdict::Failed;
        outcome.detail = message.substr(1);
    }
    return outcome;
}

/// A file descriptor that closes itself.
class Descriptor {
public:
    explicit Descriptor(int number) : number_(number) {
        if (number_ < 0) throw Error(fmt::format("cannot open a pipe: {}", std::strerror(errno)));
    }
    ~Descriptor() { release(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    [[nodiscard]] int number() const { return number_; }
    void release() {
        if (number_ >= 0) close(number_);
        number_ = -1;
    }

private:
    int number_;
};

}  // namespace

IsolatedOutcome run_isolated(double seconds, Leave leave, const std::function<std::string()>& body) {
    std::array<int, 2> ends{-1, -1};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw Error(fmt::format("cannot open a pipe: {}", std::strerror(errno)));
    const Descriptor answer(ends[0]);
    Descriptor question(ends[1]);
    const Descriptor printed(memfd_create("delassus-check-stdout", MFD_CLOEXEC));

    std::fflush(nullptr);  // or the child would write our buffers again
    const pid_t child = fork();
    if (child < 0) throw Error(fmt::format("cannot start a process: {}", std::strerror(errno)));
    if (child == 0) run_child(question.number(), printed.number(), leave, body);
    question.release();

    std::string message;
    int status = 0;
    const bool returned = wait_for(child, answer.number(), seconds, message, status);
    IsolatedOutcome outcome = judge(returned, seconds, status, message);
    struct stat information {};
    if (fstat(printed.number(), &information) == 0)
        outcome.bytes_printed = static_cast<std::size_t>(information.st_size);
    return outcome;
}

}  // namespace delassus::check
