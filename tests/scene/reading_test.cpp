// SPDX-License-Identifier: BSD-3-Clause
// What a scene becomes.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "delassus/scene.hpp"

namespace delassus::tests::reading_test {
namespace {

const std::string head = "step: 0.01\nend: 1\n";

TEST(Scene, DefaultsAreThoseOfTheDocumentation) {
    const auto scene = parse_scene(head + "bodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]", "s");
    ASSERT_EQ(scene.systems.size(), 1u);
    const auto& system = scene.systems[0];
    EXPECT_EQ(system.name, "main");
    EXPECT_EQ(system.integrator, "dormand_prince");  // nothing can touch: see method_test.cpp
    EXPECT_TRUE(system.solver.name.empty());
    EXPECT_EQ(system.system->n(), 6);
}

TEST(Scene, MassAndInertiaFollowFromShapes) {
    const auto scene = parse_scene(head + R"(bodies:
  - {name: ball, density: 2, shapes: [{sphere: {radius: 0.5}}]}
  - {name: box, mass: 12, position: [9, 0, 0], shapes: [{box: {size: [1, 2, 3]}}]}
  - {name: rod, mass: 2, position: [18, 0, 0], shapes: [{cylinder: {radius: 0.1, length: 2}, orientation: {axis: [0, 1, 0], angle: 90}}]}
  - name: dumbbell
    mass: 2
    position: [27, 0, 0]
    shapes: [{sphere: {radius: 0.5}, position: [1, 0, 0]}, {sphere: {radius: 0.5}, position: [-1, 0, 0]}]
  - {name: capsule, mass: 1, position: [36, 0, 0], shapes: [{capsule: {radius: 0.5, length: 1.0e-9}}]}
)",
                                   "s");
    const auto& bodies = scene.systems[0].bodies;
    const double mass = 2.0 * 4.0 / 3.0 * std::numbers::pi * 0.125;
    EXPECT_NEAR(bodies[0].mass, mass, 1e-12);
    EXPECT_NEAR(bodies[0].inertia.yy, 0.4 * mass * 0.25, 1e-12);
    EXPECT_NEAR(bodies[1].inertia.xx, 4.0 + 9.0, 1e-12);
    EXPECT_NEAR(bodies[1].inertia.zz, 1.0 + 4.0, 1e-12);
    EXPECT_NEAR(bodies[2].inertia.xx, 0.5 * 2 * 0.01, 1e-12);  // along z in its own frame, along x in the body's
    EXPECT_NEAR(bodies[2].inertia.zz, 2 * (0.01 / 4 + 1.0 / 3), 1e-12);
    EXPECT_NEAR(bodies[3].inertia.xx, 2 * 0.4 * 0.25, 1e-12);
    EXPECT_NEAR(bodies[3].inertia.yy, 2 * (0.4 * 0.25 + 1.0), 1e-12);
    EXPECT_NEAR(bodies[4].inertia.xx, 0.4 * 0.25, 1e-8);  // nearly a ball
}

TEST(Scene, CapsuleAgreesWithItsParts) {
    const auto scene =
        parse_scene(head + "bodies: [{name: c, density: 1, shapes: [{capsule: {radius: 0.5, length: 2}}]}]", "s");
    const auto& body = scene.systems[0].bodies[0];
    // A cylinder, and two half balls with their centroids 3r/8 beyond its ends.
    const double r = 0.5, cylinder = std::numbers::pi * r * r * 2, half = 2.0 / 3.0 * std::numbers::pi * r * r * r;
    const double centroid = 3.0 / 8.0 * r;
    EXPECT_NEAR(body.mass, cylinder + 2 * half, 1e-12);
    EXPECT_NEAR(body.inertia.zz, 0.5 * cylinder * r * r + 2 * 0.4 * half * r * r, 1e-12);
    const double half_across = half * (0.4 * r * r - centroid * centroid + std::pow(1 + centroid, 2));
    EXPECT_NEAR(body.inertia.xx, cylinder * (r * r / 4 + 1.0 / 3) + 2 * half_across, 1e-12);
}

TEST(Scene, ConvexShapeIsTheHullOfItsPoints) {
    // A box of given corners, with one more point inside, is the box of given size.
    const auto scene = parse_scene(head + R"(bodies:
  - name: given
    density: 3
    shapes:
      - convex:
          points: [[1, 2, 3], [1, 2, -3], [1, -2, 3], [1, -2, -3], [-1, 2, 3], [-1, 2, -3], [-1, -2, 3], [-1, -2, -3],
                   [0.5, 0, 0]]
  - {name: sized, density: 3, position: [9, 0, 0], shapes: [{box: {size: [2, 4, 6]}}]}
)",
                                   "s");
    const auto& bodies = scene.systems[0].bodies;
    EXPECT_NEAR(bodies[0].mass, bodies[1].mass, 1e-12);
    EXPECT_NEAR(bodies[0].inertia.xx, bodies[1].inertia.xx, 1e-9);
    EXPECT_NEAR(bodies[0].inertia.zz, bodies[1].inertia.zz, 1e-9);
    EXPECT_NEAR(bodies[0].inertia.xy, 0.0, 1e-9);
    const Shape& shape = scene.systems[0].system->shapes()[0];
    EXPECT_EQ(shape.mesh->vertices.size(), 8u);
    EXPECT_EQ(shape.mesh->triangles.size(), 12u);
}

