// SPDX-License-Identifier: BSD-3-Clause
// Mechanisms whose bodies may touch, with nothing chosen: `switching`.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "simulation/checkpoint.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::switching_test {
namespace {

constexpr double g = 9.81;

class Touching : public testing::Test {
protected:
    void SetUp() override {
#ifndef DELASSUS_HAS_FCL
        GTEST_SKIP() << "this build has no collision";
#endif
    }
};

const std::string ground = "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n";
std::string material(double friction, double restitution) {
    return fmt::format("materials: {{m: {{friction: {}, restitution: {}}}}}\n", friction, restitution);
}

/// So many links of 0.2 m on hinges, from the horizontal at the height z; bare: without shapes.
std::string chain(int links, double z, bool bare = false) {
    std::string text = material(0.4, 0.0) + "bodies:\n" + ground, joints = "joints:\n";
    for (int i = 0; i < links; ++i) {
        text += fmt::format(
            "- {{name: l{}, mass: 0.537, inertia: {{xx: 0.0002, yy: 0.0021, zz: 0.0021}}, position: [{:.6f}, 0, "
            "{:.6f}]{}}}\n",
            i, 0.1 + 0.2 * i, z,
            bare ? ""
                 : ", shapes: [{capsule: {radius: 0.021, length: 0.15}, material: m, orientation: {axis: [0, 1, 0], "
                   "angle: 90}}]");
        joints += fmt::format(
            "- {{name: j{0}, kind: revolute, first: {1}, second: l{0}, point: [{2:.6f}, 0, {3:.6f}], "
            "axis: [0, 1, 0]}}\n",
            i, i == 0 ? std::string("world") : fmt::format("l{}", i - 1), 0.2 * i, z);
    }
    return text + joints;
}

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

// ---- What is chosen ----

TEST_F(Touching, MechanismsThatMayTouchGetIt) {
    const auto chosen = [](const std::string& text) {
        const Scene scene = parse_scene("step: 0.004\nend: 1\n" + text, "test.yaml");
        return std::pair(scene.systems[0].integrator, scene.systems[0].coordinates);
    };
    const std::pair switching{std::string("switching"), Coordinates::Joint},
        euler{std::string("euler_implicit_linearized"), Coordinates::Maximal},
        trapezoidal{std::string("linearly_implicit_trapezoidal"), Coordinates::Maximal};
    EXPECT_EQ(chosen(chain(4, 0.9)), switching);
    const std::string balls =
        "- {name: 'b{i}', mass: 1, position: [3, 0, 0.5], shapes: [{sphere: {radius: 0.1}, material: m}], repeat: "
        "{count: 5, spacing: [0, 1, 0]}}\n";
    std::string piled = chain(4, 0.9);
    piled.insert(piled.find("joints:"), balls);
    EXPECT_EQ(chosen(piled), trapezoidal) << "five of nine bodies have no joint";
    EXPECT_EQ(chosen("coordinates: maximal\n" + chain(4, 0.9)), trapezoidal);
    EXPECT_EQ(chosen("sleeping: true\n" + chain(4, 0.9)), euler);
    EXPECT_EQ(chosen("solver: ssn\n" + chain(4, 0.9)), trapezoidal);
    const auto with = [](const std::string& more) {
        std::string text = chain(4, 0.9);
        text.insert(text.rfind('}'), more);
        return text;
    };
    EXPECT_EQ(chosen(with(", lower: -1, upper: 1")), switching) << "stops";
    EXPECT_EQ(chosen(with(", friction: 0.1")), switching) << "it always acts";
    EXPECT_EQ(chosen(with(", damping: 2")), switching) << "it damps within a step";
    EXPECT_EQ(chosen(with(", spring: {stiffness: 1.0e+6}")), switching) << "stiff";
    EXPECT_EQ(parse_scene("step: 0.004\nend: 1\n" + with(", spring: {stiffness: 1.0e+6}"), "t")
                  .systems[0]
                  .integrator_options.at("flight"),
              "radau_iia");
    EXPECT_EQ(chosen(with(", spring: {stiffness: 1.0e+6}, friction: 0.1")),
              std::pair(std::string("moreau_jean"), Coordinates::Joint))
        << "stiff, and in contact all the time";
    EXPECT_EQ(parse_scene("tolerance: 1.0e-4\nend: 1\n" + chain(4, 0.9), "t").systems[0].integrator, "moreau_jean");
    EXPECT_EQ(chosen("accuracy: 1.0e-3\n" + with(", spring: {stiffness: 1.0e+5}")),
              std::pair(std::string("moreau_jean"), Coordinates::Joint))
        << "steps are divided";
    EXPECT_EQ(chosen("accuracy: 1.0e-3\n" + with(", spring: {stiffness: 1.0e+9}")),
              std::pair(std::string("moreau_jean"), Coordinates::Joint));

    Scene scene = parse_scene("step: 0.004\nend: 1\n" + chain(4, 0.9), "test.yaml");
    const SystemPlan plan = make_plan(scene, registry()).at(0);
    EXPECT_TRUE(std::any_of(plan.kept.begin(), plan.kept.end(), [](const PlanLine& line) {
        return line.what == "integrator switching" &&
               line.reason.find("bodies with joints may touch") != std::string::npos;
    }));
}

// Four links on hinges that springs hold straight, some 20 rad in a step of 5 ms, swing against a wall. The
// linearised Euler method, which such scenes had, is off by 0.14 m at this step.
TEST_F(Touching, AStiffChainStrikesAWall) {
    const auto end = [](double step) {
        std::string bodies, joints;
        for (int i = 0; i < 4; ++i) {
            bodies += fmt::format(
                "- {{name: b{}, mass: 0.2, position: [0, 0, {}], shapes: [{{capsule: {{radius: 0.02, length: 0.14}}, "
                "material: m}}]}}\n",
                i, -0.2 * (i + 0.5));
            joints +=
                fmt::format("- {{name: j{}, kind: revolute, {}second: b{}, point: [0, 0, {}], axis: [0, 1, 0], {}}}\n",
                            i, i == 0 ? "" : fmt::format("first: b{}, ", i - 1), i, -0.2 * i,
                            i == 0 ? "start_rate: -5" : "spring: {stiffness: 3.0e+4}, damping: 20");
        }
        auto run =
            run_of(fmt::format("step: {}\nend: 1.2\nmaterials: {{m: {{friction: 0.2}}}}\nbodies:\n{}"
                               "- {{name: wall, fixed: true, position: [0.31, 0, 0], orientation: {{axis: [0, 1, "
                               "0], angle: -90}}, shapes: [{{plane: {{}}, material: m}}]}}\njoints:\n{}",
                               step, bodies, joints));
        EXPECT_EQ(run.simulation.system().integrator, "switching");
        run.finish();
        return run.pose("b3").position;
    };
    const auto coarse = end(0.005), fine = end(0.005 / 32);
    EXPECT_LT(std::hypot(coarse[0] - fine[0], coarse[2] - fine[2]), 0.005);
}

// ---- Flights ----

// Before anything touches, shapes change nothing: against the same links without shapes, to 1e-11 a part.
TEST_F(Touching, AChainSwingsAsIfItHadNoShapes) {
    for (const double step : {0.001, 0.00517, 0.01}) {
        auto run = run_of(fmt::format("step: {}\nend: 0.9\n{}", step, chain(10, 2.2231)));
        auto bare =
            run_of(fmt::format("step: {}\nend: 0.9\nintegrator: {{name: dormand_prince, options: {{error_limit: "
                               "1.0e-9}}}}\ncoordinates: joint\n{}",
                               step, chain(10, 2.2231, true)));
        run.finish();
        bare.finish();
        EXPECT_EQ(run.simulation.system().integrator, "switching");
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_NEAR(run.pose("l9").position[i], bare.pose("l9").position[i], 3e-5) << step;
        const auto& totals = run.simulation.totals();
        EXPECT_LE(std::abs(totals.energy - totals.start_energy), 1e-5 * totals.potential_drop) << step;
    }
}

// ---- Impacts ----

// A ball that falls from 1 m with e = 0.6 between steps of any size: its flights are parabolas.
TEST_F(Touching, ImpactsAreLocated) {
    constexpr double e = 0.6;
    const double fall = std::sqrt(2.0 / g);
    for (const double step : {0.0005, 0.00731, 0.02}) {
        const double end = fall * (1.0 + 2.0 * e + e * e);  // at the top of the second flight
        auto run = run_of(fmt::format(
            "step: {}\nend: {:.15g}\nintegrator: switching\n{}bodies:\n{}- {{name: ball, mass: 2, position: [0, 0, "
            "1.1], velocity: [0.3, 0, 0], shapes: [{{sphere: {{radius: 0.1}}, material: m}}]}}\n",
            step, end, material(0.0, e), ground));
        double pushed = 0.0;
        while (!run.simulation.finished()) {
            const StepRecord& record = run.simulation.step();
            for (const auto& contact : run.simulation.contacts()) pushed += record.h * contact.force[2];
        }
        EXPECT_NEAR(run.pose("ball").position[2], 0.1 + std::pow(e, 4), 2e-8) << step;
        EXPECT_NEAR(run.pose("ball").position[0], 0.3 * end, 1e-12);
        EXPECT_NEAR(run.velocities("ball")[0][2], 0.0, 1e-6);
        // What acted in a step is reported as its mean over the step.
        EXPECT_NEAR(pushed, 2.0 * (1.0 + e) * (1.0 + e) * g * fall, 1e-6) << step;
        EXPECT_LT(run.simulation.totals().worst_penetration, 1e-9);
    }
}

// It bounces ever sooner, and then lies.
TEST_F(Touching, BouncesComeToRest) {
    auto run = run_of(
        fmt::format("step: 0.00731\nend: 3\nintegrator: switching\n{}bodies:\n{}- {{name: ball, mass: 2, position: [0, "
                    "0, 0.6], shapes: [{{sphere: {{radius: 0.1}}, material: m}}]}}\n",
                    material(0.5, 0.6), ground));
    run.finish();
    EXPECT_NEAR(run.pose("ball").position[2], 0.1, 1e-9);
    EXPECT_NEAR(run.velocities("ball")[0][2], 0.0, 1e-9);
    ASSERT_EQ(run.simulation.contacts().size(), 1U);
    EXPECT_NEAR(run.simulation.contacts()[0].force[2], 2.0 * g, 1e-6);
}

// A bar of 1 m falls over its hinge onto the ground: ½ J ω² = m g (l/2) (1 − sin θ) at each angle θ over the ground;
// without restitution it lies then.
TEST_F(Touching, AMechanismLandsWhenItShould) {
    const double J = 1.0 / 3.0 + 0.01, low = std::asin(0.05 / 1.0);
    const std::string bar = fmt::format(
        "{}bodies:\n{}- {{name: bar, mass: 1, inertia: {{xx: 0.02, yy: {:.17g}, zz: {:.17g}}}, position: [0, 0, "
        "0.5]}}\n"
        "- {{name: tip, mass: 1.0e-9, inertia: {{xx: 1.0e-12, yy: 1.0e-12, zz: 1.0e-12}}, position: [0, 0, 1], shapes: "
        "[{{sphere: {{radius: 0.05}}, material: m}}]}}\n"
        "joints:\n- {{name: h, kind: revolute, second: bar, point: [0, 0, 0], axis: [0, 1, 0], start_rate: 0.5}}\n"
        "- {{name: f, kind: fixed, first: bar, second: tip}}\n",
        material(0.0, 0.0), ground, J - 0.25, J - 0.25);
    // The time by quadrature of dθ/ω.
    const auto rate = [&](double turned) { return std::sqrt(0.25 + 2.0 * g * 0.5 * (1.0 - std::cos(turned)) / J); };
    double time = 0.0;
    constexpr int parts = 20000;
    const double width = (0.5 * std::acos(-1.0) - low) / parts;
    for (int k = 0; k < parts; ++k) time += width / rate((k + 0.5) * width);
    const double before = time - 1e-4;
    for (const double step : {0.001, 0.01}) {
        auto falls = run_of(fmt::format("step: {}\nend: {:.12g}\n{}", step, before, bar));
        falls.finish();
        EXPECT_GT(falls.pose("tip").position[2], 0.05);
        EXPECT_NEAR(falls.pose("tip").position[2], 0.05 + 1e-4 * rate(0.5 * std::acos(-1.0) - low), 1e-5) << step;
        auto lies = run_of(fmt::format("step: {}\nend: {:.12g}\n{}", step, time + 0.3, bar));
        EXPECT_EQ(lies.simulation.system().integrator, "switching");
        lies.finish();
        EXPECT_NEAR(lies.pose("tip").position[2], 0.05, 1e-9) << step;
        EXPECT_EQ(lies.simulation.totals().unsolved_steps, 0);
    }
}

// With any step the same motion, through seven impacts of two bodies.
TEST_F(Touching, ADoorAndABallDoNotDependOnTheStep) {
    const std::string door =
        "materials: {m: {friction: 0.3, restitution: 0.4}}\nbodies:\n"
        "- {name: door, mass: 20.3, inertia: {xx: 6.7, yy: 8.1, zz: 1.4}, position: [0.45, 0, 1], shapes: [{box: "
        "{size: [0.86, 0.05, 2]}, material: m}]}\n"
        "- {name: ball, mass: 0.63, position: [0.7123, -0.8123, 1.2], velocity: [0, 4.17, 1.3], shapes: [{sphere: "
        "{radius: 0.12}, material: m}]}\n"
        "joints:\n- {name: h, kind: revolute, second: door, point: [0, 0, 1], axis: [0, 0, 1], damping: 0.3}\n";
    const auto end = [&](double step) {
        auto run = run_of(fmt::format("step: {}\nend: 1.5\n{}", step, door));
        EXPECT_EQ(run.simulation.system().integrator, "switching");
        run.finish();
        return std::array{run.pose("ball").position, run.pose("door").position};
    };
    const auto fine = end(0.0002), coarse = end(0.01);
    for (std::size_t body = 0; body < 2; ++body)
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(coarse[body][i], fine[body][i], 1e-6);
}

// The end of an arm goes round by up to two metres a step and stops at a plate of 5 mm, a radius before it.
TEST_F(Touching, NothingPassesThroughAThinPlate) {
    for (const double rate : {17.3, 57.3, 103.7, 211.3})
        for (const double step : {0.003, 0.0071, 0.01}) {
            auto run = run_of(fmt::format(
                "step: {}\nend: 0.2\ngravity: [0, 0, 0]\nmaterials: {{m: {{}}}}\nbodies:\n"
                "- {{name: plate, fixed: true, position: [0, 1, 0], shapes: [{{box: {{size: [0.005, 0.4, 0.4]}}, "
                "material: m}}]}}\n"
                "- {{name: tip, mass: 1, position: [1, 0, 0], velocity: [0, {}, 0], angular_velocity: [0, 0, {}], "
                "shapes: [{{sphere: {{radius: 0.02}}, material: m}}]}}\n"
                "joints: [{{name: h, kind: revolute, second: tip, point: [0, 0, 0], axis: [0, 0, 1]}}]\n",
                step, rate, rate));
            run.finish();
            EXPECT_NEAR(run.pose("tip").position[0], 0.0225, 1e-9) << rate << ' ' << step;
            EXPECT_NEAR(run.velocities("tip")[0][0], 0.0, 1e-9);
        }
}

// A falling weight turns a lever. A ball rolls along it, over its end, and flies: until then the lever pushes, and no
// longer, though flights have no estimate that would show it.
TEST_F(Touching, ALeverPushesABallNoFurtherThanItsEnd) {
    const auto thrown = [](double step) {
        auto run = run_of(fmt::format(
            "step: {}\nend: 0.8\n{}bodies:\n"
            "- {{name: lever, mass: 2, inertia: {{xx: 0.0019, yy: 0.167, zz: 0.168}}, position: [0, 0, 0.3], shapes: "
            "[{{box: {{size: [1, 0.1, 0.04]}}, material: m}}]}}\n"
            "- {{name: weight, mass: 15, inertia: {{xx: 0.056, yy: 0.056, zz: 0.056}}, position: [-0.4, 0, 0.395]}}\n"
            "- {{name: ball, mass: 0.3, position: [0.4, 0, 0.36], shapes: [{{sphere: {{radius: 0.04}}, material: "
            "m}}]}}\n"
            "joints:\n"
            "- {{name: h, kind: revolute, second: lever, point: [-0.15, 0, 0.3], axis: [0, 1, 0], lower: -0.9, upper: "
            "0.9}}\n"
            "- {{name: w, kind: fixed, first: lever, second: weight, point: [-0.4, 0, 0.32]}}\n",
            step, material(0.6, 0.0)));
        run.finish();
        return run.pose("ball").position;
    };
    const Vector3 right = thrown(0.0002);
    for (const double step : {0.005, 0.0025, 0.002}) {
        const Vector3 ball = thrown(step);
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(ball[i], right[i], 2e-3) << step;
    }
}

// ---- Robustness ----

// Links that lie in the ground by their radius rise at the recovery speed, and nothing flies off.
TEST_F(Touching, AMechanismThatStartsInTheGroundIsPushedOutSlowly) {
    auto run = run_of("step: 0.00417\nend: 1\n" + chain(4, 0.0));
    double fastest = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        for (const char* link : {"l1", "l3"}) fastest = std::max(fastest, std::abs(run.velocities(link)[0][2]));
    }
    EXPECT_LT(fastest, 0.05);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
    EXPECT_GT(run.pose("l3").position[2], 0.001);
    EXPECT_LE(run.pose("l3").position[2], 0.0211);
}

