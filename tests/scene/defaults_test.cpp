// SPDX-License-Identifier: BSD-3-Clause
// Plain scenes with nothing chosen, against what is known in closed form.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/error.hpp"
#include "support/places.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::defaults_test {
namespace {

using Eigen::Vector3d;

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

// ---- Time ----

TEST(Defaults, TimesAreMultiplesOfTheStep) {
    auto run = run_of(
        "step: 0.0002\nend: 0.3\nbodies:\n"
        "- {name: bob, mass: 1, inertia: {xx: 1e-3, yy: 1e-3, zz: 1e-3}, position: [-1, 0, 0]}\n"
        "joints:\n- {name: hinge, kind: revolute, second: bob, point: [0, 0, 0], axis: [0, 1, 0]}\n");
    while (!run.simulation.finished()) {
        const StepRecord& record = run.simulation.step();
        ASSERT_EQ(record.h, 0.0002);
        ASSERT_EQ(record.t, record.step == 1500 ? 0.3 : static_cast<double>(record.step) * 0.0002);
    }
    EXPECT_EQ(run.simulation.record().step, 1500);
}

TEST(Defaults, NoStepIsShorterThanHalfOfTheStep) {
    for (const double end : {0.01, 0.010001, 0.0107, 0.01349, 0.0135, 0.01999}) {
        auto run = run_of(fmt::format(
            "step: 0.001\nend: {}\nbodies: [{{name: b, mass: 1, inertia: {{xx: 1, yy: 1, zz: 1}}}}]\n", end));
        double sum = 0.0;
        while (!run.simulation.finished()) {
            const double h = run.simulation.step().h;
            EXPECT_GE(h, 0.0005 * (1.0 - 1e-9)) << end;
            EXPECT_LE(h, 0.001) << end;
            sum += h;
        }
        EXPECT_EQ(run.simulation.state().t, end);
        EXPECT_NEAR(sum, end, 1e-15);
    }
}

// ---- How exactly steps are solved (docs/tolerance.md) ----

// What a solver leaves in the gaps must not return as a motion, whatever tolerance the scene gives.
TEST(Defaults, AWallThatWasHitComesToRest) {
    for (const char* solver : {"", "solver: {tolerance: 0.01}\n", "solver: {tolerance: 1.0e-4}\n"}) {
        auto run = run_of(fmt::format(
            "step: 0.005\nend: 1.5\n{}materials: {{m: {{friction: 0.6}}}}\nbodies:\n"
            "- {{name: ground, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
            "- {{name: ball, mass: 3, inertia: {{xx: 0.012, yy: 0.012, zz: 0.012}}, position: [0.63, -0.6, 0.35],\n"
            "   velocity: [0.1, 1.7, 1.3], shapes: [{{sphere: {{radius: 0.1}}, material: m}}]}}\n"
            "- {{name: \"even_{{i}}_{{k}}\", density: 1800, position: [0, 0, 0.05],\n"
            "   shapes: [{{box: {{size: [0.25, 0.12, 0.1]}}, material: m}}],\n"
            "   repeat: {{count: [6, 1, 3], spacing: [0.25, 0, 0.2]}}}}\n"
            "- {{name: \"odd_{{i}}_{{k}}\", density: 1800, position: [0.125, 0, 0.15],\n"
            "   shapes: [{{box: {{size: [0.25, 0.12, 0.1]}}, material: m}}],\n"
            "   repeat: {{count: [5, 1, 3], spacing: [0.25, 0, 0.2]}}}}\n",
            solver));
        double hit = 0.0;
        while (!run.simulation.finished()) {
            run.simulation.step();
            hit = std::max(hit, std::abs(run.velocities("odd_2_1")[0][1]));
        }
        EXPECT_GT(hit, 0.02) << solver;
        for (const char* brick : {"even_0_0", "even_2_1", "odd_2_1", "odd_4_2"}) {
            const auto velocities = run.velocities(brick);
            for (const double v : velocities[0]) EXPECT_LT(std::abs(v), 1e-6) << solver << brick;
        }
    }
}

// Boxes one above the other land layer by layer. What a landing leaves of the gaps is corrected by problems with many
// more rows than velocities: solved to rounding these took thousands of iterations.
TEST(Defaults, APyramidLandsInFewIterations) {
    std::string bodies = "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n";
    constexpr int layers = 7;
    for (int k = 0; k < layers; ++k)
        for (int i = 0; i < layers - k; ++i)
            for (int j = 0; j < layers - k; ++j)
                bodies += fmt::format(
                    "- {{name: b{}_{}_{}, density: 1000, position: [{:.17g}, {:.17g}, {:.17g}], shapes: "
                    "[{{box: {{size: [1, 1, 1]}}, material: m}}]}}\n",
                    k, i, j, 1.03 * (i + 0.5 * k), 1.03 * (j + 0.5 * k), 0.504 + 1.004 * k);
    Running run(parse_scene("step: 0.01\nend: 0.2\nmaterials: {m: {friction: 0.6}}\nbodies:\n" + bodies, "test.yaml"));
    run.finish();
    EXPECT_LT(run.simulation.totals().solver_iterations, 15000);
    EXPECT_LT(run.simulation.record().kinetic, 1e-3);
    EXPECT_LT(run.simulation.totals().worst_penetration, 1e-4);
    EXPECT_NEAR(run.pose("b6_0_0").position[2], layers - 0.5, 1e-4);
}

// Spheres that lie in a lattice slide away over one another. No solver finds reactions to 1e-8 in any time, and nobody
// asked for that: the steps end after what is worth trying.
TEST(Defaults, ALatticePileIsNotSolvedForEver) {
    constexpr double r = 0.05;
    std::string bodies;
    for (int k = 0; k < 7; ++k)
        bodies += fmt::format(
            "- {{name: \"s{0}_{{i}}_{{j}}\", density: 1000, position: [{1:.6f}, {1:.6f}, {2:.6f}],\n"
            "   shapes: [{{sphere: {{radius: {3}}}, material: m}}], repeat: {{count: [{4}, {4}, 1], spacing: [0.1, "
            "0.1, 1]}}}}\n",
            k, k * r, r + k * r * std::numbers::sqrt2, r, 7 - k);
    auto run = run_of(
        "step: 0.004\nend: 0.1\nmaterials: {m: {friction: 0.5}}\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n" +
        bodies);
    while (!run.simulation.finished()) EXPECT_LT(run.simulation.step().penetration, 1e-4);
    const auto& totals = run.simulation.totals();
    EXPECT_GT(totals.near_goal_solves, 0);
    EXPECT_LT(totals.solver_iterations, 20000);
    EXPECT_LT(totals.worst_natural, 1.01e-2);
    // By symmetry the corners of the base go out along the diagonals.
    for (const auto& [name, way] : {std::pair{"s0_0_0", -1.0}, {"s0_6_6", 1.0}}) {
        const auto v = run.velocities(name)[0];
        EXPECT_GT(way * v[0], 0.01) << name;
        EXPECT_GT(way * v[1], 0.01) << name;
    }
}

// What the heavy box's speed is off by must not excuse the light ones beneath it.
TEST(Defaults, AHeavyBoxDoesNotShakeWhatCarriesIt) {
    for (const char* solver : {"auto", "ssn"}) {
        SceneOverrides overrides;
        overrides.solver = solver;
        overrides.values = {{"bodies.top.mass", "1e8"}};
        Running run(
            read_scene(std::string(tests::places::source) + "/examples/suites/stability/stack.yaml", overrides));
        run.finish();
        for (const char* body : {"lower", "middle", "top"}) {
            const auto velocities = run.velocities(body);
            for (const double v : velocities[0]) EXPECT_LT(std::abs(v), 2e-7) << solver << ' ' << body;
        }
        EXPECT_LT(run.simulation.totals().solver_iterations, 1000000) << solver;
    }
}

TEST(Defaults, BouncesWithoutLossTakeNothing) {
    SceneOverrides overrides;
    overrides.end = 200.0;
    Running run(read_scene(std::string(tests::places::source) + "/examples/suites/stability/bounces.yaml", overrides));
    run.finish();
    EXPECT_EQ(run.simulation.totals().energy, 0.5);
    EXPECT_GT(run.simulation.totals().solver_iterations, 100);
}

// Of several solutions the one at rest is taken: a rod that two pads hold by friction neither tilts nor sinks, although
// other reactions within the cones would let it. They can carry 2 μ F = 1.4 F; it weighs 7.8 N.
TEST(Defaults, AGripHoldsWhatItCanHold) {
    for (const double force : {7.0, 12.0, 31.0})
        for (const double turn : {90.0, 17.0}) {
            auto run = run_of(fmt::format(
                "step: 0.0023\nend: 2\nmaterials: {{rubber: {{friction: 0.7}}}}\nbodies:\n"
                "- {{name: left, mass: 0.1, position: [-0.009, 0, 0.1],\n"
                "   shapes: [{{box: {{size: [0.01, 0.03, 0.03]}}, material: rubber}}]}}\n"
                "- {{name: right, mass: 0.1, position: [0.009, 0, 0.1],\n"
                "   shapes: [{{box: {{size: [0.01, 0.03, 0.03]}}, material: rubber}}]}}\n"
                "- {{name: rod, mass: 0.8, position: [0, 0, 0.1], orientation: {{axis: [1, 0, 0], angle: {0}}},\n"
                "   shapes: [{{capsule: {{radius: 0.004, length: 0.012}}, material: rubber}}]}}\n"
                "joints:\n"
                "- {{name: l, kind: prismatic, second: left, point: [-0.009, 0, 0.1], axis: [1, 0, 0]}}\n"
                "- {{name: r, kind: prismatic, second: right, point: [0.009, 0, 0.1], axis: [-1, 0, 0]}}\n"
                "loads:\n- {{name: push, body: left, force: [{1}, 0, 0]}}\n"
                "- {{name: pull, body: right, force: [-{1}, 0, 0]}}\n",
                turn, force));
            run.finish();
            EXPECT_NEAR(run.pose("rod").position[2], 0.1, 1e-9) << force << ", " << turn;
            const auto velocities = run.velocities("rod");
            for (const double spin : velocities[1]) EXPECT_NEAR(spin, 0.0, 1e-9) << force << ", " << turn;
        }
}

// ---- Contact ----

TEST(Defaults, WhatPenetratesIsPushedApartSlowly) {
    auto run = run_of(
        "step: 0.0002\nend: 0.5\nbodies:\n- {name: ground, fixed: true, shapes: [{plane: {}}]}\n"
        "- {name: ball, mass: 1, position: [0, 0, 0.0999], shapes: [{sphere: {radius: 0.1}}]}\n");
    double highest = 0.0, fastest = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        highest = std::max(highest, run.pose("ball").position[2]);
        fastest = std::max(fastest, std::abs(run.velocities("ball")[0][2]));
    }
    EXPECT_LE(fastest, 0.01 * std::sqrt(9.81 * 0.1) * (1.0 + 1e-9));
    // With that speed it rises by 5e-6 m at most.
    EXPECT_LE(highest, 0.1 + 6e-6);
    EXPECT_NEAR(run.pose("ball").position[2], 0.1, 1e-9);
    EXPECT_TRUE(run.simulation.warnings().empty());
}