TEST(Scene, RepeatsFillAGrid) {
    const auto scene = parse_scene(head + R"(bodies:
  - name: "b_{i}_{j}_{k}"
    mass: 1
    inertia: {xx: 1, yy: 1, zz: 1}
    position: [1, 0, 0]
    repeat: {count: [2, 3, 4], spacing: [1, 2, 3]}
joints:
  - {name: "j_{i}", kind: spherical, first: "b_{i}_0_0", second: "b_{i+1}_0_0", point: [1.5, 0, 0], repeat: {count: 1}}
)",
                                   "s");
    const auto& system = scene.systems[0];
    ASSERT_EQ(system.bodies.size(), 24u);
    const auto index = system.system->find_body("b_1_2_3");
    ASSERT_NE(index, world_body);
    EXPECT_EQ(system.bodies[static_cast<std::size_t>(index)].pose.position, (Vector3{2, 4, 9}));
    EXPECT_EQ(system.joints[0].second, system.system->find_body("b_1_0_0"));
}

TEST(Scene, LeavesOutWhatCannotMove) {
    const auto scene = parse_scene(head + R"(bodies:
  - {name: a, fixed: true}
  - {name: b, fixed: true}
  - {name: c, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}
joints: [{name: frame, kind: fixed, first: a, second: b}, {name: hinge, kind: revolute, first: b, second: c}]
springs: [{name: rope, first: a, second: b, second_point: [1, 0, 0], stiffness: 1}]
loads: [{name: wind, body: a, force: [1, 0, 0]}]
)",
                                   "s");
    const auto& system = scene.systems[0];
    EXPECT_EQ(system.system->m(), 5);
    EXPECT_FALSE(system.system->has_stiffness());
    ASSERT_EQ(system.left_out.size(), 3u);
    EXPECT_EQ(system.left_out[0].what, "joint \"frame\"");
    EXPECT_EQ(system.left_out[0].reason, "both ends are fixed");
    EXPECT_EQ(system.left_out[2].reason, "its body is fixed");
}

TEST(Scene, CommandLineComesFirst) {
    SceneOverrides overrides;
    overrides.solver = "pgs(omega=1.2)";
    overrides.integrator = "rk4";
    overrides.end = 7;
    overrides.step = 0.5;
    const auto scene = parse_scene(
        "solver: {name: apgd, tolerance: 1.0e-5, options: {a: 1}}\nintegrator: {name: hht, options: {alpha: 0}}\n"
        "bodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]",
        "s", overrides);
    const auto& system = scene.systems[0];
    EXPECT_EQ(system.solver.name, "pgs");
    EXPECT_EQ(system.solver.options, (OptionTexts{{"omega", "1.2"}}));
    EXPECT_EQ(system.solver.tolerance, 1e-5);
    EXPECT_EQ(system.integrator, "rk4");
    EXPECT_TRUE(system.integrator_options.empty());
    EXPECT_EQ(system.end, 7);
    EXPECT_EQ(system.step, 0.5);
}

// What --set says is meant for what --solver and --integrator name, whatever the file has and in whichever form.
TEST(Scene, SetAddsToWhatTheCommandLineNames) {
    const std::string body = "step: 0.1\nend: 1\nbodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n";
    SceneOverrides overrides;
    overrides.solver = "auto";
    overrides.values = {{"solver.options.ranking", "FILE"}};
    for (const char* file : {"", "solver: pgs\n", "solver: auto\n", "solver: {name: pgs, options: {omega: 1.2}}\n",
                             "solver: {tolerance: 1.0e-5}\n"}) {
        const auto solver = parse_scene(file + body, "s", overrides).systems[0].solver;
        EXPECT_EQ(solver.name, "auto") << file;
        EXPECT_EQ(solver.options, (OptionTexts{{"ranking", "FILE"}})) << file;
    }
    overrides.solver = "pgs(omega=1.5)";
    overrides.values = {{"solver.options.order", "symmetric"}, {"solver.tolerance", "1e-4"}};
    for (const char* file : {"solver: pgs(omega=1.2)\n", "solver: {name: pgs, options: {omega: 1.2}}\n"}) {
        const auto solver = parse_scene(file + body, "s", overrides).systems[0].solver;
        EXPECT_EQ(solver.options, (OptionTexts{{"omega", "1.5"}, {"order", "symmetric"}})) << file;
        EXPECT_EQ(solver.tolerance, 1e-4) << file;
    }
    SceneOverrides method;
    method.integrator = "hht";
    method.values = {{"integrator.options.alpha", "-0.2"}};
    for (const char* file : {"", "integrator: rk4\n", "integrator: {name: newmark, options: {beta: 0.3}}\n"}) {
        const auto scene = parse_scene(file + body, "s", method);
        EXPECT_EQ(scene.systems[0].integrator, "hht") << file;
        EXPECT_EQ(scene.systems[0].integrator_options, (OptionTexts{{"alpha", "-0.2"}})) << file;
    }
    overrides.values = {{"systems.two.solver.options.order", "symmetric"}};
    const auto two = parse_scene(
        "systems:\n  one: {step: 1, end: 1, bodies: []}\n  two: {step: 1, end: 1, solver: apgd, bodies: []}\n", "s",
        overrides);
    EXPECT_EQ(two.systems[0].solver.options, (OptionTexts{{"omega", "1.5"}}));
    EXPECT_EQ(two.systems[1].solver.options, (OptionTexts{{"omega", "1.5"}, {"order", "symmetric"}}));
}