// Three spheres that overlap by centimetres on one rigid chain cannot be parted: a fixed joint and a hinge between
// neighbours hold the first and the third. They fall together, lie down, and gain nothing.
TEST_F(Touching, WhatJointsHoldTogetherStaysTogether) {
    auto run = run_of(
        "step: 0.004\nend: 1.2\n" + material(0.5, 0.0) + "bodies:\n" + ground +
        "- {name: a, mass: 1, position: [0, 0, 0.8], shapes: [{sphere: {radius: 0.1}, material: m}]}\n"
        "- {name: b, mass: 1, inertia: {xx: 0.004, yy: 0.004, zz: 0.004}, position: [0.06, 0, 0.8]}\n"
        "- {name: c, mass: 1.5, position: [0.12, 0.01, 0.8], shapes: [{sphere: {radius: 0.1}, material: m}]}\n"
        "joints:\n- {name: i, kind: fixed, first: a, second: b, point: [0.03, 0, 0.8]}\n"
        "- {name: j, kind: revolute, first: b, second: c, point: [0.12, 0.01, 0.8], axis: [0, 0, 1], lower: -0.1, "
        "upper: 0.1}\n");
    run.finish();
    const auto& totals = run.simulation.totals();
    EXPECT_EQ(totals.unsolved_steps, 0);
    EXPECT_GT(totals.worst_penetration, 0.05);
    EXPECT_NEAR(run.pose("a").position[2], 0.1, 1e-3);
    EXPECT_NEAR(run.pose("c").position[2], 0.1, 1e-3);
    EXPECT_LE(totals.growth, 1e-2 * totals.potential_drop);
}

