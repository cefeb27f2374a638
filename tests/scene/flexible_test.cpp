// SPDX-License-Identifier: BSD-3-Clause
// The example scenes with beams and with meshes from files against what their heads say is known, and what is said of
// wrong beams and meshes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "delassus/error.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::flexible_test {
namespace {

constexpr double pi = std::numbers::pi;

TEST(FlexibleScene, CantileverIsTheElastica) {
    Running run(read_scene(example_scene("fe_beam")), 0);
    run.finish();
    const auto tip = run.pose("beam_16").position;
    RecordProperty("tip", std::to_string(tip[0]) + " " + std::to_string(tip[2]));
    EXPECT_NEAR(-tip[2], 0.30172, 5e-4);
    EXPECT_NEAR(1.0 - tip[0], 0.05643, 5e-4);
    for (const double v : run.simulation.state().v) EXPECT_NEAR(v, 0.0, 1e-6);
    EXPECT_EQ(run.simulation.totals().plugin_solves, 0) << "no rows, no solver";
}

TEST(FlexibleScene, CantileverSwingsByItsModes) {
    Running run(read_scene(example_scene("fe_beam")), 1);
    run.finish();
    const double rest = 1.0 / (3.0 * 2e11 * 1e-8 / 12.0);
    RecordProperty("ratio", std::to_string(-run.pose("beam_16").position[2] / rest));
    EXPECT_NEAR(-run.pose("beam_16").position[2] / rest, 1.95, 0.02);
}

struct SliderCrank {
    double slider = 0.0;      ///< off the rigid one's, m
    double deflection = 0.0;  ///< of the rod's middle from the line between its ends, towards +y, m
};

SliderCrank slider_crank(double young) {
    SceneOverrides overrides;
    overrides.values = {{"beams.rod.young", std::to_string(young)}};
    Running run(read_scene(example_scene("flexible_slider_crank"), overrides));
    SliderCrank result;
    while (!run.simulation.finished()) {
        run.simulation.step();
        const double phi = 10.0 * pi * run.simulation.state().t;
        const double x = 0.1 * std::cos(phi) + std::sqrt(0.09 - std::pow(0.1 * std::sin(phi), 2));
        result.slider = std::max(result.slider, std::abs(run.pose("slider").position[0] - x));
    }
    const auto from = run.pose("rod_0").position, middle = run.pose("rod_4").position, to = run.pose("rod_8").position;
    const double dx = to[0] - from[0], dy = to[1] - from[1];
    result.deflection = (dx * (middle[1] - from[1]) - dy * (middle[0] - from[0])) / std::hypot(dx, dy);
    EXPECT_LT(run.simulation.totals().worst_drift, 1e-9);
    return result;
}

TEST(FlexibleScene, RodOfTheSliderCrankBendsByItsInertia) {
    // At φ = 90° the crank pin has the acceleration −r Ω² along y; the slider's is along x, r² Ω²/√(l² − r²).
    const double r = 0.1, l = 0.3, speed = 10.0 * pi, area = 2.5e-5, inertia = area * area / 12.0;
    const double across = std::sqrt(l * l - r * r) / l, along = r / l;  // cosine and sine of the rod's slope
    const double a0 = r * speed * speed * across;
    // The normal to the rod is (sin, cos) for a slope downwards.
    const double a1 = -r * r * speed * speed / std::sqrt(l * l - r * r) * along;
    const SliderCrank steel = slider_crank(2e11), stiff = slider_crank(2e12);
    const auto quasi_static = [&](double young) {
        return 5.0 * 7800.0 * area * (a0 + a1) * std::pow(l, 4) / (768.0 * young * inertia);
    };
    RecordProperty("deflection", std::to_string(steel.deflection / quasi_static(2e11)) + " of the quasi-static one");
    RecordProperty("slider", std::to_string(1e6 * steel.slider) + " and " + std::to_string(1e6 * stiff.slider) + " um");
    EXPECT_NEAR(steel.deflection / quasi_static(2e11), 1.0, 0.05);
    EXPECT_NEAR(stiff.deflection / quasi_static(2e12), 1.0, 0.05);
    EXPECT_LT(steel.slider, 1e-5);
    EXPECT_LT(stiff.slider, 0.3 * steel.slider);
}

#if defined(DELASSUS_HAS_FCL) && defined(DELASSUS_HAS_ASSIMP)
TEST(FlexibleScene, DieRestsOnAFace) {
    Running run(read_scene(example_scene("mesh_die")));
    const double edge = 0.1, root = std::sqrt(5.0);
    EXPECT_NEAR(run.system().body(1).mass, 1800.0 * 5.0 * (3.0 + root) / 12.0 * std::pow(edge, 3), 1e-5);
    run.finish();
    EXPECT_NEAR(run.pose("die").position[2], std::sqrt(3.0) / 12.0 * (3.0 + root) * edge, 1e-5);
    for (const auto& part : run.velocities("die"))
        for (const double v : part) EXPECT_NEAR(v, 0.0, 1e-6);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
}
#endif

#ifdef DELASSUS_HAS_NETGEN
TEST(FlexibleScene, BarStretchesUnderItsWeight) {
    Running run(read_scene(example_scene("hanging_bar")));
    const auto& system = run.system();
    const State start = run.simulation.state();
    run.finish();
    double way = 0.0;
    int ends = 0;
    for (std::int32_t node = 0; node < system.node_count(); ++node) {
        const double before = system.node_position(start, node)[2];
        if (before > 1e-9) continue;
        way += before - system.node_position(run.simulation.state(), node)[2];
        ++ends;
    }
    EXPECT_EQ(ends, 25) << "9 vertices, and the middles of the edges between them";
    RecordProperty("ratio", std::to_string(way / ends / 4.905e-3));
    EXPECT_NEAR(way / ends / 4.905e-3, 1.0, 0.02);
}
#endif

TEST(FlexibleScene, AWeightThatNodesCarryBendsTheArm) {
    Running run(read_scene(example_scene("elastic_arm")));
    const double length = 0.55, width = 0.04, young = 2e8, poisson = 0.3, behind = 0.05, force = 0.5 * 9.81;
    const double area = width * width, bending = young * area * area / 12.0, own = 200.0 * area * 9.81;
    const double shear = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson) * young / (2.0 * (1.0 + poisson)) * area;
    const double square = length * length, cube = square * length;
    const double sag = force * cube / (3.0 * bending) + force * behind * square / (2.0 * bending) +
                       force * length / shear + own * square * square / (8.0 * bending) + own * square / (2.0 * shear);
    const double angle =
        force * square / (2.0 * bending) + force * behind * length / bending + own * cube / (6.0 * bending);
    const double expected = sag + behind * angle;
    EXPECT_NEAR((1.0 - run.pose("weight").position[2]) / expected, 1.0, 0.02);
    const double before = run.pose("weight").position[2];
    run.finish();
    EXPECT_NEAR(run.pose("weight").position[2], before, 1e-9);
}

