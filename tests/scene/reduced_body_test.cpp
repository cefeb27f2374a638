// SPDX-License-Identifier: BSD-3-Clause
// Scenes with elastic bodies of few modes: the example, what a plan and a trajectory say of them, and refusals.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "output/recorded.hpp"
#include "output/run_folder.hpp"
#include "support/scenes.hpp"

#ifdef DELASSUS_HAS_SPECTRA

namespace delassus::tests::reduced_body_test {
namespace {

// Both arms swing and ring alike. Within half a second, the amplitudes after the stop being about 3 mm along the
// motion.
TEST(ReducedScene, ArmOfFewModesSwingsAsThatOfTheMesh) {
    const std::string file = example_scene("modal_arm");
    Running mesh(read_scene(file), 0), modes(read_scene(file), 1);
    double worst = 0.0, ringing = 0.0;
    while (!mesh.simulation.finished()) {
        mesh.simulation.step();
        modes.simulation.step();
        const auto a = mesh.pose("weight").position, b = modes.pose("weight").position;
        worst = std::max(worst, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
        if (mesh.simulation.state().t < 0.3) continue;
        const double angle = std::atan2(a[1], a[0]);
        ringing = std::max(ringing, 0.62 * std::abs(angle - 1.0));
    }
    RecordProperty("difference", testing::PrintToString(worst));
    RecordProperty("ringing", testing::PrintToString(ringing));
    EXPECT_LT(worst, 1e-4);
    EXPECT_GT(ringing, 4e-3);
}

// The crank ends at 90°, where the pins have the accelerations a₀ and a₁ across the rod, and the slider the place
// √(l² − r²).
TEST(ReducedScene, RodOfTheSliderCrankBendsByItsInertia) {
    Running run(read_scene(example_scene("modal_slider_crank")));
    const double r = 0.1, l = 0.3, speed = 10.0 * std::numbers::pi, area = 2.5e-5, inertia = area * area / 12.0;
    double slider = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        const double phi = speed * run.simulation.state().t;
        const double x = r * std::cos(phi) + std::sqrt(l * l - std::pow(r * std::sin(phi), 2));
        slider = std::max(slider, std::abs(run.pose("slider").position[0] - x));
    }
    const auto mean_at = [&](double x) {
        Vector3 sum{};
        const auto nodes =
            run.system().nodes_in(0, run.system().node_count(), {{x - 1e-6, -1.0, -1.0}, {x + 1e-6, 1.0, 1.0}});
        for (const auto node : nodes) {
            const auto at = run.system().node_position(run.simulation.state(), node);
            for (std::size_t i = 0; i < 3; ++i) sum[i] += at[i] / static_cast<double>(nodes.size());
        }
        return sum;
    };
    const auto from = mean_at(0.1), middle = mean_at(0.25), to = mean_at(0.4);
    const double dx = to[0] - from[0], dy = to[1] - from[1];
    const double deflection = (dx * (middle[1] - from[1]) - dy * (middle[0] - from[0])) / std::hypot(dx, dy);
    const double a0 = r * speed * speed * std::sqrt(l * l - r * r) / l;
    const double a1 = -r * r * speed * speed / std::sqrt(l * l - r * r) * r / l;
    const double quasi_static = 5.0 * 7800.0 * area * (a0 + a1) * std::pow(l, 4) / (768.0 * 2e11 * inertia);
    RecordProperty("deflection", testing::PrintToString(deflection / quasi_static));
    RecordProperty("slider", testing::PrintToString(slider));
    EXPECT_NEAR(deflection / quasi_static, 1.0, 0.05);
    EXPECT_LT(slider, 1e-5);
    EXPECT_LT(run.simulation.totals().worst_drift, 1e-9);
}

constexpr const char* arm = R"(
step: 0.0013
end: 0.1
bodies:
  - {name: hub, mass: 0.213457, inertia: {xx: 0.001, yy: 0.001, zz: 0.001}, position: [0.012345, 0, 1.000123]}
elastic_blocks:
  - {name: arm, corner: [0.05, -0.01, 0.98], edges: [0.55, 0.02, 0.04], cells: [2, 1, 1], young: 2.0e+8, modes: 4,
     damping_time: 1.0e-4}
joints: [{name: axle, kind: revolute, second: hub, point: [0, 0, 1], axis: [0, 1, 0.1]}]
attachments: [{name: root, body: hub, elastic: arm, face: x_min}]
)";

TEST(ReducedScene, APlanCountsModesAndInterfaces) {
    Scene scene = parse_scene(arm, "arm.yaml");
    const auto plan = make_plan(scene, registry()).at(0);
    EXPECT_EQ(plan.velocities, 6 + 6 + 4);
    const auto has = [](const std::vector<PlanLine>& lines, const std::string& what) {
        return std::any_of(lines.begin(), lines.end(), [&](const PlanLine& line) { return line.what == what; });
    };
    EXPECT_TRUE(has(plan.kept, "elastic body \"arm\" of 4 modes"));
    EXPECT_TRUE(has(plan.kept, "1 interface"));
    EXPECT_TRUE(has(plan.left_out, "135 velocities of the 45 nodes of \"arm\""));
    EXPECT_FALSE(has(plan.kept, "45 nodes"));
    EXPECT_EQ(std::count(plan.libraries.begin(), plan.libraries.end(), "delassus_eigenmodes.so"), 1);
}

#ifdef DELASSUS_HAS_HDF5
TEST(ReducedScene, ATrajectoryHasThePlacesOfItsNodes) {
    const std::filesystem::path folder = std::filesystem::temp_directory_path() / "delassus_reduced_scene";
    std::filesystem::remove_all(folder);
    Scene scene = parse_scene(arm, "arm.yaml");
    std::vector<Simulation> simulations;
    simulations.emplace_back(scene.systems[0], registry());
    {
        RunFolder output(folder, scene, arm, simulations);
        while (!simulations[0].finished()) {
            simulations[0].step();
            output.add_step(0);
        }
        output.checkpoint();
    }
    const auto systems = read_trajectory(folder / "trajectory.h5", {});
    std::filesystem::remove_all(folder);
    const MultibodySystem& system = *scene.systems[0].system;
    const State& state = simulations[0].state();
    const auto nodes = static_cast<std::size_t>(system.node_count());
    ASSERT_EQ(systems.at(0).model.nodes.size(), nodes);
    ASSERT_EQ(systems[0].nodes.size(), systems[0].t.size() * nodes * 3);
    double strain = 0.0;
    for (std::size_t node = 0; node < nodes; ++node) {
        const auto expected = system.node_position(state, static_cast<std::int32_t>(node));
        const double* found = systems[0].nodes.data() + (systems[0].nodes.size() - 3 * nodes) + 3 * node;
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[i], expected[i], 1e-14);
    }
    for (auto entry = state.q.size() - 4; entry < state.q.size(); ++entry) strain += std::abs(state.q[entry]);
    EXPECT_GT(strain, 1e-5);
}
#endif