// Newton's law with friction asks links that are nearly jammed between two contacts for more energy than they have:
// after 0.13 s sixteen times as much as all that can move. The scene was found by trying mechanisms at random.
TEST_F(Touching, ImpactsGainNoEnergy) {
    auto run = run_of(R"(step: 0.00517
end: 0.5
materials: {m: {friction: 0.8, restitution: 0.7}}
bodies:
- {name: floor, fixed: true, shapes: [{plane: {}, material: m}]}
- {name: b0, density: 8000, position: [0.000000, 0.000000, 0.495092], velocity: [0.0000, 0.0000, 0.0000], shapes: [{capsule: {radius: 0.0369, length: 0.1055}, material: m}]}
- {name: b1, density: 500, position: [0.037455, -0.005344, 0.247972], velocity: [0.0000, 0.0000, 0.0000], shapes: [{capsule: {radius: 0.0467, length: 0.1334}, material: m}]}
- {name: b2, density: 8000, position: [0.217397, 0.114228, 0.448289], velocity: [0.0000, 0.0000, 0.0000], shapes: [{capsule: {radius: 0.0491, length: 0.1403}, material: m}]}
- {name: b3, density: 8000, position: [0.036253, -0.008174, 0.327026], velocity: [0.0000, 0.0000, 0.0000], shapes: [{box: {size: [0.0742, 0.0557, 0.0445]}, material: m}]}
- {name: b4, density: 8000, position: [-0.117546, -0.193462, 0.192416], velocity: [0.0000, 0.0000, 0.0000], shapes: [{box: {size: [0.0692, 0.0519, 0.0415]}, material: m}]}
- {name: b5, density: 8000, position: [-0.019425, 0.086013, 0.102240], velocity: [0.0000, 0.0000, 0.0000], shapes: [{sphere: {radius: 0.0496}, material: m}]}
- {name: b6, density: 2000, position: [0.135925, -0.103381, 0.386197], velocity: [0.0000, 0.0000, 0.0000], shapes: [{box: {size: [0.1378, 0.1034, 0.0827]}, material: m}]}
- {name: b7, density: 8000, position: [-0.167706, 0.095540, 0.081696], velocity: [0.0000, 0.0000, 0.0000], shapes: [{sphere: {radius: 0.0582}, material: m}]}
joints:
- {name: j0, kind: spherical, first: world, second: b0, point: [0.000000000, 0.000000000, 0.595092157], axis: [1.571779370, -0.372468025, -0.912449729]}
- {name: j1, kind: revolute, first: b0, second: b1, point: [0.018727512, -0.002671950, 0.371531884], axis: [1.377792131, 0.598989042, -0.505740509]}
- {name: j2, kind: cylindrical, first: b0, second: b2, point: [0.108698630, 0.057113759, 0.471690741], axis: [0.586865096, -1.799608307, 0.671684800]}
- {name: j3, kind: revolute, first: b2, second: b3, point: [0.126825200, 0.053026809, 0.387657857], axis: [0.485014956, 0.870524384, -0.473275412], lower: -0.5, upper: 0.5}
- {name: j4, kind: prismatic, first: b1, second: b4, point: [-0.040045375, -0.099402866, 0.220193938], axis: [0.194976540, 0.320980110, -1.535060537], spring: {stiffness: 200}}
- {name: j5, kind: revolute, first: b3, second: b5, point: [0.008413913, 0.038919368, 0.214633322], axis: [1.467821882, 1.651062266, -1.446619797], lower: -0.5, upper: 0.5}
- {name: j6, kind: universal, first: b3, second: b6, point: [0.086089114, -0.055777334, 0.356611667], axis: [0.053225389, -0.284434671, -1.692613535], second_axis: [-0.447114024, 1.802113399, -0.316895344]}
- {name: j7, kind: revolute, first: b5, second: b7, point: [-0.093565686, 0.090776401, 0.091968372], axis: [1.691607483, -0.817176601, 1.974822961]}
)");
    EXPECT_EQ(run.simulation.system().integrator, "switching");
    while (!run.simulation.finished()) {
        const double before = run.simulation.record().energy, given = run.simulation.totals().recovered;
        const StepRecord& record = run.simulation.step();
        const double scale = record.kinetic + run.simulation.totals().potential_drop;
        EXPECT_LE(record.energy, before + run.simulation.totals().recovered - given + 0.02 * scale) << record.t;
    }
    const auto& totals = run.simulation.totals();
    EXPECT_EQ(totals.unsolved_steps, 0);
    EXPECT_GT(totals.most_contacts, 1);
}