/// A ball of radius 0.1 m at 1 m/s down and `slide` m/s along x, a height above the ground that puts the impact at any
/// phase of a step; returns its velocity after the impact.
Vector3d after_impact(const std::string& law, double slide, double phase, double friction) {
    constexpr double step = 1e-3, restitution = 0.6;
    auto run = run_of(fmt::format(
        "gravity: [0, 0, 0]\nstep: {}\nend: 0.1\nenvelope: 0.01\nmaterials: {{s: {{friction: {}, restitution: {}}}}}\n"
        "{}bodies:\n- {{name: g, fixed: true, shapes: [{{plane: {{}}, material: s}}]}}\n"
        "- {{name: b, mass: 1, position: [0, 0, {:.17g}], velocity: [{}, 0, -1], shapes: [{{sphere: {{radius: 0.1}}, "
        "material: s}}]}}\n",
        step, friction, restitution, law.empty() ? "" : "solver: {law: " + law + "}\n", 0.15 + phase * step, slide));
    run.finish();
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
    const Vector3 v = run.velocities("b")[0];
    return {v[0], v[1], v[2]};
}

TEST(Defaults, RestitutionIsMetAtAnyPhaseOfTheStep) {
    for (const char* law : {"", "associated"})
        for (const double phase : {0.0, 0.13, 0.35, 0.5, 0.6, 0.77, 0.99}) {
            SCOPED_TRACE(fmt::format("{} {}", law, phase));
            // Friction stops the sliding: 5/7 of the speed stays (a solid sphere, 2/5 m r²).
            const Vector3d rolls = after_impact(law, 1.0, phase, 0.5);
            EXPECT_NEAR(rolls[2], 0.6, 6e-4);
            EXPECT_NEAR(rolls[0], 5.0 / 7.0, 1e-3);
            // It does not: the impulse of friction is μ (1 + e) m u.
            const Vector3d slides = after_impact(law, 10.0, phase, 0.5);
            EXPECT_NEAR(slides[2], 0.6, 6e-4);
            EXPECT_NEAR(slides[0], 10.0 - 0.5 * 1.6, 1e-3);
        }
}

