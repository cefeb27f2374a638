// SPDX-License-Identifier: BSD-3-Clause
// A step like the one before allocates nothing in the core. Counted: every malloc of the process, with a solver that
// allocates nothing itself.
#include <gtest/gtest.h>

#include <cstdlib>

#include "delassus/multibody.hpp"
#include "delassus/timestepper.hpp"
#include "support/places.hpp"

#if defined(__SANITIZE_ADDRESS__)
#define DELASSUS_COUNTS 0  // the sanitizer has a malloc of its own
#else
#define DELASSUS_COUNTS 1
extern "C" void* __libc_malloc(std::size_t size);                           // NOLINT: glibc's names
extern "C" void* __libc_realloc(void* pointer, std::size_t size);           // NOLINT
extern "C" void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT
extern "C" void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT

namespace {
bool counting = false;
long allocations = 0;
void count() {
    if (!counting) return;
    ++allocations;
    if (std::getenv("DELASSUS_ABORT_AT_ALLOCATION")) std::abort();  // for a debugger
}
}  // namespace

extern "C" void* malloc(std::size_t size) {
    count();
    return __libc_malloc(size);
}
extern "C" void* realloc(void* pointer, std::size_t size) {
    count();
    return __libc_realloc(pointer, size);
}
extern "C" void* calloc(std::size_t number, std::size_t size) {
    count();
    return __libc_calloc(number, size);
}
extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
    count();
    return __libc_memalign(alignment, size);
}
#endif

namespace delassus::steady_step_test {
namespace {

#if DELASSUS_COUNTS

std::size_t contacts = 0;  // of the last step

/// Steps often enough for every array to have its size, then counts over some steps.
long steady_allocations(MultibodySystem& system, const std::string& method, bool within_the_solver) {
    system.finish();
    const Registry registry;
    SolverConfig config;
    config.name = std::string(tests::places::plugins) + "/quiet.so";
    config.law = Law::Associated;
    config.tolerance = 1e-8;
    StepSolver solver(registry, config);
    const auto stepper = make_timestepper(method, system);
    State state = system.initial_state();
    StepReport report;
    for (int step = 0; step < 20; ++step) {
        stepper->step(state, 1e-3, solver, report);
        EXPECT_TRUE(report.solved) << method;
    }
    if (within_the_solver) solver.watch([](const Problem&) { counting = true; });
    allocations = 0;
    for (int step = 0; step < 5; ++step) {
        counting = !within_the_solver;
        stepper->step(state, 1e-3, solver, report);
        counting = false;
    }
    contacts = report.contacts.size();
    return allocations;
}

void add_chain(MultibodySystem& system, int links) {
    BodyIndex last = world_body;
    for (int k = 0; k < links; ++k) {
        BodyParameters link;
        link.name = "link " + std::to_string(k);
        link.inertia = Inertia::rod(1.0, 1.0);
        link.pose.position = {k + 0.5, 0.0, 0.0};
        const BodyIndex body = system.add_body(link);
        JointParameters joint;
        joint.kind = k % 2 == 0 ? JointKind::Revolute : JointKind::Spherical;
        joint.first = last;
        joint.second = body;
        joint.point = {static_cast<double>(k), 0.0, 0.0};
        joint.axis = {0.0, 1.0, 0.0};
        system.add_joint(joint);
        last = body;
    }
}

/// Methods whose steady steps allocate nothing.
class SteadySteps : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Methods, SteadySteps,
                         testing::Values("euler_implicit_linearized", "moreau_jean", "linearly_implicit_trapezoidal"),
                         [](const auto& chosen) { return std::string(chosen.param); });

TEST_P(SteadySteps, OfJointedBodiesAllocateNothing) {
    MultibodySystem system;
    add_chain(system, 3);
    EXPECT_EQ(steady_allocations(system, GetParam(), false), 0);
}

TEST_P(SteadySteps, OfServosAndDryJointsOnAKinematicBodyAllocateNothing) {
    MultibodySystem system;
    BodyParameters base;
    base.name = "base";
    base.motion.emplace().translation[0] = Motion::linear(0.0, 1.0);
    BodyParameters link;
    link.name = "link";
    link.inertia = Inertia::rod(1.0, 1.0);
    link.pose.position = {0.5, 0.0, 0.0};
    link.velocity = {1.0, 0.0, 0.0};
    JointParameters joint;
    joint.kind = JointKind::Revolute;
    joint.first = system.add_body(base);
    joint.second = system.add_body(link);
    joint.axis = {0.0, 1.0, 0.0};
    joint.turn = {0.1, 2.0, 0.0, 0.3};
    ActuatorParameters servo;
    servo.joint = system.add_joint(joint);
    servo.position = Motion::constant(0.1);
    servo.kp = 50.0;
    servo.kd = 5.0;
    servo.force_limit = 20.0;
    system.add_actuator(servo);
    EXPECT_EQ(steady_allocations(system, GetParam(), false), 0);
}

TEST_P(SteadySteps, OfFreeBodiesAllocateNothing) {
    MultibodySystem system;
    BodyParameters stone;
    stone.name = "stone";
    stone.inertia = {1.0, 2.0, 2.5, 0.0, 0.0, 0.0};
    stone.angular_velocity = {1.0, 2.0, 3.0};
    system.add_body(stone);
    EXPECT_EQ(steady_allocations(system, GetParam(), false), 0);
}

TEST_P(SteadySteps, OfRestingBodiesAllocateNothingInTheSolversPart) {
#ifndef DELASSUS_HAS_FCL
    GTEST_SKIP() << "this build has no collision";
#endif
    MultibodySystem system;
    const auto stone = system.add_material({0.5, 0.0});
    Shape plane;
    plane.kind = ShapeKind::Plane;
    system.add_shape(plane, stone);
    for (int k = 0; k < 2; ++k) {  // two islands
        BodyParameters ball;
        ball.name = "ball " + std::to_string(k);
        ball.inertia = Inertia::sphere(1.0, 0.5);
        ball.pose.position = {3.0 * k, 0.0, 0.5};
        Shape sphere;
        sphere.kind = ShapeKind::Sphere;
        sphere.size = {0.5, 0.0, 0.0};
        sphere.body = system.add_body(ball);
        system.add_shape(sphere, stone);
    }
    system.set_envelope(0.05);
    EXPECT_EQ(steady_allocations(system, GetParam(), true), 0);
    EXPECT_EQ(contacts, 2U);
}

// The count works: an allocation is seen.
TEST(Counting, TheCountSeesAnAllocation) {
    allocations = 0;
    counting = true;
    std::vector<double> one(100);
    counting = false;
    EXPECT_EQ(allocations, 1);
    EXPECT_EQ(one.size(), 100U);
}

#else
TEST(Counting, IsDoneWithoutSanitizersOnly) {
    GTEST_SKIP() << "the address sanitizer has a malloc of its own";
}
#endif

}  // namespace
}  // namespace delassus::steady_step_test
