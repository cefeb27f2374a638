// SPDX-License-Identifier: BSD-3-Clause
// The integrator and the coordinates of scenes that name none.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::method_test {
namespace {

using Chosen = std::pair<std::string, Coordinates>;

/// So many links of 0.4 m on hinges, from the horizontal.
std::string chain(int links, const std::string& joint = "") {
    return fmt::format(
        "bodies:\n"
        "- {{name: 'l{{i}}', mass: 1.137, inertia: {{xx: 0.001, yy: 0.0152, zz: 0.0152}}, position: [0.2, 0, 0], "
        "repeat: {{count: {}, spacing: [0.4, 0, 0]}}}}\n"
        "joints:\n"
        "- {{name: j0, kind: revolute, second: l0, point: [0, 0, 0], axis: [0, 1, 0]{}}}\n"
        "- {{name: 'j{{i+1}}', kind: revolute, first: 'l{{i}}', second: 'l{{i+1}}', point: [0.4, 0, 0], axis: [0, 1, "
        "0], repeat: {{count: {}, spacing: [0.4, 0, 0]}}}}\n",
        links, joint, links - 1);
}

const std::string head = "step: 0.004\nend: 3.1\n";

Chosen chosen_for(const std::string& text, const SceneOverrides& overrides = {}) {
    const Scene scene = parse_scene(text, "test.yaml", overrides);
    return {scene.systems[0].integrator, scene.systems[0].coordinates};
}

const Chosen explicit_in_joints{"dormand_prince", Coordinates::Joint},
    explicit_in_bodies{"dormand_prince", Coordinates::Maximal},
    implicit{"euler_implicit_linearized", Coordinates::Maximal}, stiff_in_bodies{"radau_iia", Coordinates::Maximal},
    stiff_in_joints{"radau_iia", Coordinates::Joint};

/// A bar of rubber, clamped at one end.
const std::string bar =
    "elastic_blocks: [{name: bar, corner: [0, 0, 0.412345], edges: [0.212345, 0.041234, 0.041234], cells: [4, 1, 1], "
    "young: 1.0e+6, poisson: 0.45, density: 1100, fixed_faces: [x_min]}]\n";

// A mass on a spring for 100 periods, in steps shown of a third of a period to two.
TEST(Method, FollowsSmallMotionsAsWellAsLargeOnes) {
    constexpr double pi = 3.14159265358979323846, f = 117.0;
    for (const double amplitude : {2.3e-8, 1.7e-6, 1.1e-3, 0.9})
        for (const double step : {0.35 / f, 1.9 / f}) {
            SCOPED_TRACE(fmt::format("{} m, steps of {} periods", amplitude, step * f));
            Running run(parse_scene(
                fmt::format(
                    "step: {:.17g}\nend: {:.17g}\ngravity: [0, 0, 0]\nbodies: [{{name: b, mass: 0.001, inertia: "
                    "{{xx: 1e-9, yy: 1e-9, zz: 1e-9}}, position: [0.3, -1, 0.2]}}]\njoints: [{{name: j, kind: "
                    "prismatic, second: b, point: [0.3, -1, 0.2], axis: [1, 0, 0], start: {}, spring: "
                    "{{stiffness: {:.17g}}}}}]\n",
                    step, 100.0 / f, amplitude, 0.001 * std::pow(2.0 * pi * f, 2)),
                "test.yaml"));
            double worst = 0.0;
            while (!run.simulation.finished()) {
                run.simulation.step();
                const double t = run.simulation.state().t;
                worst =
                    std::max(worst, std::abs(run.pose("b").position[0] - 0.3 - amplitude * std::cos(2 * pi * f * t)));
            }
            EXPECT_LT(worst, (amplitude < 1e-7 ? 1e-3 : 5e-5) * amplitude);
        }
}

TEST(Method, FollowsFromTheScene) {
    EXPECT_EQ(chosen_for(head + chain(6)), explicit_in_joints);
    EXPECT_EQ(chosen_for(head + "integrator: auto\ncoordinates: auto\nsolver: auto\n" + chain(6)), explicit_in_joints);
    EXPECT_EQ(chosen_for("tolerance: 1.0e-5\nend: 1\n" + chain(6)), explicit_in_joints);
    EXPECT_EQ(chosen_for(head + "coordinates: maximal\n" + chain(6)), explicit_in_bodies);
    const std::string last = "- {name: last, kind: revolute, second: l1, point: [0.8, 0, 0], axis: [0, 1, 0]}\n";
    EXPECT_EQ(chosen_for(head + chain(2) + last), explicit_in_joints) << "a loop";
    EXPECT_EQ(chosen_for(head + chain(2) + "- {name: rod, kind: distance, second: l1, second_point: [0.7, 0, 0]}\n"),
              explicit_in_joints);
    const std::string free =
        "bodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 2, zz: 3}, angular_velocity: [0, 1, 0]}]";
    EXPECT_EQ(chosen_for(head + free), explicit_in_bodies);
    EXPECT_EQ(chosen_for(head + free + "\njoints: [{name: rod, kind: distance, second: b, point: [1, 0, 0]}]"),
              explicit_in_bodies);
    EXPECT_EQ(chosen_for(head + "coordinates: joint\n" + chain(6)), explicit_in_joints);
    EXPECT_EQ(chosen_for(head + "integrator: rk4\n" + chain(6)), Chosen("rk4", Coordinates::Maximal));

    const Chosen midpoint_in_joints{"moreau_jean", Coordinates::Joint};
    EXPECT_EQ(chosen_for(head + chain(6, ", lower: -1")), midpoint_in_joints) << "a stop";
    EXPECT_EQ(chosen_for(head + chain(6, ", friction: 0.1")), midpoint_in_joints);
    EXPECT_EQ(chosen_for(head + "coordinates: maximal\n" + chain(6, ", lower: -1")),
              Chosen("linearly_implicit_trapezoidal", Coordinates::Maximal));
    EXPECT_EQ(chosen_for("tolerance: 1.0e-5\nend: 1\n" + chain(6, ", lower: -1")), implicit);
    EXPECT_EQ(chosen_for(head + chain(6, ", spring: {stiffness: 1.0e+6}, lower: -1")),
              Chosen("switching", Coordinates::Joint))
        << "stiff";
    EXPECT_EQ(chosen_for(head + chain(6, ", spring: {stiffness: 1.0e+6}, friction: 0.1")),
              Chosen("moreau_jean", Coordinates::Joint))
        << "friction acts all the time, and the method damps stiff springs";
    EXPECT_EQ(chosen_for(head + "solver: cholmod\n" + chain(6)), implicit);
    EXPECT_EQ(chosen_for(head + "leave_out: false\n" + chain(6)), implicit);
    EXPECT_EQ(chosen_for(head + "sleeping: true\n" + chain(6)), implicit);
    EXPECT_EQ(chosen_for(head + "bodies: []\n"), implicit);
    SceneOverrides overrides;
    overrides.integrator = "auto";
    EXPECT_EQ(chosen_for(head + "integrator: rk4\n" + chain(6), overrides), explicit_in_joints);
    overrides.integrator = "hht";
    EXPECT_EQ(chosen_for(head + chain(6), overrides), Chosen("hht", Coordinates::Maximal));
}

// A mass of 2 kg on a spring: ω = √(k/2). On a prismatic joint the ring of 1e-6 kg m² that it carries cannot turn.
// Round numbers give h ω = 0.1 exactly, where fixed steps still follow a spring. It does not depend on how a scene
// lies.
TEST(Method, IsTheSameAtABoundHoweverTheSceneLies) {
    for (int k = 0; k < 24; ++k) {
        const double turn = 0.37 * k, x = std::cos(turn), y = std::sin(turn);
        const auto division_of = [&](double stiffness) {
            const Scene scene = parse_scene(
                fmt::format(
                    "step: 0.01\nend: 1\nbodies:\n"
                    "- {{name: ground, fixed: true, shapes: [{{plane: {{}}}}]}}\n"
                    "- {{name: post, fixed: true, position: [{0:.17g}, {1:.17g}, 0.1]}}\n"
                    "- {{name: ball, mass: 1, inertia: {{xx: 0.004, yy: 0.004, zz: 0.004}}, position: [0, 0, 0.1],\n"
                    "   shapes: [{{sphere: {{radius: 0.1}}}}]}}\n"
                    "springs:\n- {{name: s, first: post, second: ball, stiffness: {2}, rest_length: 1}}\n",
                    x, y, stiffness),
                "test.yaml");
            return scene.systems[0].division;
        };
        EXPECT_EQ(division_of(100.0), StepDivision::WhileCheap) << turn;
        EXPECT_EQ(division_of(100.1), StepDivision::ToChosenAccuracy) << turn;
    }
}

TEST(Method, IsImplicitWhereForcesAreStiff) {
    const auto on_spring = [](double rate, const std::string& joints) {
        return head + fmt::format(
                          "bodies: [{{name: b, mass: 2, inertia: {{xx: 1.0e-6, yy: 1.0e-6, zz: 1.0e-6}}, "
                          "position: [0, 0, 1]}}]\nsprings: [{{name: s, second: b, second_point: [0.1, 0, 1], "
                          "stiffness: {}}}]\n{}",
                          2.0 * rate * rate, joints);
    };
    const std::string slide = "joints: [{name: j, kind: prismatic, second: b, point: [0, 0, 1]}]\n";
    EXPECT_EQ(chosen_for(on_spring(1.0, "")), explicit_in_bodies);
    EXPECT_EQ(chosen_for(on_spring(4000.0, "")), stiff_in_bodies) << "the spring turns the ring 141 times as fast";
    EXPECT_EQ(chosen_for(on_spring(4000.0, slide)), explicit_in_joints);
    EXPECT_EQ(chosen_for(on_spring(2e4, slide)), stiff_in_joints);
    EXPECT_EQ(chosen_for(head + bar), stiff_in_bodies);
    EXPECT_EQ(chosen_for("tolerance: 1.0e-5\nend: 1\n" + bar), stiff_in_bodies);
    EXPECT_EQ(chosen_for("step: 1.0e-5\nend: 1\n" + bar), explicit_in_bodies) << "short steps";
    const std::string nodes =
        "nodes: [{name: a, mass: 1, fixed: true}, {name: b, mass: 1, position: [1, 0, 0]}]\n"
        "cables: [{name: c, nodes: [a, b]}]\n";
    EXPECT_EQ(chosen_for(head + nodes), implicit) << "a cable goes slack";
}

// The bar swings under its weight: against steps by a tolerance. The linearised Euler method damps it at once.
TEST(Method, ARubberBarSwingsWithoutOptions) {
    const auto end = [](const std::string& steps) {
        Running run(parse_scene(steps + "end: 0.203\n" + bar, "test.yaml"));
        EXPECT_EQ(run.simulation.system().integrator, "radau_iia");
        run.finish();
        const auto& totals = run.simulation.totals();
        EXPECT_LE(std::abs(totals.energy - totals.start_energy), 1e-3 * totals.potential_drop);
        return run.simulation.state().q;
    };
    const auto found = end("step: 0.00517\n"), exact = end("tolerance: 1.0e-6\n");
    ASSERT_EQ(found.size(), exact.size());
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], exact[i], 1e-4);
}

