// SPDX-License-Identifier: BSD-3-Clause
// Iterations of pgs and apgd against the memory's bandwidth, on generated piles: counter of_stream is the time that the
// bytes that an iteration must move would take at the speed of reading an array of as many bytes, over the time that it
// takes. Both through the plugin border, with everything that an iteration does.
//
// The bytes. A contact of two bodies has 3 × 12 coefficients of Ŵ = P D L⁻ᵀ, two chunks of columns and a header. A
// sweep of pgs reads them once (the second use finds them in the cache), with b, λ (read and written) and its local
// problem, and each body's velocities once (read and written). An iteration of apgd reads them twice, in Ŵᵀλ and Ŵ v,
// and six vectors of m. What the caches could save beyond that by chance is not counted, so of_stream may exceed 1.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "delassus/config.hpp"
#include "delassus/generate.hpp"
#include "delassus/solver.hpp"
#include "plugins/pgs/sweep.hpp"

namespace {

using Clock = std::chrono::steady_clock;

/// Bytes per second of reading an array of that size over and over; the best of a second.
double stream(double bytes) {
    std::vector<double> values(static_cast<std::size_t>(bytes / sizeof(double)), 1.0);
    const double* data = values.data();
    const std::size_t count = values.size() / 8 * 8;
    double best = std::numeric_limits<double>::infinity();
    const auto begin = Clock::now();
    while (Clock::now() - begin < std::chrono::seconds(1)) {
        const auto start = Clock::now();
        double sum[8] = {};  // independent, so that additions do not wait for one another
        for (std::size_t i = 0; i < count; i += 8)
            for (std::size_t k = 0; k < 8; ++k) sum[k] += data[i + k];
        benchmark::DoNotOptimize(std::accumulate(sum, sum + 8, 0.0));
        best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
    }
    return static_cast<double>(count * sizeof(double)) / best;
}

double bytes_of_iteration(const delassus::Problem& problem, bool sweeps) {
    const double contacts = static_cast<double>(problem.cones.size()), m = problem.m(), n = problem.n();
    const double coefficients = static_cast<double>(problem.D.entries()) * sizeof(double);
    const double chunks = static_cast<double>(problem.D.entries()) / 18.0 * sizeof(std::int32_t);
    const double headers = contacts * sizeof(delassus::sdk::BlockRows::Group);
    if (sweeps)
        return coefficients + chunks + headers + contacts * sizeof(delassus::pgs::LocalBlock) +
               sizeof(double) * (3.0 * m + 2.0 * n);
    return 2.0 * (coefficients + chunks + headers) + sizeof(double) * (6.0 * m + 2.0 * n);
}

void iterations(benchmark::State& state, const std::string& name) {
    delassus::SpherePileParameters parameters;
    parameters.contacts = static_cast<std::int32_t>(state.range(0));
    const delassus::PreparedProblem problem(delassus::generate_sphere_pile(parameters));
    const double bytes = bytes_of_iteration(problem.problem(), name == "pgs");
    const double speed = stream(bytes);

    const delassus::Registry registry;
    delassus::Solver solver = delassus::make_solver(registry, delassus::parse_solver(name));
    delassus::SolveSettings settings;
    settings.tolerance = 1e-300;
    settings.max_iterations = std::max<std::int64_t>(600, 6'000'000 / state.range(0));
    double best = std::numeric_limits<double>::infinity();
    for (auto _ : state) {
        delassus::Solution solution;
        const auto report = solver.solve(problem, solution, settings);
        const double seconds = report.seconds_solve / static_cast<double>(report.iterations);
        state.SetIterationTime(seconds);
        best = std::min(best, seconds);
    }
    const auto contacts = static_cast<double>(problem.problem().cones.size());
    state.counters["contacts"] = contacts;
    state.counters["ns_per_contact"] = 1e9 * best / contacts;
    state.counters["bytes_per_contact"] = bytes / contacts;
    state.counters["stream_GB_per_s"] = 1e-9 * speed;
    state.counters["of_stream"] = bytes / speed / best;
}

}  // namespace

int main(int argc, char** argv) {
    for (const std::string name : {"pgs", "apgd"}) {
        auto* piles =
            benchmark::RegisterBenchmark(name.c_str(), [name](benchmark::State& state) { iterations(state, name); });
        piles->UseManualTime()->Iterations(3);
        for (const int contacts : {1000, 10000, 30000, 100000}) piles->Arg(contacts);
    }
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
