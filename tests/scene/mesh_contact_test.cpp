// SPDX-License-Identifier: BSD-3-Clause
// Elastic meshes that touch one another, held against closed forms.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::mesh_contact_test {
namespace {

#ifdef DELASSUS_HAS_FCL
constexpr bool has_collision = true;
#else
constexpr bool has_collision = false;
#endif

/// Nodes first … first + count − 1 of a system: those of one block.
struct Nodes {
    std::int32_t first = 0, count = 0;
};

Vector3 mean_position(const Running& run, const Nodes& nodes) {
    Vector3 sum{};
    for (auto node = nodes.first; node < nodes.first + nodes.count; ++node) {
        const auto at = run.system().node_position(run.simulation.state(), node);
        for (std::size_t i = 0; i < 3; ++i) sum[i] += at[i] / nodes.count;
    }
    return sum;
}

std::int32_t nodes_of(const std::array<std::int32_t, 3>& cells, int order) {
    return (order * cells[0] + 1) * (order * cells[1] + 1) * (order * cells[2] + 1);
}

/// The force of the first system's contacts on what lies above `height`, N: each acts on the side that its normal
/// points to.
double vertical_force(const Running& run) {
    double sum = 0.0;
    for (const auto& contact : run.simulation.contacts()) sum += std::abs(contact.force[2]);
    return sum;
}

// ---- The patch test: two blocks are pressed by a uniform pressure of 10 kPa, E = 1 MPa, ν = 0 ----

struct Patch {
    double strain = 0.0;     ///< largest error of a node's displacement over that of the top
    double shrinkage = 0.0;  ///< error of the mean displacement of the top, likewise
    double force = 0.0;      ///< error of the resultant through the interface over the load
};

Patch patch(std::int32_t below, std::int32_t above, int order, double tolerance) {
    Running run(parse_scene(
        fmt::format("step: 0.01\nend: 1\ngravity: [0, 0, 0]\nsolver: {{name: ssn, law: coulomb, tolerance: {0}}}\n"
                    "materials: {{m: {{friction: 0.3}}}}\nelastic_blocks:\n"
                    "  - {{name: low, edges: [0.2, 0.2, 0.2], cells: [{1}, {1}, {1}], order: {3}, young: 1.0e+6, "
                    "poisson: 0, damping_time: 0.02, fixed_faces: [z_min], contact: {{radius: 0.002, material: m}}}}\n"
                    "  - {{name: up, corner: [0, 0, 0.204], edges: [0.2, 0.2, 0.2], cells: [{2}, {2}, {2}], "
                    "order: {3}, young: 1.0e+6, poisson: 0, damping_time: 0.02, contact: {{radius: 0.002, "
                    "material: m}}}}\nloads: [{{name: p, elastic: up, face: z_max, force: [0, 0, -400]}}]\n",
                    tolerance, below, above, order),
        "patch"));
    const State start = run.simulation.state();
    run.finish();
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << run.simulation.totals().first_unsolved;
    EXPECT_LT(run.simulation.totals().worst_penetration, 1e-6);
    Patch result;
    double top = 0.0;
    int of_top = 0;
    for (std::int32_t node = 0; node < run.system().node_count(); ++node) {
        const double z = run.system().node_position(start, node)[2];
        const double moved = run.system().node_position(run.simulation.state(), node)[2] - z;
        const double exact = -0.01 * (z < 0.2001 ? z : z - 0.004);
        result.strain = std::max(result.strain, std::abs(moved - exact) / 0.004);
        if (z > 0.4039) {
            top += moved;
            ++of_top;
        }
    }
    result.shrinkage = std::abs(top / of_top + 0.004) / 0.004;
    result.force = std::abs(vertical_force(run) - 400.0) / 400.0;
    return result;
}

TEST(MeshContactScene, PatchOfMatchingMeshesIsUniform) {
    for (const int order : {1, 2}) {
        const Patch of = patch(2, 2, order, 1e-10);
        EXPECT_LT(of.strain, 1e-6) << order;
        EXPECT_LT(of.shrinkage, 1e-6) << order;
        EXPECT_LT(of.force, 1e-6) << order;
    }
}

TEST(MeshContactScene, PatchOfLinearMeshesThatDoNotMatchIsUniform) {
    const Patch of = patch(2, 3, 1, 1e-10);
    EXPECT_LT(of.strain, 1e-6);
    EXPECT_LT(of.shrinkage, 1e-6);
    EXPECT_LT(of.force, 1e-6);
}

TEST(MeshContactScene, PatchOfQuadraticMeshesThatDoNotMatchIsNearlyUniform) {
    const Patch of = patch(2, 3, 2, 1e-9);
    EXPECT_LT(of.strain, 5e-3);
    EXPECT_LT(of.shrinkage, 5e-4);
    EXPECT_LT(of.force, 1e-6);
}

// ---- A soft block on an elastic slope ----

/// Gravity is turned in place of the slope.
Running on_slope(double angle, int order, double end) {
    return Running(parse_scene(
        fmt::format("step: 0.002\nend: {}\ngravity: [{:.9g}, 0, {:.9g}]\nmaterials: {{m: {{friction: 0.3}}}}\n"
                    "elastic_blocks:\n  - {{name: slope, edges: [0.6, 0.2, 0.1], cells: [6, 2, 1], order: {}, "
                    "young: 1.0e+7, damping_time: 1.0e-3, fixed_faces: [z_min], contact: {{radius: 0.002, material: "
                    "m}}}}\n  - {{name: soft, corner: [0.051234, 0.0712345, 0.104], edges: [0.1, 0.07, 0.06], cells: "
                    "[2, 2, 2], order: 1, young: 5.0e+5, damping_time: 5.0e-3, contact: {{radius: 0.002, material: "
                    "m}}}}\n",
                    end, 9.81 * std::sin(angle), -9.81 * std::cos(angle), order),
        "slope"));
}

TEST(MeshContactScene, ABlockSticksOnASlopeBelowItsAngleOfFriction) {
    if (!has_collision) GTEST_SKIP() << "this build has no collision";
    Running run = on_slope(std::atan(0.27), 1, 0.6);
    const auto below = nodes_of({6, 2, 1}, 1);
    while (run.simulation.state().t < 0.4 - 1e-9) run.simulation.step();
    const double settled = mean_position(run, {below, 27})[0];
    run.finish();
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << run.simulation.totals().first_unsolved;
    EXPECT_NEAR(mean_position(run, {below, 27})[0], settled, 1e-6);
}

TEST(MeshContactScene, ABlockSlidesDownASlopeAsARigidOne) {
    if (!has_collision) GTEST_SKIP() << "this build has no collision";
    const double angle = 0.45, g = 9.81, acceleration = g * (std::sin(angle) - 0.3 * std::cos(angle));
    for (const int order : {1, 2}) {
        Running run = on_slope(angle, order, 0.4);
        const auto below = nodes_of({6, 2, 1}, order);
        const double mass = 1000 * 0.1 * 0.07 * 0.06;
        // The slope hardly moves: the momentum is the block's.
        while (run.simulation.state().t < 0.2 - 1e-9) run.simulation.step();
        const double before = run.simulation.record().momentum[0], at = mean_position(run, {below, 27})[0];
        run.finish();
        EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << run.simulation.totals().first_unsolved;
        EXPECT_NEAR((run.simulation.record().momentum[0] - before) / (0.2 * mass), acceleration, 0.01 * acceleration);
        EXPECT_NEAR(mean_position(run, {below, 27})[0] - at, 0.5 * acceleration * (0.16 - 0.04),
                    0.01 * 0.5 * acceleration * 0.12)
            << order;
        EXPECT_LT(run.simulation.totals().worst_penetration, 1e-6);
    }
}

// ---- examples/scenes/elastic_contact.yaml ----

TEST(MeshContactScene, ThreePressedBlocksShrinkByTheirLoads) {
    Running run(read_scene(example_scene("elastic_contact")), 0);
    const auto start = run.simulation.state();
    run.finish();
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << run.simulation.totals().first_unsolved;
    double top = 0.0;
    int nodes = 0;
    for (std::int32_t node = 0; node < run.system().node_count(); ++node) {
        const double z = run.system().node_position(start, node)[2];
        if (z < 0.3079) continue;
        top += run.system().node_position(run.simulation.state(), node)[2] - z;
        ++nodes;
    }
    EXPECT_EQ(nodes, 16);
    EXPECT_NEAR(top / nodes, -2.001e-3, 1e-3 * 2e-3);
    EXPECT_NEAR(vertical_force(run), 2 * 400.0, 1e-3 * 400.0) << "through each of two interfaces";
    EXPECT_LT(run.simulation.totals().worst_penetration, 1e-6);
}

TEST(MeshContactScene, TheExampleOfASlopeSlides) {
    if (!has_collision) GTEST_SKIP() << "this build has no collision";
    Running run(read_scene(example_scene("elastic_contact")), 1);
    while (run.simulation.state().t < 0.2 - 1e-9) run.simulation.step();
    const double before = run.simulation.record().momentum[0];
    run.finish();
    EXPECT_NEAR((run.simulation.record().momentum[0] - before) / (0.2 * 0.42), 1.1095, 0.01 * 1.1095);
}

// ---- Impacts ----

// Corner first, off-centre, nothing else about: momentum is kept to rounding, energy never grows.
TEST(MeshContactScene, BlocksThrownAtEachOtherKeepTheirMomentum) {
    Running run(parse_scene(
        "step: 0.001\nend: 0.15\ngravity: [0, 0, 0]\nmaterials: {m: {friction: 0.4}}\nelastic_blocks:\n"
        "  - {name: a, corner: [-0.25, 0, 0], edges: [0.2, 0.2, 0.2], cells: [2, 2, 2], order: 1, young: 1.0e+6, "
        "velocity: [3, 0.1, 0.2], contact: {radius: 0.003, material: m}}\n"
        "  - {name: b, corner: [0.0234, 0.1212, 0.134], edges: [0.15, 0.15, 0.15], cells: [3, 3, 3], order: 1, "
        "young: 1.0e+6, velocity: [-2, 0, 0], contact: {radius: 0.003, material: m}}\n",
        "throw"));
    const auto start = run.simulation.record().momentum;
    double energy = run.simulation.record().energy;
    std::int64_t most = 0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(run.simulation.record().momentum[i], start[i], 1e-10);
        EXPECT_LT(run.simulation.record().energy, energy + 1e-9);
        energy = run.simulation.record().energy;
        most = std::max(most, run.simulation.record().contacts);
    }
    EXPECT_GT(most, 3);
    EXPECT_EQ(run.simulation.record().contacts, 0) << "they part";
    const double a = mean_position(run, {0, 27})[0], b = mean_position(run, {27, 64})[0];
    EXPECT_LT(a, b - 0.15) << "neither went through the other";
}