std::string brick_stack(int layers, double end = 0.2, int wide = 3) {
    std::string text = fmt::format("step: 0.00271\nend: {}\n", end) +
                       "materials: {m: {friction: 0.6}}\nbodies:\n"
                       "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n";
    for (int layer = 0; layer < layers; ++layer)
        for (int k = 0; k < wide - layer % 2; ++k)
            text += fmt::format(
                "- {{name: b{}_{}, density: 1800, position: [{}, 0.013, {}], shapes: [{{box: {{size: [0.25, 0.12, "
                "0.1]}}, "
                "material: m}}]}}\n",
                layer, k, 0.25 * k + 0.125 * (layer % 2), 0.05 + 0.1 * layer);
    return text;
}

TEST(Defaults, AWallAtRestKeepsItsRowsAndCostsNothing) {
    auto run = run_of(brick_stack(5, 0.6));
    std::vector<double> first;
    double largest = 0.0;
    run.simulation.solver().watch([&](const Problem& problem) {
        if (first.empty()) first = problem.D.value;
        ASSERT_EQ(problem.D.value.size(), first.size());
        for (std::size_t i = 0; i < first.size(); ++i)
            largest = std::max(largest, std::abs(problem.D.value[i] - first[i]));
    });
    int busy = 0, steps = 0;
    while (!run.simulation.finished()) {
        busy += run.simulation.step().solver_iterations > 0 ? 1 : 0;
        ++steps;
    }
    EXPECT_LT(largest, 1e-9);
    EXPECT_LE(10 * busy, steps);
    EXPECT_NEAR(run.pose("b4_1").position[2], 0.45, 1e-9);
    EXPECT_NEAR(run.pose("b4_1").position[0], 0.25, 1e-9);
}