TEST(Method, ThePlanSaysWhy) {
    Scene scene = parse_scene(head + chain(6), "test.yaml"), stopped = parse_scene(head + chain(6, ", lower: -1"), "t"),
          named = parse_scene(head + "integrator: rk4\n" + chain(6), "test.yaml");
    const auto said = [](Scene& of) {
        std::string all;
        const SystemPlan plan = make_plan(of, registry()).at(0);
        for (const auto& line : plan.kept) all += line.what + ": " + line.reason + "\n";
        return all;
    };
    EXPECT_NE(said(scene).find("integrator dormand_prince: the scene names none: nothing can touch"),
              std::string::npos);
    EXPECT_NE(said(scene).find("joint coordinates: the scene names none"), std::string::npos);
    EXPECT_NE(said(stopped).find("integrator moreau_jean: the scene names none: nothing can touch, joints have stops"),
              std::string::npos);
    EXPECT_EQ(said(named).find("integrator"), std::string::npos);
    Scene stiff = parse_scene(head + bar, "test.yaml");
    EXPECT_NE(said(stiff).find("integrator radau_iia: the scene names none: nothing can touch, and forces are stiff: "),
              std::string::npos)
        << said(stiff);
}

// The chain of six links falls through its lowest point and swings: what a first-order method lost a third of.
TEST(Method, AChainWithoutOptionsKeepsItsEnergy) {
    Running run(parse_scene(head + chain(6), "test.yaml"));
    run.finish();
    const auto& totals = run.simulation.totals();
    EXPECT_LE(std::abs(totals.energy - totals.start_energy), 1e-5 * totals.potential_drop);
    EXPECT_EQ(run.simulation.record().step, 775);
    EXPECT_GT(totals.divided_steps, 0);
    EXPECT_GT(totals.most_substeps, 1);
    EXPECT_TRUE(run.simulation.warnings().empty());
    Running exact(parse_scene(head + "integrator: {name: dormand_prince, options: {error_limit: 1.0e-9}}\n" + chain(6),
                              "test.yaml"));
    exact.finish();
    const Vector3 end = run.pose("l5").position, expected = exact.pose("l5").position;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(end[i], expected[i], 1e-3);  // it is chaotic
}