std::string refusal(const std::string& text) {
    try {
        static_cast<void>(parse_scene("step: 0.001\nend: 0.1\n" + text, "s.yaml"));
    } catch (const InputError& error) {
        return error.what();
    }
    return "taken";
}

/// Six elements with a consistent mass, which tumble.
std::string tumbling_beam(const std::string& more) {
    return "step: 0.000513\nend: 0.2\n" + more +
           "beams:\n  - {name: rod, from: [0, 0, 0.5], to: [1.037, 0.113, 0.7], elements: 6, young: 1.0e+8, density: "
           "1000, section: {rectangle: [0.03, 0.02]}, mass: consistent, velocity: [0.1, 0, 1], angular_velocity: [3, "
           "-7, "
           "4]}\n";
}

TEST(FlexibleScene, AFreeBeamWithAConsistentMassKeepsEnergyAndMomentum) {
    struct Case {
        const char* integrator;
        double energy;  // share that may be lost or won
    };
    for (const auto& [integrator, energy] :
         {Case{"trapezoidal", 1e-5}, Case{"generalized_alpha", 1e-5}, Case{"moreau_jean", 1e-5},
          Case{"linearly_implicit_trapezoidal", 1e-4}, Case{"euler_implicit_linearized", 0.02}}) {
        Running run(parse_scene(tumbling_beam(fmt::format("gravity: [0, 0, 0]\nintegrator: {}\n", integrator)), "s"));
        const auto start = run.simulation.record();
        run.finish();
        const auto end = run.simulation.record();
        const double before = run.system().energy(run.system().initial_state()),
                     after = run.system().energy(run.simulation.state());
        EXPECT_NEAR(after, before, energy * before) << integrator;
        const double size = std::sqrt(start.angular_momentum[0] * start.angular_momentum[0] +
                                      start.angular_momentum[1] * start.angular_momentum[1] +
                                      start.angular_momentum[2] * start.angular_momentum[2]);
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_NEAR(end.momentum[i], start.momentum[i], 1e-8) << integrator;
            EXPECT_NEAR(end.angular_momentum[i], start.angular_momentum[i], 0.02 * size) << integrator;
        }
    }
}

