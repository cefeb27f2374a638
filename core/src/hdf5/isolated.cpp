// SPDX-License-Identifier: BSD-3-Clause
#include "hdf5/isolated.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/error.hpp"

namespace delassus::hdf5 {
namespace {

/// The message of the child: one of these, then the content, then message_end.
constexpr char holds_content = 'P';
constexpr char holds_refusal = 'E';
constexpr char message_end = '.';

/// Processor time for the smallest file, and bytes a second beyond that; some damaged files keep HDF5 busy for ever.
constexpr rlim_t least_seconds = 20;
constexpr rlim_t bytes_per_second = 5'000'000;

/// What the child does; never returns.
[[noreturn]] void read_in_child(const std::filesystem::path& file, const std::function<void(Packer&)>& read, int pipe) {
    for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU, SIGPIPE}) std::signal(signal, SIG_DFL);
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    const rlim_t seconds = least_seconds + (error ? 0 : bytes / bytes_per_second);
    const rlimit no_core{0, 0};
    const rlimit processor_time{seconds, seconds};
    setrlimit(RLIMIT_CORE, &no_core);
    setrlimit(RLIMIT_CPU, &processor_time);
    // What the C library says about a damaged heap is not for the user.
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);

    Packer message;
    try {
        message.bytes = holds_content;
        read(message);
    } catch (const InputError& refusal) {
        message.bytes = holds_refusal;
        message(std::string(refusal.what()));
    } catch (const std::exception& failure) {
        message.bytes = holds_refusal;
        message(fmt::format("{} cannot be read: {}.", file.string(), failure.what()));
    }
    message.bytes += message_end;
    for (std::string_view rest = message.bytes; !rest.empty();) {
        const ssize_t written = write(pipe, rest.data(), rest.size());
        if (written < 0 && errno != EINTR) _exit(1);
        if (written > 0) rest.remove_prefix(static_cast<std::size_t>(written));
    }
    _exit(0);
}

std::string read_to_end(int pipe) {
    std::string bytes;
    std::vector<char> buffer(1 << 16);
    for (;;) {
        const ssize_t got = read(pipe, buffer.data(), buffer.size());
        if (got > 0) bytes.append(buffer.data(), static_cast<std::size_t>(got));
        if (got == 0 || (got < 0 && errno != EINTR)) return bytes;
    }
}

}  // namespace

void read_isolated(const std::filesystem::path& file, const std::function<void(Packer&)>& read,
                   const std::function<void(Unpacker&)>& take) {
    int pipe[2];
    if (pipe2(pipe, O_CLOEXEC) != 0) {
        throw InputError(fmt::format("{} cannot be read: {}.", file.string(), std::strerror(errno)));
    }
    const pid_t child = fork();
    if (child == 0) {
        close(pipe[0]);
        read_in_child(file, read, pipe[1]);
    }
    const int fork_error = errno;
    close(pipe[1]);
    std::string message;
    if (child > 0) message = read_to_end(pipe[0]);
    close(pipe[0]);
    if (child < 0) {
        throw InputError(fmt::format("{} cannot be read: {}.", file.string(), std::strerror(fork_error)));
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (message.size() >= 2 && message.back() == message_end) {
        Unpacker content(std::string_view(message).substr(1, message.size() - 2));
        if (message[0] == holds_refusal) {
            std::string refusal;
            content(refusal);
            if (content.complete()) throw InputError(refusal);
        } else if (message[0] == holds_content) {
            take(content);
            if (content.complete()) return;
        }
    }
    const bool too_long = WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL);
    throw InputError(fmt::format("{} is damaged: HDF5 {} on it.", file.string(), too_long ? "does not end" : "fails"));
}

}  // namespace delassus::hdf5