// Links between stops with dry friction in their hinges: against a step a fortieth as long. The linearised Euler method
// in maximal coordinates errs by 1e-2 m.
TEST(Method, StopsAndFrictionAreOfOrderTwo) {
    const auto end = [](double step) {
        Running run(parse_scene(
            fmt::format("step: {}\nend: 0.5\n{}", step, chain(6, ", lower: -0.8, upper: 0.8, friction: 0.1")), "test"));
        EXPECT_EQ(run.simulation.system().integrator, "moreau_jean");
        run.finish();
        EXPECT_EQ(run.simulation.totals().unsolved_steps, 0);
        EXPECT_GT(run.simulation.totals().most_contacts, 0);
        return run.pose("l5").position;
    };
    const Vector3 found = end(0.004), fine = end(0.0001);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[i], fine[i], 1e-3);
}

// A heavy arm falls to its stop and rests there: the stop carries m g l.
TEST(Method, AnArmComesToRestOnItsStop) {
    Running run(
        parse_scene("step: 0.00517\nend: 6\nbodies: [{name: arm, mass: 3, inertia: {xx: 0.02, yy: 0.02, zz: 0.02}, "
                    "position: [0.4, 0, 0]}]\njoints: [{name: hinge, kind: revolute, second: arm, point: [0, 0, "
                    "0], axis: [0, 1, 0], lower: -0.5, upper: 0.5}]\n",
                    "test"));
    run.finish();
    EXPECT_NEAR(run.pose("arm").position[2], -0.4 * std::sin(0.5), 1e-6);
    EXPECT_NEAR(run.velocities("arm")[1][1], 0.0, 1e-9);
    ASSERT_EQ(run.simulation.report().reactions.size(), 1U);
    EXPECT_NEAR(run.simulation.report().reactions[0].force[0], 3.0 * 9.81 * 0.4 * std::cos(0.5), 1e-4);
}