TEST(MeshContactScene, ABlockDroppedOnABlockComesToRest) {
    if (!has_collision) GTEST_SKIP() << "this build has no collision";
    Running run(parse_scene(
        "step: 0.004\nend: 0.8\nmaterials: {m: {friction: 0.4}}\nelastic_blocks:\n"
        "  - {name: low, edges: [0.4, 0.4, 0.1], cells: [4, 4, 1], order: 1, young: 1.0e+6, damping_time: 0.002, "
        "fixed_faces: [z_min], contact: {radius: 0.002, material: m}}\n"
        "  - {name: up, corner: [0.117, 0.123456, 0.154321], edges: [0.1, 0.13, 0.07], cells: [2, 2, 2], young: "
        "5.0e+5, damping_time: 0.005, velocity: [0.2, 0, 0], contact: {radius: 0.002, material: m}}\n",
        "drop"));
    double energy = run.simulation.record().energy;
    while (!run.simulation.finished()) {
        run.simulation.step();
        EXPECT_LT(run.simulation.record().energy, energy + 1e-7);
        energy = run.simulation.record().energy;
    }
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << run.simulation.totals().first_unsolved;
    EXPECT_LT(run.simulation.record().penetration, 1e-6);
    EXPECT_NEAR(vertical_force(run), 1000 * 0.1 * 0.13 * 0.07 * 9.81, 1e-4 * 8.93);
    for (const double speed : run.simulation.state().v) EXPECT_NEAR(speed, 0.0, 1e-5);
}

