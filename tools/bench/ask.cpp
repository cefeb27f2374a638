// SPDX-License-Identifier: BSD-3-Clause
#include "bench/ask.hpp"

#include <fmt/format.h>

#include <string_view>

#include "bench/event_lines.hpp"
#include "delassus/error.hpp"

namespace delassus::bench {

namespace {

constexpr std::string_view own_words = "delassus: ";

/// Whether these are the last words of a worker, or one of several, that had no memory left to answer
/// (process/out_of_memory.hpp, on_all_processes.hpp).
bool had_no_memory(std::string_view line) {
    return line.starts_with("delassus: out of memory") ||
           (line.starts_with(own_words) && line.ends_with("out of memory"));
}

}  // namespace

ChildResult ask(const WorkerSettings& worker, const Json& request, const std::function<double(const Json&)>& hear,
                int processes) {
    double allowed = loading_limit;
    EventLines lines([&](const Json& line) { allowed = hear(line); });
    ChildSettings child;
    child.program = worker.command;
    child.arguments = {"worker"};
    child.input = json_text(request);
    // One core, one thread: the libraries behind some plugins would otherwise start threads that share that core.
    child.environment = {{"OMP_NUM_THREADS", "1"}, {"OPENBLAS_NUM_THREADS", "1"}, {"MKL_NUM_THREADS", "1"}};
    if (processes > 1) {
        // The workers choose their cores themselves.
        child.is_launcher = true;
        child.program = worker.launcher;
        child.arguments = {"-n",   std::to_string(processes), "--oversubscribe", "--bind-to",
                           "none", worker.command.string(),   "worker"};
        // Open MPI 4 explains at length how its processes ended. It has an option --quiet, which Open MPI 5 refuses.
        child.environment.emplace_back("OMPI_MCA_orte_execute_quiet", "1");
    } else if (const auto cores = allowed_cores(); !cores.empty()) {
        child.core = cores.back();
    }
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

void ask_for_facts(const WorkerSettings& worker, const Json& request, const std::string& what,
                   const std::function<void(const std::string& event, const Json& line)>& hear, int processes) {
    std::string failure;
    bool done = false;
    const auto listen = [&](const Json& line) {
        const std::string event = line.at("event");
        if (event == "failed") {
            failure = line.at("message");
        } else {
            hear(event, line);
        }
        done = done || event == "done";
        return loading_limit;
    };
    const auto child = ask(worker, request, listen, processes);
    if (!failure.empty()) throw InputError(failure);
    if (child.cancelled) throw Error("interrupted while reading " + what);
    if (done) return;
    const auto line = last_line(child.errors);
    throw InputError(
        fmt::format("{} could not be read: the process that read it ended{}", what, line.empty() ? "" : ": " + line));
}

void judge_end(std::string& status, std::string& message, const ChildResult& child, const WorkerSettings& worker,
               double time_limit, bool done, const std::string& reached) {
    const bool complete = !status.empty() && done;
    const std::string where = reached.empty() ? "" : " " + reached;
    std::string ended, sentence;
    if (child.over_memory) {
        ended = "memory";
        sentence = fmt::format("took more than its {} MiB{}; killed", worker.resident_limit >> 20, where);
    } else if (child.timed_out) {
        ended = "hung";
        sentence = complete ? "did not end after its last run and was killed"
                            : fmt::format("did not react for {:.3g} s (time limit and grace){}; killed",
                                          time_limit + grace_of(time_limit), where);
    } else if (child.cancelled) {
        if (!status.empty()) return;
        ended = "cancelled";
        sentence = "interrupted" + where;
    } else if (const auto line = last_line(child.errors); !done && child.signal == 0 && had_no_memory(line)) {
        ended = "memory";
        sentence = line.substr(own_words.size()) + where;
    } else if (child.signal != 0 || !done) {
        ended = "crashed";
        sentence =
            (child.signal != 0 ? signal_name(child.signal)
                               : fmt::format("left its process with exit code {}", child.exit_code.value_or(0))) +
            (done ? " when its process ended" : where);
        if (!line.empty()) sentence += ": " + line;
    } else {
        return;
    }
    append(message, sentence);
    // A complete result keeps its status, and its message tells what happened afterwards.
    if (!complete || child.over_memory) status = ended;
}

std::string status_of_failure(const std::string& kind) {
    return kind == "memory" || kind == "input" ? kind : "error";
}

std::string last_line(std::string text) {
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    // A launcher has more to say after it.
    auto own = text.rfind("\n" + std::string(own_words));
    if (own == std::string::npos && text.starts_with(own_words)) own = 0;
    const auto begin = own == std::string::npos ? text.find_last_of('\n') : own;
    std::string line = begin == std::string::npos ? text : text.substr(begin + (text[begin] == '\n' ? 1 : 0));
    if (own != std::string::npos) line = line.substr(0, line.find('\n'));
    return line.size() > 300 ? line.substr(0, 300) : line;
}

void hear_builds(const Json& line, const WorkerSettings& worker, std::string& message) {
    for (const auto& plugin : line.at("unoptimized").get<std::vector<std::string>>()) {
        append(message, fmt::format("{} was {}", plugin, unoptimized_build));
        if (worker.unoptimized) worker.unoptimized(plugin);
    }
}

void append(std::string& message, const std::string& sentence) {
    if (!message.empty()) message += "; ";
    message += sentence;
}

}  // namespace delassus::bench