TEST_F(Touching, ARunGoesOnWithTheSameBits) {
    const std::string text = "step: 0.004\nend: 1.5\n" + chain(4, 0.5231);
    auto whole = run_of(text), stopped = run_of(text), resumed = run_of(text);
    constexpr int first = 97, all = 300;
    for (int i = 0; i < all; ++i) whole.simulation.step();
    for (int i = 0; i < first; ++i) stopped.simulation.step();
    const ScratchFolder scratch;
    write_checkpoint({"scene", {{"main", stopped.simulation.save(), {}}}}, scratch / "checkpoint.json");
    resumed.simulation.load(read_checkpoint(scratch / "checkpoint.json").systems[0].simulation);
    for (int i = first; i < all; ++i) resumed.simulation.step();
    EXPECT_GT(whole.simulation.totals().most_contacts, 0);
    EXPECT_EQ(resumed.simulation.save().state.q, whole.simulation.save().state.q);
    EXPECT_EQ(resumed.simulation.save().stepping.method, whole.simulation.save().stepping.method);
}

// ---- What joints hold against the ground ----

// The roller lies on the ground, and joints hold it there: rounding of its gaps contradicts rounding of its joints. The
// die next to it lands, so that positions are corrected. Turned by an odd angle, since axes along the world have none.
TEST_F(Touching, WhatJointsHoldOnTheGroundStaysThere) {
    const Eigen::Quaterniond turn = Eigen::Quaterniond(0.62, 0.31, -0.47, 0.55).normalized();
    const auto turned = [&](double x, double y, double z) {
        const Eigen::Vector3d at = turn * Eigen::Vector3d(x, y, z);
        return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", at.x(), at.y(), at.z());
    };
    const auto orientation = [&](const Eigen::Quaterniond& of) {
        const Eigen::Quaterniond q = turn * of;
        return fmt::format("[{:.17g}, {:.17g}, {:.17g}, {:.17g}]", q.w(), q.x(), q.y(), q.z());
    };
    const Eigen::Quaterniond straight = Eigen::Quaterniond::Identity(),
                             lying(Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitX()));
    auto run = run_of(fmt::format(
        "step: 0.01\nend: 0.3\ngravity: {}\nintegrator: switching\nmaterials: {{m: {{friction: 0.5}}}}\nbodies:\n"
        "- {{name: ground, fixed: true, orientation: {}, shapes: [{{plane: {{}}, material: m}}]}}\n"
        "- {{name: roller, mass: 50, inertia: {{xx: 0.27, yy: 0.14, zz: 0.2}}, position: {}, orientation: {}, shapes: "
        "[{{capsule: {{radius: 0.1, length: 0.2}}, material: m}}]}}\n"
        "- {{name: die, density: 7800, position: {}, orientation: {}, velocity: {}, angular_velocity: [-0.44, 0.4, "
        "-0.05], shapes: [{{box: {{size: [0.1, 0.1, 0.1]}}, material: m}}]}}\n"
        "joints:\n"
        "- {{name: rail, kind: cylindrical, second: roller, point: {}, axis: {}}}\n"
        "- {{name: stop, kind: planar, second: roller, point: {}, axis: {}}}\n",
        turned(0, 0, -9.81), orientation(straight), turned(0.2, 0, 0.1), orientation(lying), turned(1.45, 0, 0.05),
        orientation(straight), turned(2.2, -1.2, -3.8), turned(-0.3, 0, 0.1), turned(0, 1, 0),
        turned(0.84, 0.37, -0.16), turned(-1, 0, 0)));
    ASSERT_NO_THROW(run.finish());
    const auto at = run.pose("roller").position;
    EXPECT_LT((Eigen::Vector3d(at[0], at[1], at[2]) - turn * Eigen::Vector3d(0.2, 0, 0.1)).norm(), 1e-9);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
}

