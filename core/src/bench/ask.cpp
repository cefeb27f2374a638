// SPDX-License-Identifier: BSD-3-Clause
#include "bench/ask.hpp"

#include <string_view>

namespace delassus::bench {

namespace {

/// Cuts the output into lines of JSON.
class Lines {
public:
    explicit Lines(std::function<void(const Json&)> on_line) : on_line_(std::move(on_line)) {}

    void add(std::string_view piece) {
        rest_ += piece;
        std::size_t begin = 0;
        for (std::size_t end; (end = rest_.find('\n', begin)) != std::string::npos; begin = end + 1) {
            const Json line = Json::parse(rest_.substr(begin, end - begin), nullptr, false);
            // Anything else comes from a plugin that found our channel: the row must not depend on it.
            if (line.is_object() && line.contains("event")) on_line_(line);
        }
        rest_.erase(0, begin);
    }

private:
    std::function<void(const Json&)> on_line_;
    std::string rest_;
};

}  // namespace

ChildResult ask(const WorkerSettings& worker, const Json& request, const std::function<double(const Json&)>& hear) {
    double allowed = loading_limit;
    Lines lines([&](const Json& line) { allowed = hear(line); });
    ChildSettings child;
    child.program = worker.command;
    child.arguments = {"worker"};
    child.input = text_of(request);
    // One core, one thread: the libraries behind some plugins would otherwise start threads that share that core.
    child.environment = {{"OMP_NUM_THREADS", "1"}, {"OPENBLAS_NUM_THREADS", "1"}, {"MKL_NUM_THREADS", "1"}};
    const auto cores = allowed_cores();
    if (!cores.empty()) child.core = cores.back();
    child.timeout = allowed;
    child.memory_limit = worker.memory_limit;
    child.resident_limit = worker.resident_limit;
    child.cancelled = worker.cancelled;
    child.on_output = [&](std::string_view piece) {
        lines.add(piece);
        return allowed;
    };
    return run_child(child);
}

std::string status_of_failure(const std::string& kind) {
    return kind == "memory" || kind == "input" ? kind : "error";
}

std::string last_line(std::string text) {
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    const auto begin = text.find_last_of('\n');
    std::string line = begin == std::string::npos ? text : text.substr(begin + 1);
    return line.size() > 300 ? line.substr(0, 300) : line;
}

void append(std::string& message, const std::string& sentence) {
    if (!message.empty()) message += "; ";
    message += sentence;
}

}  // namespace delassus::bench