// Its error is that of the limit, whatever the step is.
TEST(ErrorLimit, HoldsForAnyStep) {
    const auto end = [](double step, double limit) {
        Running run(parse_scene(fmt::format("step: {}\nend: 1.3\nintegrator: {{name: dormand_prince, options: "
                                            "{{error_limit: {}}}}}\n{}",
                                            step, limit, chain(2)),
                                "test.yaml"));
        run.finish();
        return run.pose("l1").position;
    };
    const Vector3 exact = end(1e-3, 1e-11);
    for (const double step : {0.0073, 0.05, 0.4, 1.0}) {
        const Vector3 found = end(step, 1e-6);
        EXPECT_LE(std::hypot(found[0] - exact[0], found[2] - exact[2]), 1e-6) << step;
    }
}

// A motor whose speed jumps: from one path to the other, both exact.
TEST(ErrorLimit, PassesJumpsOfVelocities) {
    Running run(parse_scene("step: 0.01\nend: 1.515\n" + chain(2) +
                                "motors: [{name: m, joint: j0, motion: {table: {times: [0, 0.503, 0.911, 2], values: "
                                "[0, 0.7, 0.1, 1.2]}}}]\n",
                            "test.yaml"));
    EXPECT_EQ(run.simulation.system().integrator, "dormand_prince");
    run.finish();
    const double angle = 0.1 + 1.1 * (1.515 - 0.911) / (2.0 - 0.911);
    EXPECT_NEAR(run.pose("l0").position[0], 0.2 * std::cos(angle), 1e-12);
    EXPECT_NEAR(run.velocities("l0")[1][1], 1.1 / (2.0 - 0.911), 1e-9);
}

