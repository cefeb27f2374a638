// SPDX-License-Identifier: BSD-3-Clause
// Steps at rest are taken once (simulation/unchanged_step.hpp).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string_view>
#include <variant>

#include "delassus/step_solver.hpp"
#include "simulation/step_columns.hpp"
#include "simulation/stepping.hpp"
#include "support/scenes.hpp"
#include "support/systems/sudden_load.hpp"

namespace delassus::tests::unchanged_steps_test {
namespace {

Running read(const std::string& yaml) {
    return Running(parse_scene(yaml, "rest"));
}

/// Two boxes on one another and what is given besides.
std::string stack(const std::string& more = {}) {
    return "step: 0.003\nend: 3\nmaterials: {m: {friction: 0.6}}\nbodies:\n"
           "  - {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
           "  - {name: a, mass: 2, position: [0, 0, 0.1], shapes: [{box: {size: [0.3, 0.3, 0.2]}, material: m}]}\n"
           "  - {name: b, mass: 3, position: [0.02, 0, 0.301], shapes: [{box: {size: [0.2, 0.2, 0.2]}, material: "
           "m}]}\n" +
           more;
}

TEST(UnchangedSteps, RestTakesNoSolves) {
    Running run = read(stack());
    while (run.simulation.state().t < 1.5) run.simulation.step();
    const std::int64_t solves = run.simulation.totals().plugin_solves;
    const State rest = run.simulation.state();
    run.finish();
    EXPECT_GT(solves, 0);
    EXPECT_EQ(run.simulation.totals().plugin_solves, solves);
    EXPECT_EQ(run.simulation.state().q, rest.q);
    EXPECT_EQ(run.simulation.record().contacts, 8);
    EXPECT_EQ(run.simulation.contacts().size(), 8U);
}

TEST(UnchangedSteps, AreTheStepsThatWouldBeTaken) {
    // A simulation that is loaded knows of no step before: each of its steps is taken.
    for (const char* more : {"", "loads: [{name: l, body: b, force: [5, 1, 0]}]\n"}) {
        Running whole = read(stack(more)), again = read(stack(more));
        for (int i = 0; i < 200; ++i) {
            again.simulation.load(again.simulation.save());
            whole.simulation.step();
            again.simulation.step();
            ASSERT_EQ(again.simulation.state().q, whole.simulation.state().q) << i;
            ASSERT_EQ(again.simulation.state().v, whole.simulation.state().v) << i;
            for (const StepColumn& column : step_columns)
                std::visit(
                    [&](auto member) {
                        if (std::string_view(column.name) == "seconds") return;
                        EXPECT_EQ(again.simulation.record().*member, whole.simulation.record().*member) << column.name;
                    },
                    column.value);
        }
        EXPECT_EQ(again.simulation.save().stepping.method, whole.simulation.save().stepping.method);
        EXPECT_GT(again.simulation.totals().plugin_solves, whole.simulation.totals().plugin_solves + 100);
    }
}

TEST(UnchangedSteps, AreTakenOnceWhereAnAccuracyChoosesSubsteps) {
    Running run = read(stack("accuracy: 1.0e-4\n"));
    while (run.simulation.state().t < 1.5) run.simulation.step();
    const SimulationTotals totals = run.simulation.totals();
    const State rest = run.simulation.state();
    run.finish();
    EXPECT_GT(totals.plugin_solves, 0);
    EXPECT_EQ(run.simulation.totals().plugin_solves, totals.plugin_solves);
    EXPECT_EQ(run.simulation.totals().solver_iterations, totals.solver_iterations);
    EXPECT_EQ(run.simulation.state().q, rest.q);
}

TEST(UnchangedSteps, EndWhereALoadSetsIn) {
    Running run =
        read(stack("loads: [{name: l, body: b, force: [{table: {times: [2, 2.001], values: [0, 30]}}, 0, 0]}]\n"));
    run.finish();
    EXPECT_GT(run.pose("b").position[0], 0.3);
}

TEST(UnchangedSteps, EndWhereGravityChanges) {
    Running run = read(stack());
    while (run.simulation.state().t < 2.0) run.simulation.step();
    run.scene.systems[0].system->set_gravity({0.0, 0.0, 1.0});
    run.finish();
    EXPECT_NEAR(run.pose("b").position[2], 0.3 + 0.5, 0.01);
}

TEST(UnchangedSteps, EndWhereAnInputChanges) {
    Running run = read(stack("loads: [{name: l, body: b, force: [{input: {name: push, start: 0}}, 0, 0]}]\n"));
    while (run.simulation.state().t < 2.0) run.simulation.step();
    run.simulation.set_input("push", 30.0);
    run.finish();
    EXPECT_GT(run.pose("b").position[0], 0.3);
}

TEST(UnchangedSteps, ABrakeHoldsAndAMotorTurns) {
    for (const double speed : {0.0, 2.0}) {
        Running run =
            read(fmt::format("step: 0.01\nend: 1\nintegrator: linearly_implicit_trapezoidal\nbodies:\n"
                             "  - {{name: a, mass: 1, inertia: {{xx: 0.1, yy: 0.1, zz: 0.1}}, position: [0.3, 0, 0]}}\n"
                             "joints: [{{name: j, kind: revolute, second: a, axis: [0, 1, 0], point: [0, 0, 0]}}]\n"
                             "motors: [{{name: m, joint: j, speed: true, motion: {}}}]\n",
                             speed));
        while (run.simulation.state().t < 0.5) run.simulation.step();
        const std::int64_t solves = run.simulation.totals().plugin_solves;
        run.finish();
        EXPECT_NEAR(run.velocities("a")[1][1], speed, 1e-9);
        EXPECT_NEAR(run.pose("a").position[0], 0.3 * std::cos(speed), 1e-3);
        EXPECT_EQ(run.simulation.totals().plugin_solves == solves, speed == 0.0);
    }
}

TEST(UnchangedSteps, SystemsOfUsersMayDependOnTime) {
    SuddenLoad system;
    SteppingSettings settings;
    settings.step = 0.01;
    settings.end = 2.0;
    Stepping stepping(system, make_timestepper("euler_implicit_linearized", system), settings);
    StepSolver solver(registry(), {});
    State state = system.initial_state();
    AdaptiveStepReport report;
    while (!stepping.ends(state.t)) stepping.advance(state, solver, report);
    EXPECT_NEAR(state.v[0], 100.0, 2.0);
}

}  // namespace
}  // namespace delassus::tests::unchanged_steps_test