// A thousand contacts are solved to 1e-8 and no nearer. What that leaves of the velocities is 0 after the step, so that
// nothing grows from it.
TEST(Defaults, AWallOfAThousandContactsAtRestIsSolvedOnce) {
    for (const char* integrator : {"", "euler_implicit_linearized"}) {
        SceneOverrides overrides;
        overrides.integrator = integrator;
        Running run(parse_scene(brick_stack(10, 0.6, 10), "test.yaml", overrides));
        int busy = 0;
        std::int64_t unsolved = 0;
        double energy = 0.0;
        while (!run.simulation.finished()) {
            busy += run.simulation.step().solver_iterations > 0 ? 1 : 0;
            unsolved += run.simulation.record().natural > 1e-8 ? 1 : 0;
            energy = run.simulation.record().kinetic;
        }
        EXPECT_LE(busy, 10) << integrator;
        EXPECT_EQ(unsolved, 0) << integrator;
        EXPECT_EQ(energy, 0.0) << integrator;
        EXPECT_NEAR(run.pose("b9_4").position[2], 0.95, 1e-9) << integrator;
    }
}

// What stands still is not what moves slowly: a light ball rolls on a heavy slab at a millionth of its weight.
TEST(Defaults, ALightBallRollsSlowlyOnAHeavySlab) {
    auto run = run_of(
        "step: 0.007\nend: 2\ngravity: [9.81e-6, 0, -9.81]\nmaterials: {m: {friction: 0.5}}\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "- {name: slab, density: 60000, position: [0, 0, 0.5], shapes: [{box: {size: [4, 4, 1]}, material: m}]}\n"
        "- {name: ball, mass: 0.01, inertia: {xx: 4e-5, yy: 4e-5, zz: 4e-5}, position: [0, 0, 1.1],\n"
        "   shapes: [{sphere: {radius: 0.1}, material: m}]}\n");
    run.finish();
    EXPECT_NEAR(run.velocities("ball")[0][0], 5.0 / 7.0 * 9.81e-6 * 2.0, 1e-9);
    const auto slab = run.velocities("slab");
    for (const double v : slab[0]) EXPECT_EQ(v, 0.0);
}

