// SPDX-License-Identifier: BSD-3-Clause
#include "fclib/isolated.hpp"

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
#include <type_traits>

#include "delassus/error.hpp"
#include "fclib/fclib.hpp"

namespace delassus::fclib {
namespace {

/// The message of the child: one of these, then the content, then message_end.
constexpr char holds_problem = 'P';
constexpr char holds_refusal = 'E';
constexpr char message_end = '.';

/// Processor time for the smallest file, and bytes a second beyond that; some damaged files keep HDF5 busy for ever.
constexpr rlim_t least_seconds = 20;
constexpr rlim_t bytes_per_second = 5'000'000;

class Packer {
public:
    std::string bytes;

    void text(const std::string& value) { array(value.data(), value.size()); }
    template <class Number>
    void vector(const std::vector<Number>& values) {
        array(values.data(), values.size());
    }
    template <class Number>
    void number(Number value) {
        static_assert(std::is_trivially_copyable_v<Number>);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void matrix(const SparseMatrix& A) {
        number(A.rows);
        number(A.columns);
        vector(A.row_start);
        vector(A.column);
        vector(A.value);
    }
    /// Friction cones and free rows, which is all that FCLib has.
    void problem(const Problem& problem) {
        for (const SparseMatrix* A : {&problem.H, &problem.D, &problem.E}) matrix(*A);
        vector(problem.a);
        vector(problem.b);
        number(problem.cones.size());
        for (const Cone& cone : problem.cones) {
            number(cone.kind);
            number(cone.rows);
            number(cone.mu);
        }
        number(problem.law);
        for (const std::string* value : {&problem.name, &problem.source, &problem.notes}) text(*value);
    }

private:
    template <class Element>
    void array(const Element* data, std::size_t count) {
        number(count);
        if (count > 0) bytes.append(reinterpret_cast<const char*>(data), count * sizeof(Element));
    }
};

/// The child was led by a file that may be hostile, so nothing it says is believed without a look.
class Unpacker {
public:
    explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}

    [[nodiscard]] bool complete() const { return good_ && bytes_.empty(); }

    std::string text() { return array<std::string>(); }

    Problem problem() {
        Problem problem;
        for (SparseMatrix* A : {&problem.H, &problem.D, &problem.E}) *A = matrix();
        problem.a = array<std::vector<double>>();
        problem.b = array<std::vector<double>>();
        for (auto count = number<std::size_t>(); count > 0 && good_; --count) {
            Cone cone;
            cone.kind = number<ConeKind>();
            cone.rows = number<std::int32_t>();
            cone.mu = number<double>();
            problem.cones.push_back(std::move(cone));
        }
        problem.law = number<Law>();
        for (std::string* value : {&problem.name, &problem.source, &problem.notes}) *value = text();
        return problem;
    }

private:
    template <class Number>
    Number number() {
        Number value{};
        take(&value, sizeof value, 1);
        return value;
    }

    template <class Array>
    Array array() {
        Array values;
        const auto count = number<std::size_t>();
        constexpr std::size_t size = sizeof(typename Array::value_type);
        if (count > bytes_.size() / size) {
            good_ = false;
        } else {
            values.resize(count);
            take(values.data(), size, count);
        }
        return values;
    }

    SparseMatrix matrix() {
        SparseMatrix A;
        A.rows = number<std::int32_t>();
        A.columns = number<std::int32_t>();
        A.row_start = array<std::vector<std::int32_t>>();
        A.column = array<std::vector<std::int32_t>>();
        A.value = array<std::vector<double>>();
        return A;
    }

    void take(void* target, std::size_t size, std::size_t count) {
        if (!good_ || count > bytes_.size() / size) {
            good_ = false;
            return;
        }
        if (count > 0) std::memcpy(target, bytes_.data(), size * count);
        bytes_.remove_prefix(size * count);
    }

    std::string_view bytes_;
    bool good_ = true;
};

/// What the child does; never returns.
[[noreturn]] void read_in_child(const std::filesystem::path& file, int pipe) {
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
        const Problem problem = read_file(file);
        message.bytes = holds_problem;
        message.problem(problem);
    } catch (const InputError& refusal) {
        message.bytes = holds_refusal;
        message.text(refusal.what());
    } catch (const std::exception& failure) {
        message.bytes = holds_refusal;
        message.text(fmt::format("{} cannot be read: {}.", file.string(), failure.what()));
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

Problem read_isolated(const std::filesystem::path& file) {
    int pipe[2];
    if (pipe2(pipe, O_CLOEXEC) != 0) {
        throw InputError(fmt::format("{} cannot be read: {}.", file.string(), std::strerror(errno)));
    }
    const pid_t child = fork();
    if (child == 0) {
        close(pipe[0]);
        read_in_child(file, pipe[1]);
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
            const std::string refusal = content.text();
            if (content.complete()) throw InputError(refusal);
        } else if (message[0] == holds_problem) {
            Problem problem = content.problem();
            if (content.complete()) {
                validate(problem);
                return problem;
            }
        }
    }
    const bool too_long = WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL);
    throw InputError(fmt::format("{} is damaged: HDF5 {} on it.", file.string(), too_long ? "does not end" : "fails"));
}

}  // namespace delassus::fclib