TEST(FlexibleScene, AConsistentMassTakesJointsAndContactsAndRefusesJointCoordinates) {
    const std::string hinge =
        "joints: [{name: h, kind: revolute, second: rod_0, point: [0, 0, 0.5], axis: [0, 1, 0]}]\n";
    const Scene chosen = parse_scene(tumbling_beam("") + hinge, "s");
    EXPECT_EQ(chosen.systems.at(0).coordinates, Coordinates::Maximal);
    EXPECT_THROW(Running(parse_scene(tumbling_beam("coordinates: joint\nintegrator: euler_implicit\n") + hinge, "s")),
                 Unsupported);
#ifdef DELASSUS_HAS_FCL
    // It lies down on the ground, and its weight is carried.
    Running run(
        parse_scene("step: 0.00073\nend: 1.5\nbeams:\n  - {name: rod, from: [0, 0, 0.2], to: [1.037, 0.113, 0.3], "
                    "elements: 3, young: 1.0e+9, density: 1000, section: {rectangle: [0.03, 0.02]}, mass: "
                    "consistent, damping_time: 0.002}\nbodies:\n"
                    "  - {name: ground, fixed: true, shapes: [{plane: {}}]}\n"
                    "  - {name: a, mass: 0.3, position: [0, 0, 0.2], shapes: [{sphere: {radius: 0.05}}]}\n"
                    "  - {name: b, mass: 0.3, position: [1.037, 0.113, 0.3], shapes: [{sphere: {radius: 0.05}}]}\n"
                    "joints:\n  - {name: j, kind: fixed, first: rod_0, second: a, point: [0, 0, 0.2]}\n"
                    "  - {name: k, kind: fixed, first: rod_3, second: b, point: [1.037, 0.113, 0.3]}\n",
                    "s"));
    run.finish();
    EXPECT_NEAR(run.pose("a").position[2], 0.05, 1e-4);
    EXPECT_NEAR(run.pose("b").position[2], 0.05, 1e-4);
    EXPECT_LT(run.pose("rod_1").position[2], 0.05);
#endif
}