// Shapes of the bodies that hold it touch others.
#ifdef DELASSUS_HAS_FCL
TEST(ReducedScene, AFootThatItStandsOnCarriesItsWeight) {
    const std::string text = R"(
step: 0.002
end: 1.5
materials: {wood: {friction: 0.5}}
bodies:
  - {name: ground, fixed: true, shapes: [{plane: {}, material: wood}]}
  - {name: foot, mass: 1, position: [0, 0, 0.1], shapes: [{box: {size: [0.4, 0.4, 0.2]}, material: wood}]}
elastic_blocks:
  - {name: column, corner: [-0.1, -0.1, 0.2], edges: [0.2, 0.2, 0.5], cells: [1, 1, 4], young: 1.0e+6, density: 500,
     poisson: 0, modes: 30, damping_time: 0.01}
attachments: [{name: bond, body: foot, elastic: column, face: z_min}]
)";
    Running run(parse_scene(text, "foot.yaml"));
    const State start = run.simulation.state();
    run.finish();
    double way = 0.0;
    const auto top = run.system().nodes_in(0, run.system().node_count(), {{-1.0, -1.0, 0.699}, {1.0, 1.0, 0.701}});
    for (const auto node : top)
        way += run.system().node_position(start, node)[2] - run.system().node_position(run.simulation.state(), node)[2];
    const double shrinks = 500.0 * 9.81 * 0.25 / (2.0 * 1e6);  // ρ g L²/(2 E)
    EXPECT_NEAR(way / static_cast<double>(top.size()) / shrinks, 1.0, 0.05);
    for (const double v : run.simulation.state().v) EXPECT_NEAR(v, 0.0, 1e-4);
    EXPECT_NEAR(run.pose("foot").position[2], 0.1, 1e-5);
}
#endif

