// SPDX-License-Identifier: BSD-3-Clause
// Which process steps which body, and a system of some bodies of another one.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "delassus/scene.hpp"
#include "simulation/domains.hpp"
#include "simulation/part_of_system.hpp"

namespace delassus::tests::domains_test {
namespace {

constexpr int processes = 5;

std::vector<Vector3> centres_of(const SceneSystem& system, const Domains& domains) {
    std::vector<Vector3> centres;
    for (const BodyIndex body : domains.moving()) centres.push_back(system.system->body(body).pose.position);
    return centres;
}

/// Spheres at random, a plate that touches many, chains of three, in a box with a floor.
std::string crowd() {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> place(-1.0, 1.0), radius(0.03, 0.06);
    std::string text = "step: 0.002\nend: 1\nbodies:\n  - {name: floor, fixed: true, shapes: [{plane: {}}]}\n";
    for (int k = 0; k < 300; ++k)
        text += fmt::format(
            "  - {{name: s{}, density: 1000, position: [{:.6f}, {:.6f}, {:.6f}], shapes: [{{sphere: {{radius: "
            "{:.6f}}}}}]}}\n",
            k, 0.7 * place(random), 0.4 * place(random), 1.2 + 0.7 * place(random), radius(random));
    text += "  - {name: plate, density: 500, position: [0, 0, 1.9], shapes: [{box: {size: [2, 1, 0.05]}}]}\n";
    text += "joints:\n";
    for (int k = 0; k < 60; k += 3)
        text += fmt::format(
            "  - {{name: a{0}, kind: spherical, first: s{0}, second: s{1}, point: [{2:.3f}, 0, 1]}}\n"
            "  - {{name: b{0}, kind: spherical, first: s{1}, second: s{3}, point: [0, {2:.3f}, 1]}}\n",
            k, k + 1, 0.01 * k, k + 2);
    return text;
}

TEST(Domains, SharesAreEvenAndChainsStayTogether) {
    const Scene scene = parse_scene(crowd(), "crowd");
    const Domains domains(scene.systems[0]);
    ASSERT_EQ(domains.moving().size(), 301U);
    const std::vector<double> weights(301, 1.0);
    const auto owners = domains.owners(centres_of(scene.systems[0], domains), weights, processes);
    std::vector<int> count(processes, 0);
    for (const auto owner : owners) ++count.at(static_cast<std::size_t>(owner));
    for (const int one : count) EXPECT_NEAR(one, 301.0 / processes, 4.0);
    for (std::size_t k = 0; k < 60; k += 3) {
        EXPECT_EQ(owners[k], owners[k + 1]);
        EXPECT_EQ(owners[k], owners[k + 2]);
    }
    EXPECT_TRUE(domains.large()[300]);
    EXPECT_EQ(std::count(domains.large().begin(), domains.large().end(), true), 1);
}

TEST(Domains, MoreProcessesThanBodiesLeaveSomeEmpty) {
    const Scene scene = parse_scene(
        "{step: 0.01, end: 1, bodies: [{name: a, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, position: [1, 0, 0]}, "
        "{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]}",
        "two");
    const Domains domains(scene.systems[0]);
    const std::vector<double> weights(2, 1.0);
    const auto owners = domains.owners(centres_of(scene.systems[0], domains), weights, 7);
    EXPECT_NE(owners[0], owners[1]);
}

#ifdef DELASSUS_HAS_FCL

/// The unilateral rows of a system at its start, by key: gap and entries by names of bodies.
std::map<std::uint64_t, std::vector<double>> contacts_of(MultibodySystem& system,
                                                         const std::vector<BodyIndex>& bodies) {
    UnilateralRows rows;
    system.collect_unilateral(system.initial_state(), 0.002, rows);
    std::map<std::int32_t, BodyIndex> body_at;
    for (std::size_t k = 0; k < bodies.size(); ++k)
        if (const auto column = system.body_column(static_cast<BodyIndex>(k)); column >= 0) body_at[column] = bodies[k];
    std::map<std::uint64_t, std::vector<double>> result;
    std::size_t row = 0;
    for (const auto& block : rows.blocks()) {
        auto& numbers = result[block.key];
        for (std::int32_t i = 0; i < block.cone.rows; ++i, ++row) {
            numbers.push_back(rows.rows()[row].gap);
            for (auto e = rows.row_start()[row]; e < rows.row_start()[row + 1]; ++e) {
                const auto column = rows.column()[static_cast<std::size_t>(e)];
                numbers.push_back(body_at.at(column - column % 6));
                numbers.push_back(rows.value()[static_cast<std::size_t>(e)]);
            }
        }
    }
    return result;
}

// What the processes find of contacts, each where the contact falls to it, is together what one process finds, to the
// bit, and none is found twice.
TEST(Domains, ThePartsHaveEveryContactOnce) {
    Scene scene = parse_scene(crowd(), "crowd");
    SceneSystem& system = scene.systems[0];
    const Domains domains(system);
    const auto centres = centres_of(system, domains);
    const std::vector<double> weights(centres.size(), 1.0);
    const auto owners = domains.owners(centres, weights, processes);
    std::vector<Reach> reach;
    for (std::size_t k = 0; k < centres.size(); ++k)
        reach.push_back({centres[k], domains.radii()[k] + system.system->envelope()});
    std::vector<BodyIndex> all_bodies(static_cast<std::size_t>(system.system->body_count()));
    std::iota(all_bodies.begin(), all_bodies.end(), 0);
    const auto whole = contacts_of(*system.system, all_bodies);
    ASSERT_GT(whole.size(), 100U);

    std::map<std::uint64_t, std::vector<double>> together;
    std::size_t ghosts = 0;
    for (std::int32_t process = 0; process < processes; ++process) {
        const auto needed = domains.needed(owners, reach, process);
        std::vector<BodyIndex> bodies;
        std::map<BodyIndex, std::size_t> moving;
        for (std::size_t k = 0; k < needed.size(); ++k) {
            moving[domains.moving()[k]] = k;
            if (needed[k]) bodies.push_back(domains.moving()[k]);
            if (needed[k] && owners[k] != process) ++ghosts;
        }
        const PartOfSystem part = part_of_system(system, bodies, {});
        for (const auto& [key, numbers] : contacts_of(*part.system, part.bodies)) {
            // Who decides is among the bodies of the first row: gap, then body and value in turns.
            std::size_t decides = 0;
            std::int64_t least = std::numeric_limits<std::int64_t>::max();
            for (std::size_t i = 1; i + 1 < numbers.size() / 3; i += 2) {
                const std::size_t body = moving.at(static_cast<BodyIndex>(numbers[i]));
                if (domains.decides(body) >= least) continue;
                least = domains.decides(body);
                decides = body;
            }
            if (owners[decides] != process) continue;
            EXPECT_TRUE(together.emplace(key, numbers).second) << "found twice";
        }
    }
    EXPECT_GT(ghosts, 20U);
    EXPECT_EQ(together, whole);
}

#endif

}  // namespace
}  // namespace delassus::tests::domains_test