TEST(Scene, AnIntegratorIsSetPieceByPieceWhereTheFileNamesNone) {
    const std::string body = "step: 0.1\nend: 1\nbodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n";
    SceneOverrides overrides;
    overrides.values = {{"integrator.name", "hht"}, {"integrator.options.alpha", "-0.2"}};
    const auto scene = parse_scene(body, "s", overrides);
    EXPECT_EQ(scene.systems[0].integrator, "hht");
    EXPECT_EQ(scene.systems[0].integrator_options, (OptionTexts{{"alpha", "-0.2"}}));
    overrides.values = {{"integrator.options.alpha", "-0.2"}};
    try {
        static_cast<void>(parse_scene(body, "s", overrides));
        FAIL() << "options of what?";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("lacks the key \"name\""), std::string::npos) << error.what();
    }
}

TEST(Scene, AMeshFarFromItsOriginKeepsItsMass) {
    const auto scene = [](double at) {
        const std::string x = std::to_string(at), y = std::to_string(at + 0.01);
        std::string points;
        for (int k = 0; k < 8; ++k)
            points += (k == 0 ? "[" : ", [") + ((k & 4) != 0 ? y : x) + ", " + ((k & 2) != 0 ? y : x) + ", " +
                      ((k & 1) != 0 ? y : x) + "]";
        return parse_scene(head + "bodies:\n  - {name: b, density: 1000, position: [0, 0, 0], shapes: [{position: [" +
                               std::to_string(-at - 0.005) + ", " + std::to_string(-at - 0.005) + ", " +
                               std::to_string(-at - 0.005) + "], convex: {points: [" + points + "]}}]}\n",
                           "s");
    };
    for (const double at : {0.0, 1200.0, 100000.0}) {
        const auto read = scene(at);
        const auto& body = read.systems[0].bodies[0];
        EXPECT_NEAR(body.mass / 1e-3, 1.0, 1e-8 * (1.0 + at)) << at;
        EXPECT_NEAR(body.inertia.xx / (1e-3 * 1e-4 / 6.0), 1.0, 1e-8 * (1.0 + at)) << at;
    }
}

TEST(Scene, AGearMayStandBeforeItsJoints) {
    const std::string body = "mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n";
    const auto scene =
        parse_scene(head + "bodies:\n  - {name: a, " + body + "  - {name: b, position: [1, 0, 0], " + body +
                        "joints:\n  - {name: g, kind: gear, gear_first: i, gear_second: j, gear_ratio: 2}\n"
                        "  - {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 0, 1]}\n"
                        "  - {name: j, kind: revolute, second: b, point: [1, 0, 0], axis: [0, 0, 1]}\n",
                    "s");
    const auto& joints = scene.systems[0].joints;
    ASSERT_EQ(joints.size(), 3u);
    EXPECT_EQ(joints[2].name, "g");
    EXPECT_EQ(joints[static_cast<std::size_t>(joints[2].gear_first)].name, "i");
    EXPECT_EQ(joints[static_cast<std::size_t>(joints[2].gear_second)].name, "j");
}

TEST(Scene, CanonicalTextKnowsAllButTheEnd) {
    const std::string body = "bodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n";
    const auto text = [&](const std::string& yaml) { return parse_scene(yaml + body, "s").canonical; };
    EXPECT_EQ(text("step: 1\nend: 1\n"), text("step: 1\nend: 2\n"));
    EXPECT_EQ(text("step: 1\nend: 1\n"), text("# a comment\nstep:   1\ntitle: x\nend: 1\n"));
    EXPECT_NE(text("step: 1\nend: 1\n"), text("step: 2\nend: 1\n"));
}

}  // namespace
}  // namespace delassus::tests::reading_test