TEST(Defaults, AHouseOfCardsAtRestCostsNothing) {
    for (const char* integrator : {"euler_implicit_linearized", "linearly_implicit_trapezoidal"}) {
        SceneOverrides overrides;
        overrides.integrator = integrator;
        overrides.end = 2.0;
        Running run(read_scene(std::string(tests::places::source) + "/examples/scenes/card_house.yaml", overrides));
        int busy = 0;
        while (!run.simulation.finished()) busy += run.simulation.step().solver_iterations > 0 ? 1 : 0;
        EXPECT_LE(busy, 3) << integrator;
    }
}

// ---- Spin ----

/// Energy and momentum in space of a free body with the moments (1, 2, 3) kg m².
struct Spin {
    double energy;
    Vector3d momentum;
};
Spin spin_of(const Running& run) {
    const auto [w, x, y, z] = run.pose("b").orientation;
    const Vector3 omega = run.velocities("b")[1];
    const Vector3d local(1.0 * omega[0], 2.0 * omega[1], 3.0 * omega[2]);
    return {0.5 * Vector3d(omega.data()).dot(local), Eigen::Quaterniond(w, x, y, z) * local};
}

TEST(Defaults, AFreeBodyKeepsEnergyAndMomentum) {
    for (const double step : {0.01, 0.137, 1.3}) {
        auto run =
            run_of(fmt::format("integrator: euler_implicit_linearized\ngravity: [0, 0, -9.81]\nstep: {}\nend: "
                               "60\nbodies:\n- {{name: b, mass: 1.7, inertia: {{xx: 1, "
                               "yy: 2, zz: 3}}, angular_velocity: [0.3, 2.0, 0.4]}}\n",
                               step));
        const Spin start = spin_of(run);
        run.finish();
        const Spin end = spin_of(run);
        EXPECT_NEAR(end.energy, start.energy, 1e-11 * start.energy) << step;
        EXPECT_LT((end.momentum - start.momentum).norm(), 1e-11 * start.momentum.norm()) << step;
    }
}

/// A free body without weight, for one second.
Running spinning(double step, std::string_view body) {
    return run_of(fmt::format(
        "integrator: euler_implicit_linearized\ngravity: [0, 0, 0]\nstep: {:.17g}\nend: 1\nbodies:\n- {{name: b, mass: "
        "1, {}}}\n",
        step, body));
}

