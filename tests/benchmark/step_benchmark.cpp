// SPDX-License-Identifier: BSD-3-Clause
// What a step costs outside the solver (collision, assembly, preparing and judging the problem) in piles of spheres, in
// seconds a contact (s_per_contact) and against twenty projected Gauss–Seidel sweeps over the same problem
// (of_20_sweeps): the first is to stay level from 100 to 20 000 spheres, the second below 1.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>

#include "delassus/multibody.hpp"
#include "delassus/timestepper.hpp"

namespace {

using namespace delassus;

constexpr double h = 1e-3;

/// Spheres of radius 1 on a loose cubic grid over a plane, each touching its neighbours within the envelope.
void add_pile(MultibodySystem& system, std::int32_t count) {
    const auto stone = system.add_material({0.5, 0.0});
    Shape plane;
    plane.kind = ShapeKind::Plane;
    system.add_shape(plane, stone);
    const auto side = static_cast<std::int32_t>(std::ceil(std::cbrt(count)));
    for (std::int32_t i = 0; i < count; ++i) {
        BodyParameters body;
        body.name = "sphere " + std::to_string(i);
        body.inertia = Inertia::sphere(1.0, 1.0);
        body.pose.position = {2.01 * (i % side), 2.01 * (i / side % side), 1.0 + 2.01 * (i / side / side)};
        Shape sphere;
        sphere.size[0] = 1.0;
        sphere.body = system.add_body(body);
        system.add_shape(sphere, stone);
    }
    system.set_envelope(0.05);
    system.finish();
}

SolverConfig sweeps(int count) {
    SolverConfig config;
    config.name = "pgs";
    config.options = {{"check_every", std::to_string(count)}};
    config.max_iterations = count;
    config.tolerance = 1e-300;
    return config;
}

void step_outside_the_solver(benchmark::State& state) {
    MultibodySystem system;
    add_pile(system, static_cast<std::int32_t>(state.range(0)));
    const Registry registry;
    StepSolver solver(registry, sweeps(1));
    Problem problem;
    solver.watch([&](const Problem& seen) { problem = seen; });
    const auto stepper = make_timestepper("euler_implicit_linearized", system);
    State now = system.initial_state();
    for (int k = 0; k < 3; ++k) stepper->step(now, h, solver);
    solver.watch(nullptr);

    double least = HUGE_VAL, contacts = 0.0;
    for (auto _ : state) {
        solver.reset_effort();
        const auto begin = std::chrono::steady_clock::now();
        const auto report = stepper->step(now, h, solver);
        const std::chrono::duration<double> all = std::chrono::steady_clock::now() - begin;
        const double outside = all.count() - solver.effort().seconds;
        contacts = report.unilateral_blocks;
        least = std::min(least, outside);
        state.SetIterationTime(outside);
    }

    const PreparedProblem prepared(problem);
    Solver pgs = make_solver(registry, sweeps(20));
    double sweeping = HUGE_VAL;
    for (int k = 0; k < 5; ++k) {
        Solution solution;
        sweeping = std::min(sweeping, pgs.solve(prepared, solution, sweeps(20).settings()).seconds_solve);
    }
    state.counters["contacts"] = contacts;
    state.counters["s_per_contact"] = least / contacts;
    state.counters["of_20_sweeps"] = least / sweeping;
}

}  // namespace

BENCHMARK(step_outside_the_solver)
    ->Arg(100)
    ->Arg(1000)
    ->Arg(5000)
    ->Arg(20000)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
