// SPDX-License-Identifier: BSD-3-Clause
// Energy of stiff linear systems of bodies, springs, bushings, cables and elements, from hω = 0.01 to 1e8 (h = 1).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "delassus/multibody.hpp"
#include "delassus/timestepper.hpp"

namespace delassus::energy_test {
namespace {

/// Keeps the way in a step and the amplitude of oscillations near a thousandth of a metre.
double slow(double omega) {
    return 1e-3 * std::min(omega, 1.0);
}

const double frequencies[] = {1e-2, 1.0, 1e2, 1e4, 1e6, 1e8};

/// Two bodies in a row between walls: three springs along x through the mass centres, so that motion along x is linear.
std::unique_ptr<MultibodySystem> springs(double omega) {
    auto system = std::make_unique<MultibodySystem>();
    system->set_gravity({0.0, 0.0, 0.0});
    BodyParameters body;
    body.velocity = {slow(omega), 0.0, 0.0};
    const auto a = system->add_body(body);
    body.pose.position = {1.0, 0.0, 0.0};
    body.velocity = {-0.3 * slow(omega), 0.0, 0.0};
    const auto b = system->add_body(body);
    const auto join = [&](BodyIndex first, BodyIndex second, double x, double share) {
        SpringParameters spring;
        spring.first = first;
        spring.second = second;
        spring.first_point = {x, 0.0, 0.0};
        spring.second_point = {x + 1.0, 0.0, 0.0};
        spring.stiffness = share * omega * omega;
        system->add_spring(spring);
    };
    join(world_body, a, -1.0, 0.3);
    join(a, b, 0.0, 0.2);
    join(b, world_body, 1.0, 0.3);
    system->finish();
    return system;
}

/// A body that slides on a bushing of three stiffnesses.
std::unique_ptr<MultibodySystem> bushing(double omega) {
    auto system = std::make_unique<MultibodySystem>();
    system->set_gravity({0.0, 0.0, 0.0});
    BodyParameters body;
    body.velocity = {slow(omega), -0.5 * slow(omega), 0.2 * slow(omega)};
    BushingParameters bushing;
    bushing.second = system->add_body(body);
    const double k = omega * omega;
    bushing.stiffness = {k, 0.5 * k, 0.1 * k};
    bushing.turn_stiffness = {k, k, k};
    system->add_bushing(bushing);
    system->finish();
    return system;
}

/// A node between two cables along x that also push.
std::unique_ptr<MultibodySystem> cables(double omega) {
    auto system = std::make_unique<MultibodySystem>();
    system->set_gravity({0.0, 0.0, 0.0});
    NodeParameters node;
    node.fixed = true;
    const auto left = system->add_node(node);
    node.position = {2.0, 0.0, 0.0};
    const auto right = system->add_node(node);
    node.position = {1.0, 0.0, 0.0};
    node.velocity = {slow(omega), 0.0, 0.0};
    node.fixed = false;
    node.mass = 0.5;
    const auto middle = system->add_node(node);
    for (const auto& nodes : {std::array{left, middle}, std::array{middle, right}}) {
        CableParameters cable;
        cable.nodes = nodes;
        cable.young = 0.5 * omega * omega;
        cable.area = 1.0;
        cable.density = 0.5;
        cable.slack = false;
        system->add_cable(cable);
    }
    system->finish();
    return system;
}

/// A block of elements on the wall, with a speed that keeps its strains small.
std::unique_ptr<MultibodySystem> block(double omega) {
    auto system = std::make_unique<MultibodySystem>();
    system->set_gravity({0.0, 0.0, 0.0});
    ElasticBlock block;
    block.cells = {2, 1, 1};
    block.edges = {2.0, 1.0, 1.0};
    block.material.young = omega * omega;
    block.material.density = 1.0;
    block.fixed_faces[0] = true;
    block.velocity = {0.1 * slow(omega), -0.2 * slow(omega), 0.1 * slow(omega)};
    system->add_elastic_block(block);
    system->finish();
    return system;
}

struct Linear {
    const char* name;
    std::unique_ptr<MultibodySystem> (*make)(double omega);
};
void PrintTo(const Linear& one, std::ostream* out) {
    *out << one.name;
}

class LinearEnergy : public testing::TestWithParam<Linear> {};

TEST_P(LinearEnergy, NeverGrowsWithImplicitEuler) {
    const Registry registry;
    for (const char* method : {"euler_implicit", "euler_implicit_linearized"})
        for (const double omega : frequencies) {
            const auto system = GetParam().make(omega);
            StepSolver solver(registry, {});
            const auto stepper = make_timestepper(method, *system);
            State state = system->initial_state();
            const double first = system->energy(state);
            double before = first;
            for (int step = 0; step < 100; ++step) {
                stepper->step(state, 1.0, solver);
                const double now = system->energy(state);
                // Positions of some metres are known to 1e-14 m, where Newton's method stops; that is an energy too.
                ASSERT_LE(now, before * (1.0 + 1e-12) + 1e-28 * omega * omega)
                    << method << " at " << omega << ", step " << step << " from " << first;
                before = now;
            }
            EXPECT_LT(before, first);
        }
}

INSTANTIATE_TEST_SUITE_P(Systems, LinearEnergy,
                         testing::Values(Linear{"springs", springs}, Linear{"bushing", bushing},
                                         Linear{"cables", cables}, Linear{"block", block}),
                         [](const auto& chosen) { return std::string(chosen.param.name); });

}  // namespace
}  // namespace delassus::energy_test