// A block of few modes on an incline of 20°: it slides down with g (sin θ − μ cos θ), or stays.
#ifdef DELASSUS_HAS_FCL
TEST(ReducedScene, ABlockSlidesOnItsNodes) {
    for (const double friction : {0.2, 0.5}) {
        const std::string text = R"(
step: 0.001
end: 0.4
gravity: [3.355207611, 0, -9.218384610]
materials: {rubber: {friction: )" +
                                 std::to_string(friction) + R"(}}
bodies: [{name: ground, fixed: true, shapes: [{plane: {}, material: rubber}]}]
elastic_blocks:
  - {name: block, corner: [0, 0, 0.005], edges: [0.4, 0.3, 0.1], cells: [2, 2, 1], young: 1.0e+6, poisson: 0.3, modes: 12,
     damping_time: 0.01, contact: {radius: 0.005, material: rubber}}
)";
        Running run(parse_scene(text, "slide.yaml"));
        run.finish();
        const auto column = static_cast<std::size_t>(run.system().reduced_bodies().at(0).column);
        const double angle = 20.0 * std::numbers::pi / 180.0;
        const double speed = 9.81 * std::max(0.0, std::sin(angle) - friction * std::cos(angle)) * 0.4;
        EXPECT_NEAR(run.simulation.state().v[column], speed, 0.01 * std::max(speed, 0.1));
        EXPECT_NEAR(run.simulation.state().q[static_cast<std::size_t>(run.system().reduced_bodies()[0].position) + 2],
                    0.055, 1e-4);
        EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
    }
}
#endif

std::string refusal(const std::string& text) {
    try {
        static_cast<void>(parse_scene("step: 0.001\nend: 0.1\n" + text, "s.yaml"));
    } catch (const InputError& error) {
        return error.what();
    }
    return "taken";
}

TEST(ReducedScene, WhatCannotBeIsToldInOneSentence) {
    const auto block = [](const std::string& keys) {
        return refusal("elastic_blocks:\n  - {name: b, edges: [1, 0.1, 0.1], cells: [2, 1, 1], " + keys + "}\n");
    };
    EXPECT_EQ(block("modes: 3"), "taken");
    EXPECT_EQ(block("modes: 3, angular_velocity: [1, 2, 3], velocity: [1, 0, 0]"), "taken");
    EXPECT_EQ(block("modes: 2.5"), "s.yaml, line 4: \"modes\" is \"2.5\"; it must be a whole number");
    EXPECT_EQ(block("modes: -1"),
              "s.yaml, line 4: the modes of the elastic body \"b\" are -1; their number must not be negative");
    EXPECT_EQ(refusal("sleeping: true\nelastic_blocks:\n  - {name: b, edges: [1, 1, 1], cells: [1, 1, 1], modes: 3}\n"),
              "s.yaml, line 5: a body with \"modes\" cannot sleep; leave \"sleeping\" or \"modes\" out");
}

TEST(ReducedScene, TouchesNoOtherElasticBody) {
    const std::string touches = ", contact: {radius: 0.01, material: m}";
    const auto blocks = [&](const std::string& keys) {
        return refusal(
            "materials: {m: {friction: 0.1}}\nelastic_blocks:\n  - {name: a, edges: [1, 1, 1], cells: [1, 1, 1], "
            "modes: 3" +
            touches + "}\n  - {name: b, corner: [0, 0, 1.5], edges: [1, 1, 1], cells: [1, 1, 1]" + keys + "}\n");
    };
    EXPECT_EQ(blocks(""), "taken");
    for (const char* modes : {"", ", modes: 2"})
        EXPECT_NE(blocks(modes + touches).find("has modes and contact, and so has another elastic body"),
                  std::string::npos)
            << blocks(modes + touches);
}

// Without modes too a block turns as a rigid body at the start.
TEST(ReducedScene, ABlockWithAnAngularVelocityHasItsMomentum) {
    for (const char* modes : {"", ", modes: 4"}) {
        Running run(parse_scene(std::string("step: 0.001\nend: 0.1\nelastic_blocks:\n  - {name: b, corner: [1, 2, 3], "
                                            "edges: [0.4, 0.2, 0.1], cells: [2, 1, 1], velocity: [1, 2, 3], "
                                            "angular_velocity: [0, 0, 5]") +
                                    modes + "}\n",
                                "s.yaml"));
        const auto momentum = run.system().momentum(run.system().initial_state());
        const double mass = 1000.0 * 0.4 * 0.2 * 0.1;
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(momentum[0][i], mass * (1.0 + static_cast<double>(i)), 1e-12);
        // About the origin: c × m v + J ω, with the lumped masses' J near (a² + b²) m/12.
        EXPECT_NEAR(momentum[1][2] - mass * (1.2 * 2.0 - 2.1 * 1.0), 5.0 * mass * (0.16 + 0.04) / 12.0, 0.15);
    }
}

}  // namespace
}  // namespace delassus::tests::reduced_body_test

#endif
