// SPDX-License-Identifier: BSD-3-Clause
#include "support/trace.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>

#include "delassus/distributed.hpp"
#include "support/json.hpp"

namespace delassus {

namespace {

/// The first line. What begins otherwise is somebody else's file. A viewer wants no bracket at the end, so that several
/// processes can write one file, and what is killed leaves a trace that can be read.
constexpr std::string_view head = R"([{"ph":"M","name":"trace","pid":0,"args":{"by":"written by delassus"}},)";

/// Names the trace that a process has begun, for the processes that it starts: they add to it.
constexpr const char* begun_variable = "DELASSUS_TRACE_BEGUN";

/// -1 where nothing is traced.
int open_trace() {
    const char* chosen = std::getenv("DELASSUS_TRACE");
    if (!chosen || !*chosen) return -1;
    std::error_code error;
    std::string file = std::filesystem::absolute(chosen, error).string();
    if (process_count() > 1) file += fmt::format(".{}", process_rank());
    const char* begun = std::getenv(begun_variable);
    const bool goes_on = begun && file == begun;
    const auto refuse = [&](const std::string& why) {
        std::fputs(fmt::format("delassus: the trace {} is not written: {}\n", file, why).c_str(), stderr);
        return -1;
    };
    if (!goes_on && std::filesystem::exists(file, error)) {
        std::string line;
        if (!std::filesystem::is_regular_file(file, error) || !std::getline(std::ifstream(file), line) || line != head)
            return refuse("the file exists, and delassus did not write it");
    }
    const int trace = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | (goes_on ? 0 : O_TRUNC), 0666);
    if (trace < 0) return refuse(std::strerror(errno));
    if (goes_on) return trace;
    setenv(begun_variable, file.c_str(), 1);
    const std::string line = std::string(head) + '\n';
    if (write(trace, line.data(), line.size()) < 0) return refuse(std::strerror(errno));
    return trace;
}

int trace_file() {
    static const int file = open_trace();
    return file;
}

std::string json_of(std::string_view text) {
    return json_text(nlohmann::ordered_json(text));
}

double microseconds(std::chrono::steady_clock::duration duration) {
    return std::chrono::duration<double, std::micro>(duration).count();
}

}  // namespace

bool is_traced() {
    return trace_file() >= 0;
}

void TraceSpan::begin(std::string_view kind, std::string_view name) {
    on_ = true;
    kind_ = kind;
    name_ = name;
    begin_ = std::chrono::steady_clock::now();
}

void TraceSpan::add(std::string_view key, double value) {
    if (std::isfinite(value)) said_ += fmt::format("{}{}:{}", said_.empty() ? "" : ",", json_of(key), value);
}

void TraceSpan::add(std::string_view key, std::string_view value) {
    said_ += fmt::format("{}{}:{}", said_.empty() ? "" : ",", json_of(key), json_of(value));
}

void TraceSpan::end() noexcept {
    const auto now = std::chrono::steady_clock::now();
    try {
        const std::string line =
            fmt::format(R"({{"ph":"X","cat":{},"name":{},"ts":{:.3f},"dur":{:.3f},"pid":{},"tid":{},"args":{{{}}}}},)"
                        "\n",
                        json_of(kind_), json_of(name_), microseconds(begin_.time_since_epoch()),
                        microseconds(now - begin_), getpid(), syscall(SYS_gettid), said_);
        // One write a line: what other threads and processes write stands before or behind it.
        if (write(trace_file(), line.data(), line.size()) < 0) return;
    } catch (const std::exception&) {  // a span less
    }
}

}  // namespace delassus