// A symmetric body precesses in its own frame with Ω = ω_z (J_z − J_x)/J_x; the rule is of order 4 down to short steps.
TEST(Defaults, ASpinningBodyPrecessesWithOrderFour) {
    const auto error = [](double step) {
        auto run = spinning(step, "inertia: {xx: 2, yy: 2, zz: 3}, angular_velocity: [0.7, 0, 5]");
        run.finish();
        const double angle = 5.0 * (3.0 - 2.0) / 2.0;
        const Vector3 omega = run.velocities("b")[1];
        return std::hypot(omega[0] - 0.7 * std::cos(angle), omega[1] - 0.7 * std::sin(angle));
    };
    const double ratio = error(1.0 / 512) / error(1.0 / 1024);
    EXPECT_NEAR(std::log2(ratio), 4.0, 0.02);
    EXPECT_LT(error(0.1), 1e-7) << "of long steps too";
}

// Without symmetry there are elliptic functions; three steps show the order.
TEST(Defaults, ATumblingBodyTurnsWithOrderFour) {
    const auto end = [](int steps) {
        auto run = spinning(1.0 / steps,
                            "inertia: {xx: 1, yy: 2, zz: 2.7}, orientation: {axis: [1, 2, 3], angle: 77}, "
                            "angular_velocity: [4, 3, -5]");
        run.finish();
        const auto q = run.pose("b").orientation;
        return Eigen::Vector4d(q[0], q[1], q[2], q[3]);
    };
    const Eigen::Vector4d coarse = end(1024), middle = end(2048), fine = end(4096);
    EXPECT_NEAR(std::log2((coarse - middle).norm() / (middle - fine).norm()), 4.0, 0.05);
}

// ---- Solvers ----

TEST(Defaults, AMissedToleranceIsRepeatedByAuto) {
    const std::string text = brick_stack(4);
    auto run = run_of("solver: {name: pgs, max_iterations: 2}\n" + text);
    run.finish();
    EXPECT_GT(run.simulation.totals().repeated_solves, 0);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
    EXPECT_NEAR(run.pose("b3_1").position[2], 0.35, 1e-9);
}

TEST(Defaults, AnInelasticImpactUnderCoulombsLawDoesNotBounce) {
    auto run = run_of(
        "gravity: [0, 0, 0]\nstep: 0.001\nend: 0.12\nsolver: {name: ssn, law: coulomb}\n"
        "materials: {s: {friction: 0.3, restitution: 0}}\nbodies:\n"
        "- {name: g, fixed: true, shapes: [{plane: {}, material: s}]}\n"
        "- {name: b, mass: 1, position: [0, 0, 0.20087875], velocity: [1, 0, -1], shapes: [{sphere: {radius: 0.1}, "
        "material: s}]}\n");
    run.finish();
    const Vector3 v = run.velocities("b")[0];
    EXPECT_NEAR(v[2], 0.0, 1e-7);
    EXPECT_NEAR(v[0], 5.0 / 7.0, 1e-3);  // μ m u = 0.3 is more than the 2/7 that stops the sliding
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
}

// A block thrown along the ground neither leaves it nor floats, as the associated law has it, and stops after v/(μ g).
TEST(Defaults, ScenesObeyExactCoulomb) {
    const std::string scene =
        "step: 0.00137\nend: 0.5\nmaterials: {m: {friction: 0.37}}\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "- {name: block, density: 1200, position: [0.1, 0.2, 0.05], velocity: [1.234567, -0.5, 0], "
        "shapes: [{box: {size: [0.3, 0.2, 0.1]}, material: m}]}\n";
    auto run = run_of(scene);
    const double speed = std::hypot(1.234567, 0.5), deceleration = 0.37 * 9.81;
    double highest = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        highest = std::max(highest, run.pose("block").position[2]);
    }
    EXPECT_NEAR(highest, 0.05, 1e-8);
    const Vector3 at = run.pose("block").position;
    EXPECT_NEAR(std::hypot(at[0] - 0.1, at[1] - 0.2), 0.5 * speed * speed / deceleration, speed * 0.00137);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
    try {
        run_of("solver: spg\n" + scene);
        FAIL() << "spg knows the associated law only";
    } catch (const Unsupported& refusal) {
        EXPECT_NE(std::string(refusal.what()).find("write \"law: associated\" in \"solver\""), std::string::npos)
            << refusal.what();
    }
    auto named = run_of("integrator: euler_implicit_linearized\nsolver: {name: spg, law: associated}\n" + scene);
    named.simulation.step();
    EXPECT_GT(named.pose("block").position[2], 0.05 + 1e-5);
}

