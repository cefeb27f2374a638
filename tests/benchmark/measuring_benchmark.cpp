// SPDX-License-Identifier: BSD-3-Clause
// What measuring costs the measured: solve seconds by the solver's own clock with the natural error taken at every
// iterate (counter samples tells how many), over those with none taken (counter ratio, least of the runs of each, taken
// in turns). Near 1: the clock stands still while the host measures; what remains is the caches that measuring empties.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <limits>

#include "delassus/config.hpp"
#include "delassus/generate.hpp"
#include "delassus/needs.hpp"

namespace {

using namespace delassus;

/// Curve samples are 2 % apart in time: of so few iterations, each is longer than 2 % of what went before.
constexpr std::int64_t iterations = 40;

double seconds(const Registry& registry, const SolverConfig& config, const PreparedProblem& problem, bool measured,
               std::size_t& samples) {
    Solver solver = make_solver(registry, config);
    SolveSettings settings;
    settings.tolerance = 1e-15;
    settings.max_iterations = iterations;
    settings.record_curve = measured;
    Solution solution;
    const SolveReport report = solver.solve(problem, solution, settings);
    samples = report.curve.size();
    return report.seconds_solve;
}

void measuring(benchmark::State& state, const char* solver) {
    SpherePileParameters parameters;
    parameters.contacts = static_cast<std::int32_t>(state.range(0));
    const PreparedProblem problem(generate_sphere_pile(parameters));
    const Registry registry;
    const SolverConfig config = parse_solver(solver);
    double with = std::numeric_limits<double>::infinity(), without = with;
    std::size_t samples = 0, none = 0;
    for (auto _ : state) {
        without = std::min(without, seconds(registry, config, problem, false, none));
        with = std::min(with, seconds(registry, config, problem, true, samples));
    }
    state.counters["ratio"] = with / without;
    state.counters["samples"] = static_cast<double>(samples);
    state.counters["solve_ms"] = 1e3 * without;
}

}  // namespace

BENCHMARK_CAPTURE(measuring, pgs, "pgs")->Arg(1000)->Arg(10000)->Iterations(7);
BENCHMARK_CAPTURE(measuring, apgd, "apgd")->Arg(1000)->Arg(10000)->Iterations(7);
BENCHMARK_CAPTURE(measuring, spg, "spg")->Arg(1000)->Arg(10000)->Iterations(7);

BENCHMARK_MAIN();
