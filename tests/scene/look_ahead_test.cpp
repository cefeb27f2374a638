// SPDX-License-Identifier: BSD-3-Clause
// Steps of a method that are longer than those that are shown: what is shown, and that nothing else is different.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "delassus/error.hpp"
#include "simulation/checkpoint.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::look_ahead_test {
namespace {

std::string chain(int links, const std::string& last = "") {
    return fmt::format(
        "bodies:\n"
        "- {{name: 'l{{i}}', mass: 1.137, inertia: {{xx: 0.001, yy: 0.0152, zz: 0.0152}}, position: [0.2, 0, 0], "
        "repeat: {{count: {}, spacing: [0.4, 0, 0]}}}}\n"
        "joints:\n"
        "- {{name: j0, kind: revolute, second: l0, point: [0, 0, 0], axis: [0, 1, 0]}}\n"
        "- {{name: 'j{{i+1}}', kind: revolute, first: 'l{{i}}', second: 'l{{i+1}}', point: [0.4, 0, 0], axis: [0, 1, "
        "0], repeat: {{count: {}, spacing: [0.4, 0, 0]}}}}\n{}",
        links, links - 1, last);
}

const std::string ball_joints =
    "bodies:\n"
    "- {name: a, mass: 1, inertia: {xx: 0.02, yy: 0.03, zz: 0.04}, position: [0.3, 0, 0], velocity: [0, 0.3, 0]}\n"
    "- {name: b, mass: 1, inertia: {xx: 0.02, yy: 0.03, zz: 0.04}, position: [0.8, 0.1, 0]}\n"
    "joints:\n"
    "- {name: i, kind: spherical, second: a, point: [0, 0, 0]}\n"
    "- {name: j, kind: spherical, first: a, second: b, point: [0.5, 0, 0]}\n";

const std::string four_bar =
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "- {name: a, mass: 1, inertia: {xx: 0.02, yy: 0.03, zz: 0.04}, position: [0, 0.15, 0], angular_velocity: [0, 0, "
    "4]}\n"
    "- {name: b, mass: 1, inertia: {xx: 0.02, yy: 0.03, zz: 0.04}, position: [0.25, 0.35, 0]}\n"
    "- {name: c, mass: 1, inertia: {xx: 0.02, yy: 0.03, zz: 0.04}, position: [0.5, 0.2, 0]}\n"
    "joints:\n"
    "- {name: i, kind: revolute, second: a, point: [0, 0, 0], axis: [0, 0, 1]}\n"
    "- {name: j, kind: revolute, first: a, second: b, point: [0, 0.3, 0], axis: [0, 0, 1]}\n"
    "- {name: k, kind: revolute, first: b, second: c, point: [0.5, 0.4, 0], axis: [0, 0, 1]}\n"
    "- {name: l, kind: revolute, second: c, point: [0.5, 0, 0], axis: [0, 0, 1]}\n";

const std::string beam =
    "bodies: []\n"
    "beams: [{name: beam, from: [0, 0, 0], to: [0.6, 0, 0], elements: 3, section: {rectangle: [0.01, 0.01]}, young: "
    "2.0e+11, density: 7800}]\n"
    "joints: [{name: h, kind: revolute, second: beam_0, point: [0, 0, 0], axis: [0, 1, 0]}]\n";

struct Subject {
    const char* name;
    std::string text;
    const char* method;
    const char* coordinates;
    double step, end;
    double fewer;  ///< problems, at least
};

std::vector<Subject> subjects() {
    return {{"chain_in_joints", chain(3), "dormand_prince", "joint", 0.00173, 0.8, 2.5},
            {"chain_in_bodies", chain(3), "dormand_prince", "maximal", 0.00173, 0.8, 1.7},
            {"balls_in_joints", ball_joints, "dormand_prince", "joint", 0.00173, 0.8, 2.5},
            {"balls_in_bodies", ball_joints, "dormand_prince", "maximal", 0.00173, 0.8, 1.8},
            {"loop_in_joints", four_bar, "dormand_prince", "joint", 0.00173, 0.8, 1.8},
            {"chain_by_radau", chain(3), "radau_iia", "joint", 0.00173, 0.8, 2.0},
            {"loop_by_radau", four_bar, "radau_iia", "joint", 0.00173, 0.8, 2.0},
            {"beam_by_radau", beam, "radau_iia", "maximal", 0.00073, 0.2, 1.5}};
}

std::string scene_of(const Subject& subject, double limit, double step, double end) {
    return fmt::format("step: {}\nend: {}\ncoordinates: {}\nintegrator: {{name: {}, options: {{error_limit: {}}}}}\n{}",
                       step, end, subject.coordinates, subject.method, limit, subject.text);
}

class LookAheadOf : public testing::TestWithParam<Subject> {};

// Every state shown, against steps of an error that is smaller by 10⁴; it costs less than without.
TEST_P(LookAheadOf, ShowsTheMotion) {
    const Subject& subject = GetParam();
    constexpr double limit = 1e-4;
    Running run(parse_scene(scene_of(subject, limit, subject.step, subject.end), "test"));
    Running fine(parse_scene(scene_of(subject, 1e-8, subject.step, subject.end), "test"));
    Running each(parse_scene(fmt::format("step: {}\nend: {}\ncoordinates: {}\nintegrator: {}\n{}", subject.step,
                                         subject.end, subject.coordinates, subject.method, subject.text),
                             "test"));
    const MultibodySystem& system = run.system();
    std::vector<double> off(static_cast<std::size_t>(system.n()));
    double worst = 0.0, worst_force = 0.0, largest_force = 0.0;
    std::int64_t step = 0;
    while (!run.simulation.finished()) {
        const StepRecord& record = run.simulation.step();
        fine.simulation.step();
        each.simulation.step();
        ASSERT_EQ(record.t, each.simulation.record().t) << "the same times as by steps of that size";
        ASSERT_EQ(record.step, ++step);
        EXPECT_LE(record.h, subject.step * (1.0 + 1e-9));
        EXPECT_LE(record.drift, 1e-12);
        EXPECT_EQ(record.energy, system.energy(run.simulation.state()));
        system.difference(fine.simulation.state().q.data(), run.simulation.state().q.data(), off.data());
        for (const double one : off) worst = std::max(worst, std::abs(one));
        const std::vector<double> lambda = run.simulation.multipliers(), expected = fine.simulation.multipliers();
        ASSERT_EQ(lambda.size(), expected.size());
        for (std::size_t i = 0; i < lambda.size(); ++i) {
            worst_force = std::max(worst_force, std::abs(lambda[i] - expected[i]));
            largest_force = std::max(largest_force, std::abs(expected[i]));
        }
    }
    EXPECT_LE(worst, 10.0 * limit);
    EXPECT_GT(worst, 1e-9) << "it does not look ahead";
    EXPECT_LE(worst_force, 0.05 * largest_force);
    const auto& totals = run.simulation.totals();
    EXPECT_LE(std::abs(totals.energy - totals.start_energy), 1e-3 * std::max(1.0, totals.potential_drop));
    EXPECT_LE(totals.divided_steps, run.simulation.record().step / 4);
    EXPECT_LE(subject.fewer * static_cast<double>(totals.newton_iterations),
              static_cast<double>(each.simulation.totals().newton_iterations));
}

// What is ahead is part of a checkpoint.
TEST_P(LookAheadOf, GoesOnFromACheckpointWithTheSameBits) {
    const Subject& subject = GetParam();
    const auto read = [&] { return parse_scene(scene_of(subject, 1e-4, subject.step, 100.0 * subject.step), "test"); };
    Running whole(read());
    const ScratchFolder scratch;
    const auto file = scratch / "checkpoint.json";
    for (int first = 1; first <= 41; first += 8) {
        while (whole.simulation.record().step < first) whole.simulation.step();
        write_checkpoint({"scene", {{"main", whole.simulation.save(), {}}}}, file);
        Running resumed(read()), undisturbed(read());
        resumed.simulation.load(read_checkpoint(file).systems[0].simulation);
        EXPECT_EQ(resumed.simulation.state().q, whole.simulation.state().q);
        while (undisturbed.simulation.record().step < first + 30) undisturbed.simulation.step();
        for (int i = 0; i < 30; ++i) resumed.simulation.step();
        EXPECT_EQ(resumed.simulation.state().q, undisturbed.simulation.state().q) << first;
        EXPECT_EQ(resumed.simulation.state().v, undisturbed.simulation.state().v);
        EXPECT_EQ(resumed.simulation.multipliers(), undisturbed.simulation.multipliers());
        EXPECT_EQ(resumed.simulation.totals().newton_iterations, undisturbed.simulation.totals().newton_iterations);
        EXPECT_EQ(resumed.simulation.save().stepping.ahead, undisturbed.simulation.save().stepping.ahead);
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, LookAheadOf, testing::ValuesIn(subjects()),
                         [](const auto& one) { return std::string(one.param.name); });

// Where a run ends is nothing that its method knows of.
TEST(LookAhead, TheEndOfARunChangesNothingBeforeIt) {
    const auto at = [](double end) {
        Running run(parse_scene(fmt::format("step: 0.002\nend: {}\n{}", end, chain(3)), "test"));
        while (run.simulation.state().t < 0.2 - 1e-9) run.simulation.step();
        return run.simulation.state();
    };
    const State shorter = at(0.2), longer = at(1.0);
    EXPECT_EQ(shorter.q, longer.q);
    EXPECT_EQ(shorter.v, longer.v);
}

// Weight that goes from one step to the next: the next state shown knows it.
TEST(LookAhead, ForgetsWhatIsAheadWhenTheSystemIsChanged) {
    Running run(
        parse_scene("step: 0.01\nend: 1\nbodies: [{name: b, mass: 2, inertia: {xx: 1, yy: 1, zz: 1}, "
                    "position: [0, 0, 0], velocity: [1, 0, 3]}]\n",
                    "test"));
    EXPECT_EQ(run.simulation.system().integrator, "dormand_prince");
    for (int i = 0; i < 37; ++i) run.simulation.step();
    const double v = 3.0 - 9.81 * 0.37;
    EXPECT_NEAR(run.velocities("b")[0][2], v, 1e-12);
    EXPECT_FALSE(run.simulation.save().stepping.ahead.empty());
    run.scene.systems[0].system->set_gravity({0.0, 0.0, 0.0});
    for (int i = 0; i < 5; ++i) {
        const double z = run.pose("b").position[2];
        run.simulation.step();
        EXPECT_NEAR(run.velocities("b")[0][2], v, 1e-12);
        EXPECT_NEAR(run.pose("b").position[2], z + 0.01 * v, 1e-12);
    }
    run.scene.systems[0].system->set_gravity({0.0, 0.0, -4.0});
    for (int i = 0; i < 10; ++i) run.simulation.step();
    EXPECT_NEAR(run.velocities("b")[0][2], v - 4.0 * 0.1, 1e-12);
}

/// A ball under a force that a program decides from step to step, as a controller.
struct Controlled {
    explicit Controlled(Motion force)
        : scene(parse_scene("step: 0.01\nend: 1\nlimits: {energy_growth: null}\nbodies: [{name: b, mass: 2, inertia: "
                            "{xx: 1, yy: 1, zz: 1}, position: [0, 0, 0]}]\n",
                            "test")) {
        auto system = std::make_unique<MultibodySystem>();
        system->set_gravity({0.0, 0.0, 0.0});
        system->add_body(scene.systems[0].bodies.at(0));
        LoadParameters load;
        load.name = "control";
        load.body = 0;
        load.force[0] = std::move(force);
        system->add_load(load);
        system->finish();
        scene.systems[0].system = std::move(system);
    }
    Scene scene;
};

TEST(LookAhead, IsNotDoneWhereForcesMayDependOnTheCaller) {
    double now = 0.0;
    const auto none = [](double) { return 0.0; };
    Controlled controlled(Motion{[&now](double) { return now; }, none, none, none});
    EXPECT_FALSE(controlled.scene.systems[0].system->foreseeable());
    Simulation simulation(controlled.scene.systems[0], registry());
    double last = -2.5;
    for (int i = 0; i < 50; ++i) {
        now = i % 7 - 2.5;
        const double before = simulation.state().v[0];
        simulation.step();
        // The acceleration of the end of the last step may be the first one of this: its weight is 35/384.
        EXPECT_NEAR(simulation.state().v[0] - before, 0.01 * now / 2.0,
                    35.0 / 384.0 * 0.01 * std::abs(now - last) / 2.0 + 1e-13);
        last = now;
        EXPECT_TRUE(simulation.save().stepping.ahead.empty());
    }
    Controlled known(Motion::constant(3.0));
    EXPECT_TRUE(known.scene.systems[0].system->foreseeable());
    Simulation looking(known.scene.systems[0], registry());
    for (int i = 0; i < 50; ++i) looking.step();
    EXPECT_FALSE(looking.save().stepping.ahead.empty());
    EXPECT_NEAR(looking.state().v[0], 0.75, 1e-12);
}

// A push of a hundredth of a second, long after everything is at rest.
TEST(LookAhead, SeesAShortPush) {
    Running run(
        parse_scene("step: 0.01\nend: 3\ngravity: [0, 0, 0]\n"
                    "bodies: [{name: b, mass: 2, inertia: {xx: 1, yy: 1, zz: 1}, position: [0, 0, 0]}]\n"
                    "loads: [{name: push, body: b, point: [0, 0, 0], force: [{table: {times: [0, 1.234, 1.239, "
                    "1.244], values: [0, 0, 80, 0]}}, 0, 0]}]\n",
                    "test"));
    std::int64_t problems = 0;
    while (!run.simulation.finished()) {
        const StepRecord& record = run.simulation.step();
        problems += record.newton_iterations;
        const double t = record.t, v = run.velocities("b")[0][0];
        if (t >= 1.234 && t <= 1.244) continue;
        EXPECT_NEAR(v, t < 1.234 ? 0.0 : 0.5 * 80.0 * 0.01 / 2.0, 1e-10);
    }
    EXPECT_LT(problems, 6 * 100) << "of 300 steps shown";
    EXPECT_EQ(run.simulation.totals().divided_steps, 0) << "no step was too long";
}

// A curve by points a step apart: as without.
TEST(LookAhead, FollowsATableOfManyPoints) {
    std::string times = "0", values = "0";
    for (int i = 1; i <= 100; ++i) {
        times += fmt::format(", {}", 0.01 * i);
        values += fmt::format(", {}", 0.3 * std::sin(0.02 * M_PI * i));
    }
    Running run(parse_scene("step: 0.01\nend: 1\n" + chain(2) +
                                fmt::format("motors: [{{name: m, joint: j0, motion: {{table: {{times: [{}], values: "
                                            "[{}], interpolation: cubic}}}}}}]\n",
                                            times, values),
                            "test"));
    EXPECT_EQ(run.simulation.system().integrator, "dormand_prince");
    for (int i = 1; i < 100; ++i) {
        run.simulation.step();
        const double angle = 0.3 * std::sin(0.02 * M_PI * i);
        EXPECT_NEAR(run.pose("l0").position[2], -0.2 * std::sin(angle), 1e-9);
    }
}

// A spring that is wound by six turns: in steps that are longer than those shown as well, turns are counted.
TEST(LookAhead, CountsTheTurnsOfSprings) {
    for (const std::string coordinates : {"joint", "maximal"}) {
        Running run(parse_scene("step: 0.002\nend: 2\ngravity: [0, 0, 0]\ncoordinates: " + coordinates +
                                    "\nintegrator: {name: dormand_prince, options: {error_limit: 1.0e-6}}\n"
                                    "bodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 2}, angular_velocity: "
                                    "[0, 0, 80]}]\n"
                                    "joints: [{name: h, kind: revolute, second: b, spring: {stiffness: 8}}]\n",
                                "s"));
        while (!run.simulation.finished()) {
            const double t = run.simulation.step().t;
            EXPECT_NEAR(run.velocities("b")[1][2], 80.0 * std::cos(2.0 * t), 1e-4);
        }
        EXPECT_LT(run.simulation.totals().newton_iterations, 6 * 1000 / 2);
    }
}

// A step that is interrupted leaves what is ahead as it was.
TEST(LookAhead, AnInterruptedStepChangesNothing) {
    const std::string text = "step: 0.002\nend: 1\n" + four_bar;
    Running run(parse_scene(text, "test")), undisturbed(parse_scene(text, "test"));
    int asked = 0, interrupted = 0;
    for (int i = 0; i < 200; ++i) {
        undisturbed.simulation.step();
        asked = 0;
        run.simulation.solver().interrupt_by([&] { return ++asked == 1 + i % 5; });
        const std::vector<double> before = run.simulation.save().stepping.ahead;
        try {
            run.simulation.step();
        } catch (const StepInterrupted&) {
            ++interrupted;
            EXPECT_EQ(run.simulation.save().stepping.ahead, before);
            run.simulation.solver().interrupt_by(nullptr);
            run.simulation.step();
        }
    }
    EXPECT_GT(interrupted, 50);
    EXPECT_EQ(run.simulation.state().q, undisturbed.simulation.state().q);
    EXPECT_EQ(run.simulation.state().v, undisturbed.simulation.state().v);
}

// With a limit that bounds nothing the way of a step may be too far from the joints: then a step ends there.
TEST(LookAhead, TakesAStepWhereTheWayCannotBeReturnedToTheJoints) {
    SceneOverrides overrides;
    overrides.values = {{"coordinates", "maximal"}};
    overrides.step = 0.05;
    overrides.integrator = "dormand_prince(error_limit=1e5)";
    overrides.end = 2;
    Running run(read_scene(example_scene("double_pendulum"), overrides));
    int ends = 0;
    while (!run.simulation.finished()) {
        const StepRecord& record = run.simulation.step();
        EXPECT_LE(record.drift, 1e-12);
        const std::vector<double> ahead = run.simulation.save().stepping.ahead;
        ends += ahead.at(1) == 0.0 && ahead.at(4) == record.t ? 1 : 0;
    }
    EXPECT_GE(ends, 1);
    EXPECT_LT(ends, 10);
}

// Bars that lie flat, where rows lose rank: forty times in the motion of four bars as a parallelogram.
TEST(LookAhead, PassesPlacesWhereRowsLoseRank) {
    SceneOverrides overrides;
    overrides.step = 0.004;
    overrides.integrator = "dormand_prince(error_limit=1e-4)";
    overrides.end = 10;
    Running run(read_scene(example_scene("four_bars"), overrides));
    run.finish();
    const auto& totals = run.simulation.totals();
    EXPECT_LE(std::abs(totals.energy - totals.start_energy), 1e-3);
    EXPECT_LE(totals.worst_drift, 1e-10);
}

// A parallelogram that a motor drives through its flat positions, shown in these very positions, where rows lose rank
// and cranks that cross would fit as well.
TEST(LookAhead, FlatPositionsThatAreShownDoNotChangeTheBranch) {
    for (const double h : {0.002, 0.005, 0.01, 1.0 / 60.0}) {
        Running run(parse_scene(
            fmt::format(
                "step: {:.17g}\nend: 3.1\nbodies:\n"
                "- {{name: crank, mass: 0.3, inertia: {{xx: 0.002, yy: 0.002, zz: 1e-5}}, position: [0, 0, 0.15]}}\n"
                "- {{name: coupler, mass: 1, inertia: {{xx: 1e-4, yy: 0.08, zz: 0.08}}, position: [0.5, 0, 0.3]}}\n"
                "- {{name: rocker, mass: 0.3, inertia: {{xx: 0.002, yy: 0.002, zz: 1e-5}}, position: [1, 0, 0.15]}}\n"
                "joints:\n"
                "- {{name: O, kind: revolute, second: crank, point: [0, 0, 0], axis: [0, -1, 0], start_rate: "
                "6.283185307179586}}\n"
                "- {{name: A, kind: revolute, first: crank, second: coupler, point: [0, 0, 0.3], axis: [0, -1, 0]}}\n"
                "- {{name: B, kind: revolute, first: coupler, second: rocker, point: [1, 0, 0.3], axis: [0, -1, 0]}}\n"
                "- {{name: G, kind: revolute, second: rocker, point: [1, 0, 0], axis: [0, -1, 0]}}\n"
                "motors: [{{name: m, joint: O, speed: true, motion: 6.283185307179586}}]\n",
                h),
            "test.yaml"));
        while (!run.simulation.finished()) {
            run.simulation.step();
            const double t = run.simulation.state().t;
            const Pose coupler = run.pose("coupler");
            ASSERT_NEAR(coupler.position[2], 0.3 * std::cos(2.0 * std::numbers::pi * t), 1e-4) << h << " at " << t;
            ASSERT_NEAR(coupler.orientation[2], 0.0, 1e-4) << h << " at " << t;
        }
    }
}

}  // namespace
}  // namespace delassus::tests::look_ahead_test
