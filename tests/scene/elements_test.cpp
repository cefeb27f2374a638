// SPDX-License-Identifier: BSD-3-Clause
// Elastic blocks and cables in scene files.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "delassus/error.hpp"
#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::elements_test {
namespace {

const std::string head = "step: 0.001\nend: 0.1\n";
const std::string block = "elastic_blocks:\n  - {name: b, edges: [0.4, 0.2, 0.2], cells: [4, 2, 2], young: 1.0e+6";

std::string refusal(const std::string& yaml) {
    try {
        static_cast<void>(parse_scene(yaml, "s.yaml"));
    } catch (const InputError& error) {
        return error.what();
    }
    return "taken";
}

TEST(ElasticScene, BlockHasItsNodesItsSurfaceAndItsMass) {
    const Scene scene = parse_scene(head + block + ", order: 1, density: 500, fixed_faces: [x_min]}\n", "s.yaml");
    const auto& system = *scene.systems[0].system;
    EXPECT_EQ(system.node_count(), 5 * 3 * 3);
    EXPECT_EQ(system.n(), 3 * 4 * 3 * 3) << "the nodes of one face are fixed";
    // Two triangles for each side of a brick on the surface: 2 (4·2 + 4·2 + 2·2) sides.
    const auto surface = system.element_surface();
    EXPECT_EQ(surface.size(), 80U);
    // Seen from outside: the volume by the divergence theorem is that of the block.
    const State state = system.initial_state();
    double volume = 0.0;
    for (const auto& triangle : surface) {
        const auto a = system.node_position(state, triangle[0]), b = system.node_position(state, triangle[1]),
                   c = system.node_position(state, triangle[2]);
        volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                   a[2] * (b[0] * c[1] - b[1] * c[0])) /
                  6.0;
    }
    EXPECT_NEAR(volume, 0.4 * 0.2 * 0.2, 1e-15);
    MatrixAssembler M;
    M.begin(system.n(), system.n());
    system.add_mass(state, 1.0, M);
    double mass = 0.0;
    for (const double value : M.finish().value) mass += value / 3.0;
    EXPECT_LT(mass, 500 * volume);
    EXPECT_GT(mass, 0.8 * 500 * volume) << "what is missing is the share of the fixed face";
}

TEST(ElasticScene, BlockSlidesAgainstFriction) {
#ifndef DELASSUS_HAS_FCL
    GTEST_SKIP() << "this build has no collision";
#endif
    Scene scene = parse_scene(
        head + "solver: {name: pgs, law: coulomb, tolerance: 1.0e-9}\nmaterials: {rubber: {friction: 0.3}}\n" +
            "bodies:\n  - {name: ground, fixed: true, shapes: [{plane: {}, material: rubber}]}\n" + block +
            ", order: 1, corner: [0, 0, 0.005], damping_time: 0.001, velocity: [1, 0, 0], contact: {radius: 0.005, "
            "material: rubber}}\n",
        "s.yaml");
    const Registry registry;
    Simulation simulation(scene.systems[0], registry);
    const double before = simulation.record().momentum[0];
    while (!simulation.finished()) simulation.step();
    EXPECT_EQ(simulation.totals().unsolved_steps, 0);
    EXPECT_EQ(simulation.totals().most_contacts, 15);
    // μ g t of each kilogram's momentum, while the block settles on the ground.
    EXPECT_NEAR(before - simulation.record().momentum[0], 0.3 * 9.81 * 0.1 * 16.0, 0.02 * 16.0);
}

// examples/scenes/elastic_slide.yaml, coarse: deceleration μ g whatever the modulus, and then rest.
TEST(ElasticScene, BlocksOfAllModuliStopAfterTheSameWay) {
#ifndef DELASSUS_HAS_FCL
    GTEST_SKIP() << "this build has no collision";
#endif
    SceneOverrides overrides;
    for (const std::string system : {"soft", "stiff", "steel"})
        overrides.values.emplace_back("systems." + system + ".elastic_blocks.block.cells", "[4,2,2]");
    for (const std::size_t number : {0U, 1U, 2U}) {
        Running run(read_scene(example_scene("elastic_slide"), overrides), number);
        const std::string name = run.simulation.system().name;
        const double mass = 16.0, start = run.simulation.record().momentum[0];
        while (run.simulation.state().t < 0.1 - 1e-9) run.simulation.step();
        EXPECT_NEAR((start - run.simulation.record().momentum[0]) / mass, 0.3 * 9.81 * 0.1, 0.01 * 0.5) << name;
        run.finish();
        EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << name << ": " << run.simulation.totals().first_unsolved;
        EXPECT_NEAR(run.simulation.record().momentum[0] / mass, 0.0, 0.01 * 0.5) << name;
        EXPECT_LT(run.simulation.totals().worst_penetration, 1e-6) << name;
        double way = 0.0;
        for (std::int32_t node = 0; node < run.system().node_count(); ++node)
            way += run.system().node_position(run.simulation.state(), node)[0] / run.system().node_count();
        EXPECT_NEAR(way - 0.2, 0.5 * 0.5 / (2 * 0.3 * 9.81), 0.02 * 0.0425) << name;
    }
}

