// SPDX-License-Identifier: BSD-3-Clause
// Bodies on a plane, for tests of contact.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>

#include "delassus/multibody.hpp"
#include "delassus/timestepper.hpp"

namespace delassus::tests {

inline constexpr double g = 9.81;

inline Quaternion about_y(double angle) {
    return {std::cos(0.5 * angle), 0.0, std::sin(0.5 * angle), 0.0};
}

class ContactTest : public testing::Test {
protected:
    void SetUp() override {
#ifndef DELASSUS_HAS_FCL
        GTEST_SKIP() << "this build has no collision";
#endif
    }

    /// A plane through the origin that falls along +x by the angle, with gravity along −z.
    void add_ground(double angle, double friction, double restitution = 0.0) {
        Shape plane;
        plane.kind = ShapeKind::Plane;
        plane.pose.orientation = about_y(angle);
        system->add_shape(plane, system->add_material({friction, restitution}));
    }

    BodyIndex add_sphere(const Vector3& position, double radius, double mass = 1.0) {
        BodyParameters body;
        body.name = "sphere";
        body.mass = mass;
        body.inertia = Inertia::sphere(mass, radius);
        body.pose.position = position;
        const auto index = system->add_body(body);
        Shape shape;
        shape.kind = ShapeKind::Sphere;
        shape.size = {radius, 0.0, 0.0};
        shape.body = index;
        system->add_shape(shape, 0);
        return index;
    }

    BodyIndex add_box(const Pose& pose, const Vector3& half, double mass = 1.0) {
        BodyParameters body;
        body.name = "box";
        body.mass = mass;
        body.inertia = Inertia::box(mass, {2.0 * half[0], 2.0 * half[1], 2.0 * half[2]});
        body.pose = pose;
        const auto index = system->add_body(body);
        Shape shape;
        shape.kind = ShapeKind::Box;
        shape.size = half;
        shape.body = index;
        system->add_shape(shape, 0);
        return index;
    }

    void start_anew() {
        system = std::make_unique<MultibodySystem>();
    }

    /// Coulomb's law, to a natural error of 1e-10.
    static SolverConfig exact_law() {
        SolverConfig config;
        config.name = "pgs";
        config.tolerance = 1e-10;
        config.law = Law::Coulomb;
        return config;
    }

    /// Runs to `end`; after each step, each(state).
    State run(double end, double h, const std::function<void(const State&)>& each = {},
              const SolverConfig& config = exact_law()) {
        StepSolver solver(registry, config);
        solver.watch([&](const Problem& problem) { last = problem; });
        const auto stepper = make_timestepper("euler_implicit_linearized", *system);
        State state = system->initial_state();
        const auto steps = std::lround(end / h);
        for (long k = 0; k < steps; ++k) {
            const auto report = stepper->step(state, h, solver);
            EXPECT_TRUE(report.solved) << report.message;
            if (each) each(state);
        }
        return state;
    }

    Registry registry;
    std::unique_ptr<MultibodySystem> system = std::make_unique<MultibodySystem>();
    Problem last;
};

}  // namespace delassus::tests
