// SPDX-License-Identifier: BSD-3-Clause
// The example scenes with beams and with meshes from files against what their heads say is known, and what is said of
// wrong beams and meshes.
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