// examples/scenes/elastic_stack.yaml, coarse: weight on the ground, and how much each block shrinks.
TEST(ElasticScene, StackStandsAtTheHeightOfItsCompression) {
#ifndef DELASSUS_HAS_FCL
    GTEST_SKIP() << "this build has no collision";
#endif
    SceneOverrides overrides;
    for (const std::string layer : {"rubber", "plastic", "steel"})
        overrides.values.emplace_back("elastic_blocks." + layer + ".cells", "[2,2,2]");
    Running run(read_scene(example_scene("elastic_stack"), overrides));
    double before = 0.0;  // the vertical momentum, a step before the end
    while (!run.simulation.finished()) {
        before = run.simulation.record().momentum[2];
        run.simulation.step();
    }
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << run.simulation.totals().first_unsolved;
    const double plate = 7800 * 0.24 * 0.24 * 0.02, rubber = 1100 * 0.008, plastic = 1200 * 0.008, steel = 7800 * 0.008;
    const auto shrinks = [](double on_it, double own, double young) {
        return (on_it + 0.5 * own) * 9.81 * 0.2 / (young * 0.04);
    };
    const double first = shrinks(3 * plate + plastic + steel, rubber, 1e6);
    const double second = first + shrinks(2 * plate + steel, plastic, 1e9);
    EXPECT_NEAR(run.pose("on_rubber").position[2], 0.22 - first, 0.01 * first);
    EXPECT_NEAR(run.pose("on_plastic").position[2], 0.45 - second, 0.01 * second);
    EXPECT_NEAR(run.pose("on_steel").position[2], 0.68 - second - shrinks(plate, steel, 2e11), 0.01 * second);
    const double weight = (3 * plate + rubber + plastic + steel) * 9.81;
    const double carried = weight + (run.simulation.record().momentum[2] - before) / 0.005;
    EXPECT_NEAR(carried / weight, 1.0, 1e-3);
}

TEST(ElasticScene, CableHangsByItsTension) {
    // A weight of 1 kg on a cable of E A = 1e5 N, 1 m: it settles m g L/(E A) lower.
    Scene scene = parse_scene(
        "step: 0.001\nend: 2\nnodes:\n  - {name: top, fixed: true}\n  - {name: weight, mass: 1, position: [0, 0, -1]}\n"
        "cables:\n  - {name: rope, nodes: [top, weight], young: 1.0e+9, area: 1.0e-4, density: 0, damping_time: "
        "0.01}\n",
        "s.yaml");
    const Registry registry;
    Simulation simulation(scene.systems[0], registry);
    while (!simulation.finished()) simulation.step();
    const auto& system = *scene.systems[0].system;
    EXPECT_NEAR(system.node_position(simulation.state(), 1)[2], -1.0 - 9.81 / 1e5, 1e-9);
    EXPECT_EQ(simulation.totals().plugin_solves, 0) << "no rows, no solver";
}

/// Where the nodes at x = 1 come to rest, less z of the bar's axis: the mean.
double sag(const std::string& load, const std::string& keys = "") {
    const Running run(
        parse_scene("step: 0.01\nend: 0.01\nstart: equilibrium\ngravity: [0, 0, 0]\nelastic_blocks:\n"
                    "  - {name: bar, edges: [1, 0.1, 0.1], cells: [10, 1, 1], young: 1.0e+9, "
                    "poisson: 0, fixed_faces: [x_min]" +
                        keys + "}\nloads:\n  - {name: tip, " + load + "}\n",
                    "s.yaml"));
    double sum = 0.0;
    int count = 0;
    for (std::int32_t node = 0; node < run.system().node_count(); ++node) {
        const Vector3 x = run.system().node_position(run.simulation.state(), node);
        if (x[0] < 0.99) continue;
        sum += x[2] - 0.05;
        ++count;
    }
    return -sum / count;
}

