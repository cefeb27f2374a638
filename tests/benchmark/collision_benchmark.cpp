// SPDX-License-Identifier: BSD-3-Clause
// One detection in a pile of shapes that all move a little from call to call. `s_per_contact` of spheres is to stay the
// same from 100 to 20 000 of them, and that of hulls is to grow more slowly than the number of their vertices.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "delassus/collision.hpp"

namespace {

/// Shapes on a loose cubic grid over a plane, each touching its neighbours within the envelope; those that are no
/// spheres are turned at random.
void pile(benchmark::State& state, delassus::Shape shape, std::int32_t count) {
    const auto side = static_cast<std::int32_t>(std::ceil(std::cbrt(count)));
    delassus::CollisionSetup setup;
    std::mt19937 engine(1);
    std::normal_distribution<double> normal;
    std::vector<delassus::Pose> rest(static_cast<std::size_t>(count)), poses;
    for (std::int32_t i = 0; i < count; ++i) {
        shape.body = i;
        setup.shapes.push_back(shape);
        delassus::Pose& pose = rest[static_cast<std::size_t>(i)];
        const std::int32_t row = i / side, layer = row / side;
        pose.position = {2.01 * (i % side), 2.01 * (row % side), 1.0 + 2.01 * layer};
        if (shape.kind == delassus::ShapeKind::Sphere) continue;
        for (double& part : pose.orientation) part = normal(engine);  // the detector makes unit quaternions of them
    }
    setup.fixed.assign(static_cast<std::size_t>(count), false);
    delassus::Shape plane;
    plane.kind = delassus::ShapeKind::Plane;
    setup.shapes.push_back(plane);
    const auto detector = delassus::make_collision_detector(std::move(setup));
    poses = rest;
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

void sphere_pile(benchmark::State& state) {
    delassus::Shape sphere;
    sphere.size[0] = 1.0;
    pile(state, sphere, static_cast<std::int32_t>(state.range(0)));
}

/// As wide as high, so that all turned ways touch some neighbours.
void cylinder_pile(benchmark::State& state) {
    delassus::Shape cylinder;
    cylinder.kind = delassus::ShapeKind::Cylinder;
    cylinder.size = {1.0, 1.0, 0.0};
    pile(state, cylinder, static_cast<std::int32_t>(state.range(0)));
}

/// 100 hulls of so many vertices and two more, on circles of latitude of the unit sphere.
void hull_pile(benchmark::State& state) {
    const auto sectors = static_cast<std::int32_t>(std::lround(std::sqrt(2.0 * static_cast<double>(state.range(0)))));
    const std::int32_t rings = static_cast<std::int32_t>(state.range(0)) / sectors;
    auto mesh = std::make_shared<delassus::Mesh>();
    for (std::int32_t i = 0; i < rings; ++i)
        for (std::int32_t j = 0; j < sectors; ++j) {
            const double polar = std::numbers::pi * (i + 1) / (rings + 1), turn = 2.0 * std::numbers::pi * j / sectors;
            mesh->vertices.push_back(
                {std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)});
        }
    const std::int32_t north = rings * sectors, south = north + 1;
    mesh->vertices.push_back({0.0, 0.0, 1.0});
    mesh->vertices.push_back({0.0, 0.0, -1.0});
    for (std::int32_t j = 0; j < sectors; ++j) {
        const std::int32_t next = (j + 1) % sectors, last = (rings - 1) * sectors;
        mesh->triangles.push_back({north, j, next});
        mesh->triangles.push_back({south, last + next, last + j});
        for (std::int32_t i = 0; i + 1 < rings; ++i) {
            const std::int32_t upper = i * sectors, lower = upper + sectors;
            mesh->triangles.push_back({upper + j, lower + j, lower + next});
            mesh->triangles.push_back({upper + j, lower + next, upper + next});
        }
    }
    delassus::Shape hull;
    hull.kind = delassus::ShapeKind::Convex;
    hull.mesh = mesh;
    pile(state, hull, 100);
}

}  // namespace

BENCHMARK(sphere_pile)->Arg(100)->Arg(1000)->Arg(5000)->Arg(20000)->Unit(benchmark::kMillisecond);
BENCHMARK(cylinder_pile)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);
BENCHMARK(hull_pile)->Arg(10)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