// A leaf on a pin below the ground begins to fall over while it stands on the ground, which stops it at once: in one
// step, whose rows of the pin are not those of a motion that does not come about.
TEST_F(Touching, WhatMeetsAtTheBeginningOfAStepIsStoppedThere) {
    auto run =
        run_of("step: 0.01\nend: 0.3\ncoordinates: maximal\nintegrator: switching\n" + material(0.1, 0.0) +
               "bodies:\n" + ground +
               "- {name: leaf, mass: 2, inertia: {xx: 0.0187, yy: 0.0151, zz: 0.0039}, position: [0.01, 0, 0.15], "
               "orientation: "
               "{axis: [0, 0, 1], angle: 147}, velocity: [-4, 0, 0], shapes: [{box: {size: [0.03, 0.15, 0.3]}, "
               "material: m}]}\n"
               "joints:\n- {name: pin, kind: revolute, second: leaf, point: [0.01, 0, -0.35], axis: [0, -1, 0]}\n");
    run.finish();
    EXPECT_EQ(run.simulation.totals().divided_steps, 0);
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
    EXPECT_NEAR(run.pose("leaf").position[0], 0.01, 1e-6);
    EXPECT_NEAR(run.pose("leaf").position[2], 0.15, 1e-6);
}

// What a solver leaves of speeds at rest is no gain of energy, for which a step would be solved again.
TEST_F(Touching, WhatRestsIsSolvedOnceAStep) {
    for (const char* method : {"switching", "moreau_jean"})
        for (const char* solver : {"admm", "pgs", "ssn"}) {
            auto run = run_of(fmt::format("step: 0.01\nend: 1\nintegrator: {}\nsolver: {{name: {}, tolerance: "
                                          "1e-8}}\n",
                                          method, solver) +
                              material(0.5, 0.0) + "bodies:\n" + ground +
                              "- {name: low, density: 700, position: [0, 0, 0.1], shapes: [{box: {size: [0.4, 0.3, "
                              "0.2]}, material: m}]}\n"
                              "- {name: high, density: 1300, position: [0.03, 0.02, 0.25], orientation: {axis: [0, 0, "
                              "1], angle: 17}, shapes: [{box: {size: [0.2, 0.3, 0.1]}, material: m}]}\n");
            run.finish();
            EXPECT_LE(run.simulation.totals().newton_iterations, 110) << method << ' ' << solver;
        }
}

}  // namespace
}  // namespace delassus::tests::switching_test