// A box that a hook lowers onto the floor by a cable, whose end weighs little: the cable goes slack.
TEST(ElasticScene, ACableGoesSlackWhereItsLoadLands) {
    for (const double h : {0.002, 0.005, 1.0 / 60.0}) {
        Running run(parse_scene(
            fmt::format(
                "step: {:.17g}\nend: 3\nmaterials: {{m: {{friction: 0.5}}}}\nbodies:\n"
                "- {{name: floor, fixed: true, shapes: [{{plane: {{}}, material: m}}]}}\n"
                "- {{name: hook, motion: {{translation: [0, 0, {{ramp: {{to: -1, start: 0.2, duration: 2, smoothness: "
                "1}}}}]}}, position: [0, 0, 3]}}\n"
                "- {{name: box, mass: 5, position: [0, 0, 0.9], shapes: [{{box: {{size: [0.4, 0.4, 0.4]}}, "
                "material: m}}]}}\n"
                "nodes: [{{name: n0, mass: 0.01, position: [0, 0, 3]}}, {{name: n1, mass: 0.01, position: [0, 0, "
                "1.1]}}]\n"
                "cables: [{{name: c, nodes: [n0, n1], young: 1e9, area: 1e-5, density: 1000, damping_time: 0.01}}]\n"
                "attachments: [{{name: a0, body: hook, node: n0}}, {{name: a1, body: box, node: n1}}]\n",
                h),
            "s.yaml"));
        run.finish();
        EXPECT_NEAR(run.pose("box").position[2], 0.2, 1e-6) << h;
        EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << h;
    }
}

TEST(ElasticScene, ALoadOnAFaceBendsTheBar) {
    const double force = 10.0, inertia = 1e-4 / 12.0;
    const double expected = force / (3.0 * 1e9 * inertia) + force / (5.0 / 6.0 * 0.5e9 * 0.01);
    const double whole = sag("elastic: bar, face: x_max, force: [0, 0, -10]");
    EXPECT_NEAR(whole / expected, 1.0, 0.01);
    EXPECT_NEAR(sag("elastic: bar, box: {lower: [0.99, -1, -1], upper: [2, 1, 1]}, force: [0, 0, -10]"), whole, 1e-12);
    // Linear elements of this size bend half as far at best.
    EXPECT_LT(sag("elastic: bar, face: x_max, force: [0, 0, -10]", ", order: 1"), 0.7 * expected);
}

TEST(ElasticScene, AFaceCarriesAForceBySharesOfItsSides) {
    for (const char* order : {"1", "2"}) {
        const Scene scene = parse_scene(head + block + ", order: " + order + "}\n", "s.yaml");
        const auto& system = *scene.systems[0].system;
        const auto shares = system.spread_over_sides(0, system.node_count(), {{0.399, -1, -1}, {1, 1, 1}});
        double sum = 0.0, y = 0.0, yy = 0.0;
        for (const auto& [node, share] : shares) {
            const Vector3 x = system.node_position(system.initial_state(), node);
            EXPECT_NEAR(x[0], 0.4, 1e-12);
            sum += share;
            y += share * x[1];
            yy += share * x[1] * x[1];
        }
        EXPECT_NEAR(sum, 1.0, 1e-14);
        EXPECT_NEAR(y, 0.1, 1e-14);
        // ∫ y² over an edge of 0.2, exact where displacements are quadratic.
        if (order[0] == '2') {
            EXPECT_NEAR(yy, 0.04 / 3.0, 1e-14);
        }
    }
}

TEST(ElasticScene, ALoadOnANodeAcceleratesIt) {
    Running run(
        parse_scene("step: 0.001\nend: 0.1\ngravity: [0, 0, 0]\nnodes: [{name: p, mass: 2}]\n"
                    "loads: [{name: push, node: p, force: [3, 0, {linear: {rate: 20}}]}]\n",
                    "s.yaml"));
    run.finish();
    EXPECT_NEAR(run.simulation.state().v[0], 3.0 / 2.0 * 0.1, 1e-12);
    EXPECT_NEAR(run.simulation.state().v[2], 20.0 / 2.0 * 0.005, 6e-4) << "an order-1 method";
}