// Two equal bars of length L meet head on with ±v. By the theory of waves the force between them is ρ c v A for the
// time 2 L/c, c² = E/ρ, and then they part with their velocities exchanged. Here ρ c v A = 250 N and 2 L/c = 20 ms.
// Implicit Euler damps what oscillates: the ringing of a sharp front on a mesh ends as 4 % of the speed.
TEST(MeshContactScene, EqualBarsExchangeTheirVelocities) {
    Running run(parse_scene(
        "step: 1.0e-4\nend: 0.025\ngravity: [0, 0, 0]\nmaterials: {m: {}}\nelastic_blocks:\n"
        "  - {name: left, corner: [-1.0005, 0, 0], edges: [1, 0.05, 0.05], cells: [20, 1, 1], order: 1, young: "
        "1.0e+7, poisson: 0, velocity: [1, 0, 0], contact: {radius: 0.0005, material: m}}\n"
        "  - {name: right, corner: [0.0005, 0, 0], edges: [1, 0.05, 0.05], cells: [20, 1, 1], order: 1, young: "
        "1.0e+7, poisson: 0, velocity: [-1, 0, 0], contact: {radius: 0.0005, material: m}}\n",
        "bars"));
    double impulse = 0.0, last = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        double force = 0.0;
        for (const auto& contact : run.simulation.contacts()) force += std::abs(contact.force[0]);
        impulse += 1e-4 * force;
        const double t = run.simulation.state().t;
        if (force > 1.0) last = t;
        if (t > 0.005 && t < 0.015) {
            EXPECT_NEAR(force, 250.0, 0.03 * 250.0) << t;
        }
    }
    EXPECT_NEAR(last, 0.020, 0.05 * 0.020);
    EXPECT_NEAR(impulse, 2.0 * 2.5, 0.1 * 5.0);
    EXPECT_NEAR(run.simulation.record().momentum[0], 0.0, 1e-12);
    EXPECT_GT(run.simulation.record().energy / 2.5, 0.8);
    EXPECT_LE(run.simulation.record().energy / 2.5, 1.0);
}

