// SPDX-License-Identifier: BSD-3-Clause
// The cost of one projected Gauss–Seidel sweep per contact (counter ns_per_contact, of the wall clock: the machine
// must be quiet), on velocities, after fifty sweeps so that contacts open, stick and slide as in a real solve: by the
// order of the blocks and the number of threads, on shared contact problems and on generated piles of 100 to 100 000
// contacts, over which it should stay level but for the caches.
//
// The shared problems are looked for in DELASSUS_SHARED_PROBLEMS, then beside the repository; absent ones are left out.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "delassus/generate.hpp"
#include "delassus/needs.hpp"
#include "delassus/problem_files.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/thread_team.hpp"
#include "plugins/pgs/model.hpp"
#include "support/places.hpp"

namespace {

using delassus::pgs::Local;
using delassus::pgs::Ordering;

/// One way to sweep.
struct Way {
    std::string name;
    Local local;
    Ordering ordering;
    int threads;
};

void time_sweeps(benchmark::State& state, delassus::Problem problem, const Way& way) {
    const delassus::PreparedProblem prepared(std::move(problem));
    const delassus::sdk::ProblemView view(prepared.raw());
    delassus::sdk::DelassusOperator N;
    N.analyze(view);
    N.factorize(view);
    delassus::pgs::Model model;
    model.build(view, N, true, false, way.local == Local::Exact, way.ordering);
    model.set_right_hand_side(view, N, delassus::sdk::block_scaling(view.cones, N.diagonal()));
    delassus::pgs::SweepState sweep;
    model.state_of(delassus::sdk::Vector::Zero(view.m), sweep);
    delassus::ThreadTeam threads(way.threads);
    model.use(threads.team());
    delassus::pgs::SweepRule rule;
    rule.local = way.local;
    rule.omega = 1.5;
    rule.coulomb = view.coulomb;
    for (int k = 0; k < 50; ++k) model.sweep_in_place(rule, sweep);

    for (auto _ : state) {
        model.sweep_in_place(rule, sweep);
        benchmark::ClobberMemory();
    }
    const auto contacts = static_cast<double>(view.cones.size());
    state.counters["contacts"] = contacts;
    // An inverted rate in units of 1e9 contacts is nanoseconds per contact.
    state.counters["ns_per_contact"] = benchmark::Counter(contacts * 1e-9 * static_cast<double>(state.iterations()),
                                                          benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

std::filesystem::path shared_problems() {
    const char* chosen = std::getenv("DELASSUS_SHARED_PROBLEMS");
    return chosen != nullptr ? chosen : delassus::tests::places::shared_problems;
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<Way> ways = {{"diagonal/given", Local::Diagonal, Ordering::Given, 1},
                                   {"diagonal/spaced", Local::Diagonal, Ordering::Spaced, 1},
                                   {"diagonal/coloured", Local::Diagonal, Ordering::Coloured, 1},
                                   {"diagonal/coloured-2", Local::Diagonal, Ordering::Coloured, 2},
                                   {"diagonal/domains", Local::Diagonal, Ordering::Domains, 1},
                                   {"diagonal/domains-2", Local::Diagonal, Ordering::Domains, 2},
                                   {"exact/spaced", Local::Exact, Ordering::Spaced, 1},
                                   {"exact/coloured-2", Local::Exact, Ordering::Coloured, 2}};
    for (const Way& way : ways) {
        for (const char* name : {"stack-40-nc80", "pile-300-nc1421", "boxpile-200-nc744"}) {
            const auto path = shared_problems() / name;
            if (!std::filesystem::exists(path)) continue;
            benchmark::RegisterBenchmark((name + ("/" + way.name)).c_str(), [path, way](benchmark::State& state) {
                time_sweeps(state, delassus::read_problem(path), way);
            })->UseRealTime();
        }
        auto* piles = benchmark::RegisterBenchmark(("sphere_pile/" + way.name).c_str(), [way](benchmark::State& state) {
            delassus::SpherePileParameters parameters;
            parameters.contacts = static_cast<std::int32_t>(state.range(0));
            time_sweeps(state, delassus::generate_sphere_pile(parameters), way);
        });
        piles->UseRealTime();
        for (const int contacts : {100, 1000, 10000, 100000}) piles->Arg(contacts);
    }
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
