// SPDX-License-Identifier: BSD-3-Clause
// One detection in a pile of spheres that all move a little from call to call. `s_per_contact` is to stay the same from
// 100 to 20 000 spheres.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "delassus/collision.hpp"

namespace {

/// Spheres of radius 1 on a loose cubic grid over a plane, each touching its neighbours within the envelope.
void sphere_pile(benchmark::State& state) {
    const auto count = static_cast<std::int32_t>(state.range(0));
    const auto side = static_cast<std::int32_t>(std::ceil(std::cbrt(count)));
    delassus::CollisionSetup setup;
    std::vector<delassus::Pose> rest(static_cast<std::size_t>(count)), poses;
    for (std::int32_t i = 0; i < count; ++i) {
        delassus::Shape sphere;
        sphere.size[0] = 1.0;
        sphere.body = i;
        setup.shapes.push_back(sphere);
        rest[static_cast<std::size_t>(i)].position = {2.01 * (i % side), 2.01 * (i / side % side),
                                                      1.0 + 2.01 * (i / side / side)};
    }
    setup.fixed.assign(static_cast<std::size_t>(count), false);
    delassus::Shape plane;
    plane.kind = delassus::ShapeKind::Plane;
    setup.shapes.push_back(plane);
    const auto detector = delassus::make_collision_detector(std::move(setup));
    poses = rest;
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> shake(-0.02, 0.02);
    std::vector<delassus::ContactPoint> contacts;
    detector->detect(poses, 0.05, contacts);
    double points = 0.0;
    for (auto _ : state) {
        state.PauseTiming();
        for (std::size_t i = 0; i < poses.size(); ++i) {
            for (std::size_t k = 0; k < 3; ++k) poses[i].position[k] = rest[i].position[k] + shake(engine);
        }
        state.ResumeTiming();
        detector->detect(poses, 0.05, contacts);
        points += static_cast<double>(contacts.size());
    }
    state.counters["contacts"] = points / static_cast<double>(state.iterations());
    state.counters["s_per_contact"] =
        benchmark::Counter(points, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

}  // namespace

BENCHMARK(sphere_pile)->Arg(100)->Arg(1000)->Arg(5000)->Arg(20000)->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
