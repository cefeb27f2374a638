// SPDX-License-Identifier: BSD-3-Clause
// The cost of one projected Gauss–Seidel sweep per contact (counter ns_per_contact, of CPU time), on velocities, after
// fifty sweeps so that contacts open, stick and slide as in a real solve: on shared contact problems, and on generated
// piles of 100 to 100 000 contacts, over which it should stay level but for the caches.
//
// The shared problems are looked for in DELASSUS_SHARED_PROBLEMS, then beside the repository; absent ones are left out.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>

#include "delassus/generate.hpp"
#include "delassus/needs.hpp"
#include "delassus/problem_files.hpp"
#include "plugins/pgs/model.hpp"

namespace {

using delassus::pgs::Local;

void time_sweeps(benchmark::State& state, delassus::Problem problem, Local local) {
    const delassus::PreparedProblem prepared(std::move(problem));
    const delassus::sdk::ProblemView view(prepared.raw());
    delassus::sdk::DelassusOperator N;
    N.analyze(view);
    N.factorize(view);
    delassus::pgs::Model model;
    model.build(view, N, true, false);
    model.set_right_hand_side(view, N);
    delassus::sdk::Vector lambda = delassus::sdk::Vector::Zero(view.m), z;
    model.state_of(lambda, z);
    delassus::pgs::SweepRule rule;
    rule.local = local;
    rule.omega = 1.5;
    rule.coulomb = view.coulomb;
    for (int k = 0; k < 50; ++k) model.sweep_in_place(rule, z, lambda);

    for (auto _ : state) {
        model.sweep_in_place(rule, z, lambda);
        benchmark::ClobberMemory();
    }
    const auto contacts = static_cast<double>(view.cones.size());
    state.counters["contacts"] = contacts;
    // An inverted rate in units of 1e9 contacts is nanoseconds per contact.
    state.counters["ns_per_contact"] = benchmark::Counter(contacts * 1e-9 * static_cast<double>(state.iterations()),
                                                          benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void shared(benchmark::State& state, const std::filesystem::path& path, Local local) {
    time_sweeps(state, delassus::read_problem(path), local);
}

void pile(benchmark::State& state, Local local) {
    delassus::SpherePileParameters parameters;
    parameters.contacts = static_cast<std::int32_t>(state.range(0));
    time_sweeps(state, delassus::generate_sphere_pile(parameters), local);
}

std::filesystem::path shared_problems() {
    const char* chosen = std::getenv("DELASSUS_SHARED_PROBLEMS");
    return chosen != nullptr ? chosen : DELASSUS_SHARED_PROBLEMS_DEFAULT;
}

}  // namespace

int main(int argc, char** argv) {
    for (const Local local : {Local::Diagonal, Local::Exact}) {
        const std::string suffix = local == Local::Diagonal ? "/diagonal" : "/exact";
        for (const char* name : {"stack-40-nc80", "pile-300-nc1421", "boxpile-200-nc744"}) {
            const auto path = shared_problems() / name;
            if (!std::filesystem::exists(path)) continue;
            benchmark::RegisterBenchmark((name + suffix).c_str(),
                                         [path, local](benchmark::State& state) { shared(state, path, local); });
        }
        auto* piles = benchmark::RegisterBenchmark(("sphere_pile" + suffix).c_str(),
                                                   [local](benchmark::State& state) { pile(state, local); });
        for (const int contacts : {100, 1000, 10000, 100000}) piles->Arg(contacts);
    }
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
