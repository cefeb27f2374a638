// SPDX-License-Identifier: BSD-3-Clause
// Runs that come to where their method or their parts cannot go on, and what they say then.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "simulation/energy_guard.hpp"
#include "support/scenes.hpp"

namespace delassus::going_on_test {
namespace {

using tests::Running;

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

/// Capsules over half of a drum, and some that hang down from each end, which are heavy, the one more than the other.
std::string chain_over_drum() {
    constexpr int over = 17, left = 3, right = 3, count = left + over + right;
    constexpr double drum = 0.2, thickness = 0.016, reach = drum + thickness;
    const double turn = std::numbers::pi / over, link = 2.0 * reach * std::tan(0.5 * turn);
    // Joints, from the end of the left side on.
    std::vector<std::array<double, 2>> points;
    for (int i = left; i > 0; --i) points.push_back({-reach / std::cos(0.5 * turn), -i * link});
    for (int i = 0; i <= over; ++i) {
        const double angle = std::numbers::pi - i * turn;
        points.push_back(
            {reach / std::cos(0.5 * turn) * std::cos(angle), reach / std::cos(0.5 * turn) * std::sin(angle)});
    }
    for (int i = 1; i <= right; ++i) points.push_back({reach / std::cos(0.5 * turn), -i * link});
    std::string bodies, joints, apart;
    for (int i = 0; i < count; ++i) {
        const auto& [x, z] = points[static_cast<std::size_t>(i)];
        const auto& [X, Z] = points[static_cast<std::size_t>(i) + 1];
        const double length = std::hypot(X - x, Z - z), angle = std::atan2(X - x, Z - z) * 180.0 / std::numbers::pi;
        bodies += fmt::format(
            "- {{name: l{}, mass: {}, position: [{:.17g}, 0, {:.17g}], orientation: {{axis: [0, 1, 0], angle: "
            "{:.17g}}}, "
            "shapes: [{{capsule: {{radius: {}, length: {:.17g}}}, material: m}}]}}\n",
            i, i + 1 == count ? 4.0 : (i == 0 ? 0.8 : 0.01), 0.5 * (x + X), 0.5 * (z + Z), angle, thickness, length);
        if (i == 0) continue;
        joints += fmt::format(
            "- {{name: j{0}, kind: spherical, first: l{1}, second: l{0}, point: [{2:.17g}, 0, {3:.17g}]}}\n", i, i - 1,
            x, z);
        if (i > 1) apart += fmt::format("- [l{}, l{}]\n", i - 2, i);
    }
    return fmt::format(
        "step: 0.004\nend: 0.2\nmaterials: {{m: {{friction: 0.1}}}}\nbodies:\n"
        "- {{name: drum, fixed: true, orientation: {{axis: [1, 0, 0], angle: 90}}, shapes: [{{cylinder: {{radius: {}, "
        "length: 0.4}}, material: m}}]}}\n{}joints:\n{}keep_apart:\n{}",
        drum, bodies, joints, apart);
}

// Joint coordinates know the way of contacts far from their root badly; where that gains energy, another method goes
// on.
TEST(GoingOn, AChainThatSlidesOverADrumGainsNoEnergy) {
    auto run = run_of(chain_over_drum());
    ASSERT_EQ(run.simulation.method().coordinates, Coordinates::Joint);
    const double start = run.simulation.record().energy;
    run.finish();
    const auto& totals = run.simulation.totals();
    const bool changed = totals.method_changes == 1;
    EXPECT_EQ(run.simulation.method().coordinates, changed ? Coordinates::Maximal : Coordinates::Joint);
    EXPECT_EQ(run.simulation.joint_coordinates() == nullptr, changed);
    EXPECT_LT(totals.growth_share, 0.07) << "5 %, and what the step gains that passes it";
    // At 1 ms friction takes 0.48 J; at 4 ms rounding decides how much of it.
    EXPECT_LT(run.simulation.record().energy, start);
    EXPECT_LT(run.pose("l0").position[2], 0.5);
    const auto warnings = run.simulation.warnings();
    EXPECT_EQ(
        changed, std::any_of(warnings.begin(), warnings.end(), [](const std::string& sentence) {
            return sentence.find(
                       "linearly_implicit_trapezoidal in maximal coordinates took the place of switching in joint "
                       "coordinates, which could not go on") != std::string::npos;
        }));

    // A run that is taken up again, before the change or after it, goes the same way.
    for (const double until : {0.03, 0.17}) {
        SCOPED_TRACE(until);
        auto first = run_of(chain_over_drum()), second = run_of(chain_over_drum());
        while (first.simulation.record().t < until) first.simulation.step();
        second.simulation.load(first.simulation.save());
        second.finish();
        EXPECT_EQ(second.simulation.coordinates().q, run.simulation.coordinates().q);
        // And back.
        second.simulation.load(first.simulation.save());
        second.finish();
        EXPECT_EQ(second.simulation.coordinates().q, run.simulation.coordinates().q);
    }
}

TEST(GoingOn, WhoeverNamesAMethodKeepsIt) {
    auto run = run_of("integrator: switching\ncoordinates: joint\n" + chain_over_drum());
    try {
        run.finish();
    } catch (const StepFailure&) {
    }
    EXPECT_EQ(run.simulation.totals().method_changes, 0);
}

TEST(GoingOn, BodiesThatCannotBeKeptApartAreKnownToARunThatGoesOn) {
    const std::string scene =
        "step: 0.016\nend: 0.5\nsolver: {tolerance: 1.0e-09}\nmaterials: {m: {friction: 0.1}}\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "- {name: b0, position: [-0.5, 0, 0.35], angular_velocity: [0.448156, 0.431761, -0.304795], density: 1000, "
        "shapes: [{sphere: {radius: 0.05}}]}\n"
        "- {name: b1, position: [-0.5, 0, 0.45], orientation: {axis: [1, 0, 0], angle: 90}, mass: 0.1, shapes: "
        "[{capsule: {radius: 0.05, length: 0.4}}]}\n"
        "- {name: b2, position: [-0.5, 0, 0.61], mass: 50, shapes: [{sphere: {radius: 0.1}}]}\n"
        "- {name: b3, position: [0.1, 0, 0.15], density: 1000, shapes: [{sphere: {radius: 0.15}}]}\n";
    auto whole = run_of(scene);
    whole.finish();
    for (const double until : {0.25, 0.3, 0.35}) {
        SCOPED_TRACE(until);
        auto first = run_of(scene), second = run_of(scene);
        while (first.simulation.record().t < until) first.simulation.step();
        second.simulation.load(first.simulation.save());
        second.finish();
        EXPECT_EQ(second.simulation.coordinates().q, whole.simulation.coordinates().q);
    }
}

// Nothing is left that could move, so that nothing can be pushed apart either.
TEST(GoingOn, AWeldedBodyIsPressed) {
    auto run = run_of(
        "step: 0.01\nend: 0.6\nbodies:\n"
        "- {name: press, position: [0, 0, 1], motion: {translation: [0, 0, {linear: {start: 1, rate: -1}}]}, "
        "shapes: [{box: {size: [1, 1, 0.2]}}]}\n"
        "- {name: block, mass: 1, position: [0, 0, 0.2], shapes: [{box: {size: [0.4, 0.4, 0.4]}}]}\n"
        "joints:\n- {name: weld, kind: fixed, first: world, second: block, point: [0, 0, 0]}\n");
    try {
        run.finish();
    } catch (const StepFailure& failure) {
        EXPECT_NE(std::string(failure.what()).find("\"block\""), std::string::npos) << failure.what();
    }
    EXPECT_NEAR(run.pose("block").position[2], 0.2, 1e-9);
}

TEST(GoingOn, WhatIsSqueezedIsNamed) {
    auto run = run_of(
        "step: 0.01\nend: 2\nmaterials: {m: {friction: 0.5}}\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "- {name: wall, fixed: true, position: [0.2, 0, 0.5], shapes: [{box: {size: [0.1, 1, 1]}, material: m}]}\n"
        "- {name: blade, motion: {translation: [{ramp: {from: -0.5, to: 0.5, start: 0.1, duration: 1.5}}, 0, 0.2]}, "
        "shapes: [{box: {size: [0.1, 1, 0.3]}, material: m}]}\n"
        "- {name: box, mass: 2, position: [-0.2, 0.1, 0.15], shapes: [{box: {size: [0.3, 0.3, 0.3]}, material: m}]}\n");
    try {
        run.finish();
        FAIL() << "the blade goes through the box";
    } catch (const StepFailure& failure) {
        const std::string sentence = failure.what();
        EXPECT_NE(sentence.find("\"blade\" and \"box\""), std::string::npos) << sentence;
        EXPECT_EQ(sentence.find("iterations"), std::string::npos)
            << "what solvers did is nobody's business: " << sentence;
    }
}

// A cylinder that spins by more than a radian in a step meets the ground within it; its depth at the beginning is none.
TEST(GoingOn, DepthsAreThoseOfTheBeginningOfAStep) {
    auto run = run_of(
        "step: 0.01\nend: 0.6\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}}]}\n"
        "- {name: spinner, density: 100, position: [0, 0, 0.3], velocity: [3, 0, 0], angular_velocity: [220, 5, 30], "
        "shapes: [{cylinder: {radius: 0.05, length: 0.1}}]}\n");
    run.finish();
    EXPECT_LT(run.simulation.totals().worst_penetration, 2e-4);
}

TEST(GoingOn, EnergyThatFrictionHidesIsAGrowth) {
    SimulationTotals totals;
    totals.start_energy = 10.0;
    totals.lowest = 4.0;
    EXPECT_DOUBLE_EQ(EnergyGuard::growth(totals, 4.5, 0.0), 0.5);
    EXPECT_DOUBLE_EQ(EnergyGuard::growth(totals, 4.5, 0.5), 0.0) << "what sank in was lifted";
    EXPECT_DOUBLE_EQ(EnergyGuard::growth(totals, 10.25, 6.25), 0.25) << "above the start nothing lifts";
    totals.credit = 0.25;
    EXPECT_DOUBLE_EQ(EnergyGuard::growth(totals, 10.25, 6.25), 0.0) << "but what overlaps there";
}

// All that adds up in the rows of a joint along an axis is rounding: velocities across it are taken out.
TEST(GoingOn, AVelocityAcrossAJointIsTakenOut) {
    for (const char* axis : {"[-1, 0, 0]", "[0, 1, 0]", "[0.6, 0, 0.8]"}) {
        auto run = run_of(fmt::format(
            "step: 0.001\nend: 0.01\ngravity: [0, 0, 0]\nbodies:\n"
            "- {{name: slider, position: [0.084611, 0.071026, 0.656608], velocity: [-0.069056, 0.037821, 0.026723], "
            "mass: "
            "2, inertia: {{xx: 1, yy: 1, zz: 1}}}}\njoints:\n- {{name: rail, kind: prismatic, first: world, second: "
            "slider, point: [0.283529, 0.22042, "
            "0.813111], axis: {}}}\n",
            axis));
        run.finish();
        EXPECT_LT(run.simulation.totals().worst_drift, 1e-9);
    }
}

// A turning about the point that is held in the row's direction does not change the distance, but for rounding of a
// turned scene: it does not follow.
TEST(GoingOn, AVelocityAlongADistanceIsTakenOutInAnyDirection) {
    const double lengths[][3] = {{0.0, 1.0, 0.0}, {0.48, 0.6, 0.64}, {0.36, -0.8, 0.48}, {0.1, 0.7, -0.7}};
    for (const auto& [x, y, z] : lengths) {
        SCOPED_TRACE(x);
        const double length = std::hypot(x, y, z), r = 0.86 / length, speed = 0.22 / length;
        auto run = run_of(
            fmt::format("step: 0.016\nend: 0.1\ngravity: [0, 0, 0]\nbodies:\n"
                        "- {{name: b, position: [0.3, 0.04, 0.6], velocity: [{:.17g}, {:.17g}, {:.17g}], mass: 50, "
                        "inertia: {{xx: 0.5, yy: 0.6, zz: 0.4}}}}\n"
                        "joints:\n- {{name: rod, kind: distance, first: world, second: b, point: [0.3, 0.04, 0.6], "
                        "second_point: [{:.17g}, {:.17g}, {:.17g}]}}\n",
                        speed * x, speed * y, speed * z, 0.3 + r * x, 0.04 + r * y, 0.6 + r * z));
        EXPECT_LT(run.simulation.record().energy, 1e-6);
        run.finish();
        EXPECT_NEAR(run.pose("b").position[0], 0.3, 1e-6);
    }
}

}  // namespace
}  // namespace delassus::going_on_test