// A step takes the block 100 mm far; the wall is 20 mm thick.
TEST(MeshContactScene, AFastBlockDoesNotGoThroughAThinOne) {
    for (const double x : {-0.5, -0.531234, -0.567891}) {
        Running run(parse_scene(
            fmt::format("step: 0.005\nend: 0.06\ngravity: [0, 0, 0]\nmaterials: {{m: {{friction: 0.4}}}}\n"
                        "elastic_blocks:\n  - {{name: wall, edges: [0.02, 0.2, 0.2], cells: [1, 2, 2], order: 1, "
                        "young: 1.0e+8, contact: {{radius: 0.002, material: m}}}}\n  - {{name: shot, corner: [{}, "
                        "0.0712, 0.05321], edges: [0.06, 0.06, 0.06], cells: [2, 2, 2], order: 1, young: 1.0e+8, "
                        "velocity: [20, 0, 0], contact: {{radius: 0.002, material: m}}}}\n",
                        x),
            "shot"));
        run.finish();
        EXPECT_LT(mean_position(run, {18, 27})[0], mean_position(run, {0, 18})[0]) << x;
        EXPECT_GT(mean_position(run, {0, 18})[0], 0.05) << "the wall flies on";
    }
}

// ---- The rest of the program ----

TEST(MeshContactScene, WorksWithEveryMethodThatTakesContacts) {
    for (const std::string method :
         {"euler_implicit_linearized", "moreau_jean", "linearly_implicit_trapezoidal", "nonsmooth_generalized_alpha"}) {
        Running run(parse_scene(
            "step: 0.002\nend: 0.2\nintegrator: " + method +
                "\nmaterials: {m: {friction: 0.4}}\nelastic_blocks:\n"
                "  - {name: low, edges: [0.2, 0.2, 0.1], cells: [2, 2, 1], order: 1, young: 1.0e+6, damping_time: "
                "0.005, fixed_faces: [z_min], contact: {radius: 0.002, material: m}}\n"
                "  - {name: up, corner: [0.03, 0.04, 0.105], edges: [0.1, 0.1, 0.1], cells: [1, 1, 1], order: 1, "
                "young: 1.0e+6, damping_time: 0.005, contact: {radius: 0.002, material: m}}\n",
            "methods"));
        run.finish();
        EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << method;
        EXPECT_NEAR(mean_position(run, {18, 8})[2], 0.154, 1e-3) << method;
        EXPECT_NEAR(vertical_force(run), 9.81, 0.02 * 9.81) << method;
        EXPECT_LT(run.simulation.record().penetration, 1e-5) << method;
    }
}