TEST(ErrorLimit, GoesOnFromACheckpointWithTheSameBits) {
    const std::string text = "step: 0.02\nend: 2\n" + chain(3);
    Running whole(parse_scene(text, "test.yaml")), resumed(parse_scene(text, "test.yaml"));
    while (whole.simulation.state().t < 0.7) whole.simulation.step();
    resumed.simulation.load(whole.simulation.save());
    whole.finish();
    resumed.finish();
    EXPECT_GT(whole.simulation.totals().most_substeps, 1);
    EXPECT_EQ(whole.simulation.totals().divided_steps, resumed.simulation.totals().divided_steps);
    EXPECT_EQ(whole.simulation.state().q, resumed.simulation.state().q);
    EXPECT_EQ(whole.simulation.state().v, resumed.simulation.state().v);
}

// A crank of 0.3 m turns away from a plane to which a rod of √0.05 m ties its end: until 0.2 + 0.3 sin t = √0.05.
TEST(ErrorLimit, SaysThatAMechanismJams) {
    Running run(parse_scene(
        "step: 0.01\nend: 3\nbodies:\n"
        "- {name: crank, mass: 1, inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, position: [0.15, 0, 0]}\n"
        "- {name: rod, mass: 1, inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, position: [0.3, 0, 0.1]}\n"
        "joints:\n"
        "- {name: a, kind: revolute, second: crank, point: [0, 0, 0], axis: [0, 1, 0]}\n"
        "- {name: b, kind: revolute, first: crank, second: rod, point: [0.3, 0, 0], axis: [0, 1, 0]}\n"
        "- {name: c, kind: point_on_plane, first: world, second: rod, point: [0.4, 0, 0.2], axis: [0, 0, 1]}\n"
        "motors: [{name: m, joint: a, speed: true, motion: 1}]\n",
        "test.yaml"));
    EXPECT_EQ(run.simulation.system().integrator, "dormand_prince");
    try {
        run.finish();
        FAIL();
    } catch (const StepFailure& failure) {
        EXPECT_NE(std::string(failure.what()).find("system \"main\", step"), std::string::npos) << failure.what();
    }
    EXPECT_NEAR(run.simulation.state().t, std::asin((std::sqrt(0.05) - 0.2) / 0.3), 0.01);
}

TEST(ErrorLimit, IsSaidByARun) {
    const ScratchFolder scratch;
    const auto file = (scratch / "chain.yaml").string();
    std::ofstream(file) << head << chain(6);
    const auto result = run_command("run " + file);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("775 steps of dormand_prince"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("steps taken in up to"), std::string::npos) << result.out;
    EXPECT_EQ(
        run_command("run " + file + " --set integrator.name=dormand_prince --set integrator.options.error_limit=0")
            .exit_code,
        2);
}

}  // namespace
}  // namespace delassus::tests::method_test
