// SPDX-License-Identifier: BSD-3-Clause
// What a solve costs a program beside the work of the solver: 12 and 1002 rows of contacts in a tower, with a solver
// that is kept and with one that is made for each solve (counter least_us, the least of the runs).
// scripts/measure-python does the same from Python, and runs this.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "delassus/config.hpp"
#include "delassus/needs.hpp"
#include "delassus/problem.hpp"

namespace {

using namespace delassus;

/// Bodies of mass 1 on top of one another, each touching the one below; three velocities and three rows each.
PreparedProblem tower(std::int32_t bodies) {
    const std::int32_t n = 3 * bodies;
    std::vector<Triplet> mass, gaps;
    Problem problem;
    for (std::int32_t i = 0; i < n; ++i) {
        mass.push_back({i, i, 1.0});
        gaps.push_back({i, i, 1.0});
        if (i >= 3) gaps.push_back({i, i - 3, -1.0});
        problem.a.push_back(i % 3 == 0 ? -0.1 : 0.01 * std::sin(static_cast<double>(i)));
    }
    problem.H = SparseMatrix::from_triplets(n, n, std::move(mass));
    problem.D = SparseMatrix::from_triplets(n, n, std::move(gaps));
    problem.b.assign(static_cast<std::size_t>(n), 0.0);
    problem.cones.assign(static_cast<std::size_t>(bodies), Cone::friction(0.5));
    return PreparedProblem(std::move(problem));
}

void small_solve(benchmark::State& state, const char* name, bool kept) {
    using Clock = std::chrono::steady_clock;
    const PreparedProblem problem = tower(static_cast<std::int32_t>(state.range(0)));
    const Registry registry;
    const SolverConfig config = parse_solver(name);
    Solver solver = make_solver(registry, config);
    SolveSettings settings;
    settings.tolerance = 1e-6;
    settings.max_iterations = 100;
    double least = std::numeric_limits<double>::infinity(), own = least;
    for (auto _ : state) {
        const auto begin = Clock::now();
        if (!kept) solver = make_solver(registry, config);
        Solution solution;
        const SolveReport report = solver.solve(problem, solution, settings);
        const std::chrono::duration<double, std::micro> taken = Clock::now() - begin;
        least = std::min(least, taken.count());
        own = std::min(own, 1e6 * (report.seconds_setup + report.seconds_solve));
    }
    state.counters["least_us"] = least;
    state.counters["solver_us"] = own;
}

}  // namespace

BENCHMARK_CAPTURE(small_solve, pgs_kept, "pgs", true)->Arg(4)->Arg(334);
BENCHMARK_CAPTURE(small_solve, pgs_made, "pgs", false)->Arg(4)->Arg(334);
BENCHMARK_CAPTURE(small_solve, ssn_kept, "ssn", true)->Arg(4)->Arg(334);
BENCHMARK_CAPTURE(small_solve, ssn_made, "ssn", false)->Arg(4)->Arg(334);

BENCHMARK_MAIN();