TEST(ElasticScene, WrongLoadsAreToldInOneSentence) {
    const auto load = [](const std::string& keys) {
        return refusal(head + "bodies: [{name: c, density: 1, shapes: [{sphere: {radius: 1}}]}]\n" + block +
                       "}\nloads:\n  - {name: f, " + keys + "}\n");
    };
    EXPECT_EQ(load("elastic: b, face: x_max, force: [1, 0, 0]"), "taken");
    EXPECT_EQ(load("force: [1, 0, 0]"), "s.yaml, line 7: load \"f\" needs one of \"body\", \"node\" and \"elastic\"");
    EXPECT_EQ(load("body: c, elastic: b"),
              "s.yaml, line 7: load \"f\" needs one of \"body\", \"node\" and \"elastic\"");
    EXPECT_EQ(
        load("elastic: bb, face: x_max"),
        "s.yaml, line 7: \"elastic\" names \"bb\", but there is no such elastic block or mesh; did you mean \"b\"?");
    EXPECT_EQ(load("elastic: b"), "s.yaml, line 7: the load on \"b\" needs one of \"face\" and \"box\"");
    EXPECT_EQ(load("elastic: b, face: x_mox"), "s.yaml, line 7: there is no face \"x_mox\"; did you mean \"x_max\"?");
    EXPECT_EQ(load("elastic: b, box: {lower: [5, 5, 5], upper: [6, 6, 6]}"),
              "s.yaml, line 7: no side of an element lies in the box");
    EXPECT_EQ(load("elastic: b, face: x_max, torque: [1, 0, 0]"),
              "s.yaml, line 7: load \"f\" acts on nodes, which take no \"torque\"");
    EXPECT_EQ(load("body: c, face: x_max"), "s.yaml, line 7: \"face\" and \"box\" of load \"f\" need \"elastic\"");
    EXPECT_EQ(load("node: q"), "s.yaml, line 7: \"node\" names \"q\", but there is no such node; there are none");
}

// Beyond the speed of its waves, √(E/ρ), an impact folds a block up, of which its linear material knows nothing.
TEST(ElasticScene, ElementsThatTurnInsideOutAreTold) {
    const auto turned = [](double speed) {
        Running run(parse_scene(
            fmt::format("step: 0.003\nend: 0.12\nmaterials: {{m: {{friction: 0.5}}}}\nbodies: [{{name: ground, fixed: "
                        "true, shapes: [{{plane: {{}}, material: m}}]}}]\nelastic_blocks: [{{name: jelly, corner: [0, "
                        "0, 0.05], edges: [0.2, 0.2, 0.2], cells: [2, 2, 2], young: 3.0e+4, poisson: 0.4, density: "
                        "1000, velocity: [0, 0, {}], contact: {{radius: 0.004, material: m}}}}]\n",
                        -speed),
            "s.yaml"));
        run.finish();
        std::int64_t sentences = 0;
        for (const std::string& warning : run.simulation.warnings())
            sentences += warning.find("turned inside out") == std::string::npos ? 0 : 1;
        EXPECT_EQ(sentences, run.simulation.totals().most_inverted > 0 ? 1 : 0);
        return run.simulation.totals().most_inverted;
    };
    EXPECT_EQ(turned(0.3), 0);
    EXPECT_GT(turned(9.0), 0);
}

TEST(ElasticScene, WrongOnesAreToldInOneSentence) {
    EXPECT_EQ(refusal(head + block + ", yong: 1}\n"),
              "s.yaml, line 4: an elastic block has no key \"yong\"; did you mean \"young\"?");
    EXPECT_EQ(refusal(head + block + ", fixed_faces: [x_mn]}\n"),
              "s.yaml, line 4: there is no face \"x_mn\"; did you mean \"x_min\"?");
    EXPECT_EQ(refusal(head + block + ", model: corotationl}\n"),
              "s.yaml, line 4: there is no element model \"corotationl\"; did you mean \"corotational\"?");
    EXPECT_EQ(refusal(head + block + ", order: 3}\n"), "s.yaml, line 4: \"order\" is 3; elements have order 1 or 2");
    EXPECT_EQ(refusal(head + block + ", contact: {radius: 0.1}}\n"),
              "s.yaml, line 4: \"contact\" lacks the key \"material\"");
    EXPECT_EQ(refusal(head + "elastic_blocks:\n  - {name: b, edges: [1, 1, 1]}\n"),
              "s.yaml, line 4: elastic block \"b\" lacks the key \"cells\"");
    EXPECT_EQ(refusal(head + "elastic_blocks:\n  - {name: b, edges: [1, 0, 1], cells: [1, 1, 1]}\n"),
              "s.yaml, line 4: the edges of the elastic block \"b\" must be positive and finite");
    EXPECT_EQ(refusal(head + block + ", poisson: 0.5}\n"),
              "s.yaml, line 4: Poisson's ratio is 0.5; it must lie between -1 and 0.5");
    EXPECT_EQ(refusal(head + "nodes: [{name: a, mass: 1}]\ncables: [{name: c, nodes: [a, b]}]\n"),
              "s.yaml, line 4: \"nodes\" names \"b\", but there is no such node; did you mean \"a\"?");
}

}  // namespace
}  // namespace delassus::tests::elements_test