TEST(FlexibleScene, WrongBeamsAreToldInOneSentence) {
    const auto beam = [](const std::string& keys) { return refusal("beams:\n  - {name: b, " + keys + "}\n"); };
    const std::string ends = "from: [0, 0, 0], to: [1, 0, 0]";
    EXPECT_EQ(beam(ends + ", section: {circle: 0.01}"), "taken");
    EXPECT_EQ(beam(ends), "s.yaml, line 4: beam \"b\" lacks the key \"section\"");
    EXPECT_EQ(beam("from: [0, 0, 0], section: {circle: 0.01}"), "s.yaml, line 4: beam \"b\" lacks the key \"to\"");
    EXPECT_EQ(beam(ends + ", section: {circel: 0.01}"),
              "s.yaml, line 4: \"section\" has no key \"circel\"; did you mean \"circle\"?");
    EXPECT_EQ(beam(ends + ", section: {}"),
              "s.yaml, line 4: \"section\" must have one of the keys \"rectangle\", \"circle\", \"area\"");
    EXPECT_EQ(beam(ends + ", section: {area: 1, inertia_y: 1}"),
              "s.yaml, line 4: \"section\" lacks the key \"inertia_z\"");
    EXPECT_EQ(beam(ends + ", section: {circle: 1, area: 1}"),
              "s.yaml, line 4: \"section\" must be a rectangle, a circle or its numbers, not several of them");
    EXPECT_EQ(beam(ends + ", section: {circle: 0.01}, elements: 0"),
              "s.yaml, line 4: \"elements\" is 0; it must be from 1 to 100000");
    EXPECT_EQ(beam(ends + ", section: {circle: 0.01}, fixed_ends: [form]"),
              "s.yaml, line 4: there is no end \"form\"; it must be from or to");
    EXPECT_EQ(beam(ends + ", section: {circle: 0.01}, mass: consistent"), "taken");
    EXPECT_EQ(beam(ends + ", section: {circle: 0.01}, mass: heavy"),
              "s.yaml, line 4: there is no mass \"heavy\" of beams; it must be lumped or consistent");
    EXPECT_EQ(
        beam(ends + ", section: {circle: 0.01}, section_y: [1, 0, 0]"),
        "s.yaml, line 4: the y axis of the section of the beam \"b\" runs along the beam; it must point across it");
    EXPECT_EQ(beam("bodies: [a, c], section: {circle: 0.01}"),
              "s.yaml, line 4: \"bodies\" is \"a\", but there is no such body; there are none");
    const std::string bodies =
        "bodies:\n  - {name: a, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n  - {name: c, position: [1, 0, 0], fixed: "
        "true}\nbeams:\n";
    EXPECT_EQ(refusal(bodies + "  - {name: b, bodies: [a, c], section: {circle: 0.01}}\n"), "taken");
    EXPECT_EQ(
        refusal(bodies + "  - {name: b, bodies: [a, c], section: {circle: 0.01}, density: 1}\n"),
        "s.yaml, line 7: beam \"b\" has the key \"density\", which is for beams that make their bodies; \"bodies\" "
        "are there");
    EXPECT_EQ(refusal(bodies + "  - {name: b, bodies: [a], section: {circle: 0.01}}\n"),
              "s.yaml, line 7: \"bodies\" must name at least two bodies");
}

TEST(FlexibleScene, WrongMeshesAreToldInOneSentence) {
    EXPECT_EQ(refusal("bodies:\n  - {name: b, mass: 1, shapes: [{mesh: none.obj}]}\n"),
              "s.yaml, line 4: none.obj: there is no such file");
    EXPECT_EQ(refusal("bodies:\n  - {name: b, mass: 1, shapes: [{mesh: /}]}\n"),
              "s.yaml, line 4: /: it is a folder, where a file of a mesh belongs");
    EXPECT_EQ(refusal("bodies:\n  - {name: b, mass: 1, shapes: [{mesh: {scale: 2}}]}\n"),
              "s.yaml, line 4: \"mesh\" lacks the key \"file\"");
    EXPECT_EQ(refusal("elastic_meshes:\n  - {name: b, file: none.vol}\n"),
              "s.yaml, line 4: none.vol: there is no such file");
    EXPECT_EQ(refusal("elastic_meshes:\n  - {name: b, young: 1.0e+5}\n"),
              "s.yaml, line 4: elastic mesh \"b\" lacks the key \"file\"");
    EXPECT_EQ(refusal("elastic_meshes:\n  - {name: b, file: none.vol, fixed_boxes: [{lower: [0, 0, 0]}]}\n"),
              "s.yaml, line 4: a box of \"fixed_boxes\" lacks the key \"upper\"");
}

}  // namespace
}  // namespace delassus::tests::flexible_test