// ---- Chosen steps ----

// A spring of 100 N/m pulls a block of 1 kg over the ground: x = x_e + (0.5 − x_e) cos 10t with x_e = μ m g/k.
TEST(Defaults, SlidingUnderAToleranceTakesFewSteps) {
    auto run = run_of(
        "tolerance: {absolute: 1.0e-3}\nstep: {smallest: 1.0e-7, largest: 0.02}\nend: 0.1\n"
        "materials: {m: {friction: 0.2}}\nbodies:\n- {name: g, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "- {name: b, mass: 1, position: [0.5, 0, 0.05], shapes: [{box: {size: [0.4, 0.4, 0.1]}, material: m}]}\n"
        "springs:\n- {name: s, second: b, first_point: [-5, 0, 0.05], stiffness: 100, rest_length: 5}\n");
    run.finish();
    EXPECT_LT(run.simulation.record().step, 200);
    EXPECT_GE(run.simulation.totals().smallest_step, 1e-7);
    const double rest = 0.2 * 9.81 / 100.0;
    EXPECT_NEAR(run.pose("b").position[0], rest + (0.5 - rest) * std::cos(1.0), 0.02);
    EXPECT_NEAR(run.pose("b").position[2], 0.05, 1e-4);
}

TEST(Defaults, MethodsWhoseReactionsDoNotDecayAreRefused) {
    const std::string pendulum =
        "bodies:\n- {name: bob, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, position: [-1, 0, 0]}\n"
        "joints:\n- {name: hinge, kind: revolute, second: bob, point: [0, 0, 0], axis: [0, 1, 0]}\n";
    const auto refusal = [](const std::string& text) {
        try {
            static_cast<void>(run_of(text));
        } catch (const Unsupported& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_NE(
        refusal("step: 0.01\nend: 1\nintegrator: {name: newmark, options: {gamma: 0.5, beta: 0.1666667}}\n" + pendulum)
            .find("factor 3.73"),
        std::string::npos);
    EXPECT_NE(refusal("tolerance: 1e-3\nend: 1\nintegrator: trapezoidal\n" + pendulum).find("take hht"),
              std::string::npos);
    EXPECT_EQ(refusal("tolerance: 1e-3\nend: 1\nintegrator: hht\n" + pendulum), "");
    EXPECT_EQ(refusal("step: 0.01\nend: 1\nintegrator: trapezoidal\n" + pendulum), "");
}

// A soft block hits the ground at 8 m/s: elements are pressed so far that M + h² K is indefinite at h = 4 ms.
TEST(Defaults, ASoftBlockHitsTheGroundHard) {
    Running run(parse_scene(
        "step: 0.004\nend: 0.4\nbodies: [{name: ground, fixed: true, shapes: [{plane: {}, material: m}]}]\n"
        "materials: {m: {friction: 0.5}}\n"
        "elastic_blocks: [{name: jelly, corner: [0.01, 0.02, 0.512345], edges: [0.2, 0.2, 0.2], cells: [2, 2, 2], "
        "young: "
        "2.0e+4, poisson: 0.4, density: 1000, velocity: [0.3, 0, -8], contact: {radius: 0.004, material: m}}]\n",
        "test"));
    run.finish();
    const auto& totals = run.simulation.totals();
    EXPECT_GT(totals.most_substeps, 1);
    EXPECT_LE(totals.energy, totals.start_energy);
    EXPECT_EQ(totals.unsolved_steps, 0);
    for (std::int32_t node = 0; node < run.system().node_count(); ++node)
        EXPECT_GE(run.system().node_position(run.simulation.state(), node)[2], 0.004 - 1e-4);
}

}  // namespace
}  // namespace delassus::tests::defaults_test
