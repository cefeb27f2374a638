// SPDX-License-Identifier: BSD-3-Clause
// The forces of contacts, as a run writes them.
#ifdef DELASSUS_HAS_FCL
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::contact_forces_test {
namespace {

constexpr double g = 9.81;

/// Sum of the forces on `second` in the contacts between the two, on it from the first.
Vector3 force_between(const Running& run, const std::string& first, const std::string& second) {
    const BodyIndex a = run.system().find_body(first), b = run.system().find_body(second);
    Vector3 sum{};
    for (const ContactRecord& contact : run.simulation.contacts()) {
        const auto& bodies = contact.bodies;
        const double sign = bodies[0] == a && bodies[1] == b ? 1.0 : bodies[0] == b && bodies[1] == a ? -1.0 : 0.0;
        for (std::size_t i = 0; i < 3; ++i) sum[i] += sign * contact.force[i];
    }
    return sum;
}

std::string stack(const std::string& more) {
    return R"(
step: 0.002
end: 2
solver: {tolerance: 1.0e-10}
materials: {stone: {friction: 0.6}}
)" + more + R"(
bodies:
  - {name: box_1, mass: 2, position: [0, 0, 0.15], shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: stone}]}
  - {name: ground, fixed: true, shapes: [{plane: {}, material: stone}]}
  - {name: box_0, mass: 1, position: [0, 0, 0.05], shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: stone}]}
)";
}

void expect_weights(const Running& run) {
    const StepReport& report = run.simulation.report();
    EXPECT_GE(report.contacts.size(), 8u);
    EXPECT_EQ(report.reactions.size(), report.contacts.size());
    std::set<std::uint64_t> keys;
    for (const auto& reaction : report.reactions) keys.insert(reaction.key);
    EXPECT_EQ(keys.size(), report.contacts.size());
    const Vector3 below = force_between(run, "ground", "box_0"), between = force_between(run, "box_0", "box_1");
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR(below[i], 0.0, 1e-6);
        EXPECT_NEAR(between[i], 0.0, 1e-6);
    }
    EXPECT_NEAR(below[2], 3.0 * g, 1e-6 * g);
    EXPECT_NEAR(between[2], 2.0 * g, 1e-6 * g);
}

TEST(ContactForces, UnderAStackSumToItsWeight) {
    Running run(parse_scene(stack(""), "test"));
    EXPECT_TRUE(run.simulation.contacts().empty());  // none is known before the first step
    for (int i = 0; i < 100; ++i) run.simulation.step();
    expect_weights(run);
}

// With chosen steps too, contacts and forces are those of one step of the method: its second half.
TEST(ContactForces, OfChosenStepsBelongToTheirContacts) {
    Running run(parse_scene(R"(
tolerance: 1.0e-5
end: 1
solver: {tolerance: 1.0e-10}
materials: {stone: {friction: 0.6}}
bodies:
  - {name: ground, fixed: true, shapes: [{plane: {}, material: stone}]}
  - {name: box_0, mass: 1, position: [0, 0, 0.05], shapes: [{box: {size: [0.1, 0.1, 0.1]}, material: stone}]}
)",
                            "test"));
    run.finish();
    const StepReport& report = run.simulation.report();
    EXPECT_EQ(report.contacts.size(), 4u);
    EXPECT_EQ(report.reactions.size(), 4u);
    EXPECT_NEAR(force_between(run, "ground", "box_0")[2], g, 1e-6 * g);
}

TEST(ContactForces, StayWhenAStepFails) {
    Running run(parse_scene(stack(""), "test"));
    for (int i = 0; i < 100; ++i) run.simulation.step();
    run.simulation.solver().interrupt_by([] { return true; });
    EXPECT_THROW(run.simulation.step(), StepInterrupted);
    expect_weights(run);
}

TEST(ContactForces, StayWhileBodiesSleep) {
    Running run(parse_scene(stack("sleeping: {time: 0.1}"), "test"));
    run.finish();
    EXPECT_EQ(run.simulation.record().sleeping, 2);
    expect_weights(run);
}

TEST(ContactForces, OnAnInclineHoldTheBox) {
    constexpr double angle = 20.0 * std::numbers::pi / 180.0, mass = 3.0;
    Running run(parse_scene(fmt::format(R"(
step: 0.002
end: 1
solver: {{law: coulomb, tolerance: 1.0e-10}}
gravity: [{}, 0, {}]
materials: {{stone: {{friction: 0.5}}}}
bodies:
  - {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: stone}}]}}
  - {{name: box, mass: {}, position: [0, 0, 0.05], shapes: [{{box: {{size: [0.1, 0.1, 0.1]}}, material: stone}}]}}
)",
                                        g * std::sin(angle), -g * std::cos(angle), mass),
                            "test"));
    for (int i = 0; i < 100; ++i) run.simulation.step();
    const Vector3 force = force_between(run, "ground", "box");
    EXPECT_NEAR(force[0], -mass * g * std::sin(angle), 1e-6 * mass * g);
    EXPECT_NEAR(force[1], 0.0, 1e-6 * mass * g);
    EXPECT_NEAR(force[2], mass * g * std::cos(angle), 1e-6 * mass * g);
    for (const auto& contact : run.simulation.contacts()) EXPECT_GE(contact.force[2], -1e-9);
}

TEST(ContactForces, OfElasticNodesCarryTheBlock) {
    Running run(parse_scene(R"(
step: 0.002
end: 1
solver: {tolerance: 1.0e-8}
materials: {rubber: {friction: 0.5}}
bodies:
  - {name: ground, fixed: true, shapes: [{plane: {}, material: rubber}]}
elastic_blocks:
  - {name: block, corner: [0, 0, 0.001], edges: [0.1, 0.1, 0.1], cells: [2, 2, 2], density: 1000, damping_time: 0.01,
     contact: {radius: 0.001, material: rubber}}
)",
                            "test"));
    run.finish();
    double sum = 0.0;
    for (const ContactRecord& contact : run.simulation.contacts()) {
        EXPECT_EQ(contact.bodies[0], 0);  // the ground
        EXPECT_GE(contact.bodies[1], 1);  // nodes are counted on after the one body
        sum += contact.force[2];
    }
    EXPECT_NEAR(sum, g, 1e-3 * g);
}

}  // namespace
}  // namespace delassus::tests::contact_forces_test
#endif
