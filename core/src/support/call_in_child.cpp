// SPDX-License-Identifier: BSD-3-Clause
#include "support/call_in_child.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <string_view>
#include <vector>

#include "delassus/error.hpp"
#include "support/process_record.hpp"
#include "support/sentence.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace {

/// The message of the child: one of these, then the content, then message_end.
constexpr char holds_result = 'R';
constexpr char holds_refusal = 'E';
constexpr char message_end = '.';
/// The message of a child that ran out of memory.
constexpr std::string_view out_of_memory = "M.";

void send(std::string_view message, int pipe) {
    while (!message.empty()) {
        const ssize_t written = write(pipe, message.data(), message.size());
        if (written < 0 && errno != EINTR) _exit(1);
        if (written > 0) message.remove_prefix(static_cast<std::size_t>(written));
    }
}

/// What the child is to do with a file.
struct Task {
    const std::filesystem::path& file;
    const char* done;  ///< "read" or "written"
    rlim_t seconds;    ///< of processor time
    const std::function<std::string()>& work;
};

std::string message_of(const Task& task) {
    try {
        return holds_result + task.work() + message_end;
    } catch (const InputError& refusal) {
        return holds_refusal + std::string(refusal.what()) + message_end;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& failure) {
        return holds_refusal +
               fmt::format("{} cannot be {}: {}.", task.file.string(), task.done, sentence_of(failure)) + message_end;
    }
}

/// No exception may leave the child, which would otherwise go on as a second parent.
[[noreturn]] void run_in_child(const Task& task, int pipe) noexcept {
    for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU, SIGPIPE}) std::signal(signal, SIG_DFL);
    const rlimit no_core{0, 0};
    const rlimit processor_time{task.seconds, task.seconds};
    setrlimit(RLIMIT_CORE, &no_core);
    setrlimit(RLIMIT_CPU, &processor_time);
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // it holds what the parent has locked
    // What the C library says about a damaged heap is not for the user.
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
    try {
        send(message_of(task), pipe);
    } catch (const std::bad_alloc&) {
        send(out_of_memory, pipe);
    } catch (...) {
        _exit(1);
    }
    _exit(0);
}

/// The child's status, once it has ended.
int wait_for(pid_t child) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return status;
}

/// Nothing more if `seconds` pass: a library may wait, for a pipe say, without using the processor.
std::string read_to_end(int pipe, double seconds) {
    std::string bytes;
    std::vector<char> buffer(1 << 16);
    const double end = watch_seconds() + seconds;
    for (;;) {
        if (watch_seconds() > end) return bytes;
        pollfd waiting{pipe, POLLIN, 0};
        if (poll(&waiting, 1, 1000) <= 0) continue;
        const ssize_t got = read(pipe, buffer.data(), buffer.size());
        if (got > 0) bytes.append(buffer.data(), static_cast<std::size_t>(got));
        if (got == 0 || (got < 0 && errno != EINTR)) return bytes;
    }
}

/// What the child returned, or nothing and its status if it failed without a sentence.
std::optional<std::string> result_of(const Task& task, int& status) {
    const auto refuse = [&] {
        throw InputError(fmt::format("{} cannot be {}: {}.", task.file.string(), task.done, std::strerror(errno)));
    };
    int pipe[2];
    if (pipe2(pipe, O_CLOEXEC) != 0) refuse();
    const pid_t child = fork();
    if (child == 0) {
        close(pipe[0]);
        run_in_child(task, pipe[1]);
    }
    const int fork_error = errno;
    close(pipe[1]);
    if (child < 0) {
        close(pipe[0]);
        errno = fork_error;
        refuse();
    }
    std::string message;
    try {
        const bool bounded = task.seconds != RLIM_INFINITY;
        message = read_to_end(pipe[0], bounded ? 60.0 + 4.0 * static_cast<double>(task.seconds)
                                               : std::numeric_limits<double>::infinity());
    } catch (...) {
        close(pipe[0]);
        kill(child, SIGKILL);
        wait_for(child);
        throw;
    }
    close(pipe[0]);
    if (message.empty() || message.back() != message_end) kill(child, SIGKILL);  // if it is not gone, it waits
    status = wait_for(child);
    if (message == out_of_memory) throw std::bad_alloc();
    if (message.size() >= 2 && message.back() == message_end) {
        std::string content = message.substr(1, message.size() - 2);
        if (message[0] == holds_result) return content;
        if (message[0] == holds_refusal) throw InputError(content);
    }
    return std::nullopt;
}

}  // namespace

std::string call_in_child(const std::filesystem::path& file, const char* library, unsigned seconds,
                          const std::function<std::string()>& work) {
    require_regular_file(file);
    int status = 0;
    if (auto result = result_of({file, "read", seconds, work}, status)) return std::move(*result);
    const bool too_long = WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL);
    throw InputError(
        fmt::format("{} is damaged: {} {} on it.", file.string(), library, too_long ? "does not end" : "fails"));
}

std::int64_t write_in_child(const std::filesystem::path& file, const char* library,
                            const std::function<std::int64_t()>& work) {
    int status = 0;
    const std::function<std::string()> write = [&] { return std::to_string(work()); };
    const auto bytes = result_of({file, "written", RLIM_INFINITY, write}, status);
    if (!bytes) throw InputError(fmt::format("{} cannot be written: {} fails.", file.string(), library));
    return std::stoll(*bytes);
}

}  // namespace delassus