TEST(MeshContactScene, PilesFallAsleepAsOnePart) {
    if (!has_collision) GTEST_SKIP() << "this build has no collision";
    const std::string blocks =
        "  - {name: low, edges: [0.2, 0.2, 0.1], cells: [1, 1, 1], order: 1, young: 1.0e+6, damping_time: 0.01, "
        "fixed_faces: [z_min], contact: {radius: 0.002, material: m}}\n"
        "  - {name: up, corner: [0.03, 0.04, 0.104], edges: [0.1, 0.1, 0.1], cells: [1, 1, 1], order: 1, young: "
        "1.0e+6, damping_time: 0.01, contact: {radius: 0.002, material: m}}\n";
    Running run(parse_scene(
        "step: 0.005\nend: 1.5\nsleeping: true\nmaterials: {m: {friction: 0.4}}\nelastic_blocks:\n" + blocks, "sleep"));
    run.finish();
    EXPECT_EQ(run.simulation.record().sleeping, 4 + 8) << "all nodes that move";
    EXPECT_GT(run.simulation.totals().resting_parts, 0);
}

TEST(MeshContactScene, ThePlanKnowsThem) {
    Scene scene = read_scene(example_scene("elastic_contact"));
    const SystemPlan plan = make_plan(scene, registry()).at(0);
    const auto named = [](const std::vector<PlanLine>& lines, const std::string& what) {
        return std::any_of(lines.begin(), lines.end(), [&](const PlanLine& line) { return line.what == what; });
    };
    EXPECT_TRUE(named(plan.kept, "contacts between meshes"));
    EXPECT_TRUE(named(plan.left_out, "collision detection")) << "no body has a shape";
    EXPECT_EQ(std::count(plan.libraries.begin(), plan.libraries.end(), "delassus_collision.so"), 0);
    EXPECT_FALSE(plan.solvers.empty());
}

TEST(MeshContactScene, InitialVelocitiesOfFacesAndBoxes) {
    const std::string head =
        "step: 0.001\nend: 0.01\ngravity: [0, 0, 0]\nelastic_blocks:\n  - {name: b, edges: [0.4, 0.2, 0.2], cells: "
        "[2, 1, 1], order: 1}\ninitial_velocities:\n";
    const auto momentum = [&](const std::string& item) {
        return Running(parse_scene(head + "  - {elastic: b, " + item + "}\n", "v")).simulation.record().momentum;
    };
    // A quarter of the mass of 16 kg is at the nodes of an end.
    EXPECT_NEAR(momentum("face: x_max, velocity: [0, 0, 2]")[2], 8.0, 1e-12);
    EXPECT_NEAR(momentum("box: {lower: [0.1, -1, -1], upper: [0.3, 1, 1]}, velocity: [3, 0, 0]")[0], 24.0, 1e-12);
    const auto refusal = [&](const std::string& item) {
        try {
            static_cast<void>(parse_scene(head + "  - {" + item + "}\n", "v.yaml"));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("taken");
    };
    EXPECT_NE(refusal("elastic: b, face: x_max").find("lacks the key \"velocity\""), std::string::npos);
    EXPECT_NE(refusal("elastic: b, velocity: [1, 0, 0]").find("needs one of \"face\" and \"box\""), std::string::npos);
    EXPECT_NE(refusal("elastic: b, box: {lower: [5, 5, 5], upper: [6, 6, 6]}, velocity: [1, 0, 0]").find("no node"),
              std::string::npos);
}

}  // namespace
}  // namespace delassus::tests::mesh_contact_test
