// SPDX-License-Identifier: BSD-3-Clause
// Wall time of the command from start to the first iteration on a small problem, against that of an empty program. The
// counter `ms_above_empty` is the difference, `ratio` the quotient; both of the medians in this run.
#include <benchmark/benchmark.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>
#include "support/places.hpp"

extern char** environ;

namespace {

double seconds_of(std::vector<std::string> arguments) {
    std::vector<char*> raw;
    for (auto& argument : arguments) raw.push_back(argument.data());
    raw.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", 1, 0);
    const auto begin = std::chrono::steady_clock::now();
    pid_t child = 0;
    int status = 0;
    if (posix_spawn(&child, raw[0], &actions, nullptr, raw.data(), environ) == 0) waitpid(child, &status, 0);
    posix_spawn_file_actions_destroy(&actions);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

void start_up(benchmark::State& state, const std::string& solver) {
    std::vector<double> empty, command;
    for (auto _ : state) {
        empty.push_back(seconds_of({"/bin/true"}));
        command.push_back(seconds_of({delassus::tests::places::command, "solve",
                                      std::string(delassus::tests::places::source) + "/examples/problems/glued_pile",
                                      "--solver", solver, "--max-iterations", "1", "--json"}));
        state.SetIterationTime(command.back());
    }
    state.counters["ms_above_empty"] = 1e3 * (median(command) - median(empty));
    state.counters["ratio"] = median(command) / median(empty);
}

}  // namespace

BENCHMARK_CAPTURE(start_up, apgd, "apgd")->UseManualTime()->Iterations(30)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(start_up, pgs, "pgs")->UseManualTime()->Iterations(30)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(start_up, cholmod, "cholmod")->UseManualTime()->Iterations(30)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(start_up, mumps, "mumps")->UseManualTime()->Iterations(10)->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
