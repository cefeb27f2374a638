// SPDX-License-Identifier: BSD-3-Clause
#include "process/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>

#include "delassus/error.hpp"

namespace delassus {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kept_errors = 64 * 1024;
constexpr int poll_milliseconds = 50;

class Descriptor {
public:
    explicit Descriptor(int value = -1) : value_(value) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { reset(); }
    void reset(int value = -1) {
        if (value_ >= 0) close(value_);
        value_ = value;
    }
    [[nodiscard]] int get() const { return value_; }

private:
    int value_;
};

[[noreturn]] void fail(const ChildSettings& settings, int error_number) {
    throw Error(settings.program.string() + " cannot be started: " + std::strerror(error_number));
}

struct Pipe {
    Descriptor read_end, write_end;
    void open(const ChildSettings& settings) {
        std::array<int, 2> ends{};
        if (pipe2(ends.data(), O_CLOEXEC) != 0) fail(settings, errno);
        read_end.reset(ends[0]);
        write_end.reset(ends[1]);
    }
};

/// A file that holds the input, so that neither process waits for the other.
void open_input(Descriptor& file, const ChildSettings& settings) {
    file.reset(memfd_create("delassus-input", MFD_CLOEXEC));
    std::string_view rest = settings.input;
    if (file.get() < 0) fail(settings, errno);
    while (!rest.empty()) {
        const ssize_t written = write(file.get(), rest.data(), rest.size());
        if (written < 0 && errno != EINTR) fail(settings, errno);
        if (written > 0) rest.remove_prefix(static_cast<std::size_t>(written));
    }
    lseek(file.get(), 0, SEEK_SET);
}

std::vector<std::string> environment_of(const ChildSettings& settings) {
    std::map<std::string, std::string> variables;
    for (char** entry = environ; *entry; ++entry) {
        const std::string text = *entry;
        const auto equals = text.find('=');
        if (equals != std::string::npos) variables[text.substr(0, equals)] = text.substr(equals + 1);
    }
    for (const auto& [name, value] : settings.environment) variables[name] = value;
    std::vector<std::string> lines;
    for (const auto& [name, value] : variables) lines.push_back(name + "=" + value);
    return lines;
}

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (auto& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

/// In the child, between fork and exec: nothing here may allocate.
[[noreturn]] void become(const ChildSettings& settings, char* const* arguments, char* const* environment, int input,
                         int output, int errors, int trouble, pid_t parent) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(127);
    for (const int number : {SIGINT, SIGTERM, SIGPIPE, SIGCHLD}) std::signal(number, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    if (settings.memory_limit > 0) {
        const rlimit limit{settings.memory_limit, settings.memory_limit};
        setrlimit(RLIMIT_AS, &limit);
    }
    if (settings.core) {
        cpu_set_t set;
        CPU_ZERO(&set);
        CPU_SET(static_cast<std::size_t>(*settings.core), &set);
        sched_setaffinity(0, sizeof set, &set);
    }
    if (dup2(input, STDIN_FILENO) >= 0 && dup2(output, STDOUT_FILENO) >= 0 && dup2(errors, STDERR_FILENO) >= 0)
        execve(settings.program.c_str(), arguments, environment);
    const int cause = errno;
    if (write(trouble, &cause, sizeof cause) < 0) _exit(126);
    _exit(127);
}

double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// The processes that this one has started, those that they have started, and so on; as far as they are still there.
std::vector<pid_t> descendants_of(pid_t process) {
    std::vector<pid_t> found = {process};
    for (std::size_t k = 0; k < found.size(); ++k) {
        std::error_code ignored;
        const std::filesystem::path tasks = "/proc/" + std::to_string(found[k]) + "/task";
        for (const auto& task : std::filesystem::directory_iterator(tasks, ignored)) {
            std::ifstream children(task.path() / "children");
            for (pid_t child = 0; children >> child;) found.push_back(child);
        }
    }
    found.erase(found.begin());
    return found;
}

/// The parent's side of a running child.
class Watch {
public:
    Watch(const ChildSettings& settings, pid_t pid, int output, int errors)
        : settings_(settings), pid_(pid), output_(output), errors_(errors), allowed_(settings.timeout) {
        for (const int end : {output_, errors_}) fcntl(end, F_SETFL, fcntl(end, F_GETFL) | O_NONBLOCK);
    }

    ChildResult run() {
        while (!ended()) {
            std::array<pollfd, 2> ends{pollfd{output_, POLLIN, 0}, pollfd{errors_, POLLIN, 0}};
            // Once both pipes are closed, only the end of the process is left to wait for, and it is near.
            const bool closed = output_ < 0 && errors_ < 0;
            poll(ends.data(), ends.size(), closed ? 2 : poll_milliseconds);
            if (ends[0].revents) drain(output_);
            if (ends[1].revents) drain(errors_);
            enforce();
        }
        kill(-pid_, SIGKILL);  // what it may have started; it is not reaped yet, so the group is still its own
        drain(output_);
        drain(errors_);
        int status = 0;
        rusage usage{};
        while (wait4(pid_, &status, 0, &usage) < 0 && errno == EINTR) {
        }
        result_.seconds = seconds_since(begin_);
        result_.peak_memory = static_cast<std::int64_t>(usage.ru_maxrss) * 1024;
        if (settings_.resident_limit > 0 && static_cast<std::uint64_t>(result_.peak_memory) > settings_.resident_limit)
            result_.over_memory = true;
        if (WIFEXITED(status)) result_.exit_code = WEXITSTATUS(status);
        if (WIFSIGNALED(status)) result_.signal = WTERMSIG(status);
        return std::move(result_);
    }

private:
    [[nodiscard]] bool ended() const {
        siginfo_t information{};
        return waitid(P_PID, static_cast<id_t>(pid_), &information, WEXITED | WNOHANG | WNOWAIT) == 0 &&
               information.si_pid == pid_;
    }

    /// Reads all that is there. A closed end becomes −1, which poll() ignores.
    void drain(int& end) {
        std::array<char, 16384> buffer{};
        while (end >= 0) {
            const ssize_t got = read(end, buffer.data(), buffer.size());
            if (got < 0 && errno == EINTR) continue;
            if (got < 0 && errno == EAGAIN) return;
            if (got <= 0) {
                end = -1;
                return;
            }
            const std::string_view piece(buffer.data(), static_cast<std::size_t>(got));
            if (&end == &errors_) {
                result_.errors += piece;
                if (result_.errors.size() > 2 * kept_errors)
                    result_.errors.erase(0, result_.errors.size() - kept_errors);
            } else if (settings_.on_output) {
                allowed_ = settings_.on_output(piece);
                allowed_from_ = Clock::now();
            } else {
                result_.output += piece;
            }
            if (overdue() || result_.cancelled) return;  // a child that never stops writing must not hold us here
        }
    }

    [[nodiscard]] bool overdue() const { return seconds_since(allowed_from_) > allowed_; }

    /// Bytes resident in a process now; 0 if that cannot be read.
    [[nodiscard]] static std::uint64_t resident(pid_t process) {
        std::ifstream file("/proc/" + std::to_string(process) + "/statm");
        std::uint64_t size = 0, pages = 0;
        return file >> size >> pages ? pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
    }

    /// Bytes resident in the largest process that the limit holds for.
    [[nodiscard]] std::uint64_t resident() const {
        std::uint64_t largest = resident(pid_);
        if (settings_.is_launcher)
            for (const pid_t process : descendants_of(pid_)) largest = std::max(largest, resident(process));
        return largest;
    }

    void kill_all() const {
        const std::vector<pid_t> started = settings_.is_launcher ? descendants_of(pid_) : std::vector<pid_t>();
        kill(-pid_, SIGKILL);
        for (const pid_t process : started) kill(process, SIGKILL);
    }

    void enforce() {
        if (!result_.cancelled && settings_.cancelled && settings_.cancelled()) {
            result_.cancelled = true;
            cancelled_at_ = Clock::now();
            kill(-pid_, SIGINT);
        }
        const bool patience_gone = result_.cancelled && seconds_since(cancelled_at_) > settings_.cancel_grace;
        const bool too_large = settings_.resident_limit > 0 && resident() > settings_.resident_limit;
        if (killed_ || !(patience_gone || too_large || overdue())) return;
        result_.over_memory = too_large;
        result_.timed_out = !result_.cancelled && !too_large;
        killed_ = true;
        kill_all();
    }

    const ChildSettings& settings_;
    pid_t pid_;
    int output_, errors_;
    double allowed_;
    bool killed_ = false;
    Clock::time_point begin_ = Clock::now(), allowed_from_ = begin_, cancelled_at_;
    ChildResult result_;
};

}  // namespace

ChildResult run_child(const ChildSettings& settings) {
    Descriptor input;
    Pipe output, errors, trouble;
    open_input(input, settings);
    output.open(settings);
    errors.open(settings);
    trouble.open(settings);

    std::vector<std::string> texts = {settings.program.string()};
    texts.insert(texts.end(), settings.arguments.begin(), settings.arguments.end());
    std::vector<std::string> variables = environment_of(settings);
    const auto arguments = pointers_to(texts);
    const auto environment = pointers_to(variables);

    const pid_t parent = getpid();
    const pid_t pid = fork();
    if (pid < 0) fail(settings, errno);
    if (pid == 0)
        become(settings, arguments.data(), environment.data(), input.get(), output.write_end.get(),
               errors.write_end.get(), trouble.write_end.get(), parent);
    setpgid(pid, pid);  // also here: whichever side comes first
    output.write_end.reset();
    errors.write_end.reset();
    trouble.write_end.reset();

    int cause = 0;
    ssize_t got = -1;
    while ((got = read(trouble.read_end.get(), &cause, sizeof cause)) < 0 && errno == EINTR) {
    }
    if (got == sizeof cause) {
        waitpid(pid, nullptr, 0);
        fail(settings, cause);
    }
    return Watch(settings, pid, output.read_end.get(), errors.read_end.get()).run();
}

std::uint64_t bytes_of_mebibytes(double mebibytes) {
    const double bytes = mebibytes * 1024.0 * 1024.0;
    constexpr double end = 18446744073709551616.0;  // 2⁶⁴
    if (!(bytes > 0.0)) return 0;
    return bytes < end ? static_cast<std::uint64_t>(bytes) : std::numeric_limits<std::uint64_t>::max();
}

std::vector<int> allowed_cores() {
    cpu_set_t set;
    CPU_ZERO(&set);
    std::vector<int> cores;
    if (sched_getaffinity(0, sizeof set, &set) != 0) return cores;
    for (int core = 0; core < CPU_SETSIZE; ++core)
        if (CPU_ISSET(static_cast<std::size_t>(core), &set)) cores.push_back(core);
    return cores;
}

std::string signal_name(int signal_number) {
    const char* name = sigabbrev_np(signal_number);
    const char* meaning = sigdescr_np(signal_number);
    if (!name || !meaning) return "signal " + std::to_string(signal_number);
    return std::string("SIG") + name + " (" + meaning + ")";
}

std::filesystem::path own_program() {
    return std::filesystem::read_symlink("/proc/self/exe");
}

}  // namespace delassus
