// SPDX-License-Identifier: BSD-3-Clause
// Going on from a saved state gives the same bits as never having stopped.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <nlohmann/json.hpp>
#include <variant>

#include "delassus/error.hpp"
#include "simulation/checkpoint.hpp"
#include "simulation/step_columns.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::resume_test {
namespace {

std::vector<std::uint64_t> bits(const std::vector<double>& values) {
    std::vector<std::uint64_t> result;
    for (const double value : values) result.push_back(std::bit_cast<std::uint64_t>(value));
    return result;
}

struct Case {
    const char *scene, *integrator;
    double step;
};

void PrintTo(const Case& one, std::ostream* out) {
    *out << one.scene << " " << one.integrator;
}

class Resume : public testing::TestWithParam<Case> {};

TEST_P(Resume, GivesTheSameBits) {
    constexpr int first = 23, all = 60;
    SceneOverrides overrides;
    overrides.integrator = GetParam().integrator;
    overrides.step = GetParam().step;
    overrides.end = 10;
    const auto read = [&] { return read_scene(example_scene(GetParam().scene), overrides); };
    Running whole(read()), stopped(read()), resumed(read());
    for (int i = 0; i < all; ++i) whole.simulation.step();
    for (int i = 0; i < first; ++i) stopped.simulation.step();

    const ScratchFolder scratch;
    const auto file = scratch / "checkpoint.json";
    write_checkpoint({"scene", {{"main", stopped.simulation.save(), {0.5}}}}, file);
    auto checkpoint = read_checkpoint(file);
    EXPECT_EQ(checkpoint.systems[0].frame_times, std::vector<double>{0.5});
    resumed.simulation.load(checkpoint.systems[0].simulation);
    EXPECT_EQ(resumed.simulation.record().step, first);
    for (int i = first; i < all; ++i) resumed.simulation.step();

    const auto expected = whole.simulation.save(), got = resumed.simulation.save();
    EXPECT_EQ(bits(got.state.q), bits(expected.state.q));
    EXPECT_EQ(bits(got.state.v), bits(expected.state.v));
    EXPECT_EQ(bits(got.stepping.method), bits(expected.stepping.method));
    EXPECT_EQ(got.totals.solver_iterations, expected.totals.solver_iterations);
    EXPECT_EQ(got.totals.energy, expected.totals.energy);
}

INSTANTIATE_TEST_SUITE_P(
    Scene, Resume,
    testing::Values(Case{"pendulum", "euler_implicit_linearized", 0.002}, Case{"pendulum", "euler_implicit", 0.0005},
                    Case{"pendulum", "trapezoidal", 0.0005}, Case{"pendulum", "trapezoidal_linearized", 0.0005},
                    Case{"pendulum", "newmark", 0.0005}, Case{"pendulum", "hht", 0.0005},
                    Case{"heavy_top", "generalized_alpha", 0.0005}, Case{"four_bar", "generalized_alpha", 0.002},
                    Case{"bricard", "hht", 0.02}, Case{"bouncing_ball", "euler_implicit_linearized", 0.02},
                    Case{"brick_wall", "euler_implicit_linearized", 0.002},
                    Case{"parcel_line", "euler_implicit_linearized", 0.002},
                    Case{"sphere_pile", "euler_implicit_linearized", 0.01}),
    [](const auto& parameter) { return std::string(parameter.param.scene) + "_" + parameter.param.integrator; });

// A spring that is wound by several turns: the orientation does not tell how many.
TEST(Checkpoint, HasTheTurnsOfSprings) {
    constexpr int first = 230, all = 400;
    const auto read = [&] {
        return parse_scene(
            "step: 0.002\nend: 10\ngravity: [0, 0, 0]\n"
            "bodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 2}, angular_velocity: [0, 0, 40]}]\n"
            "joints: [{name: h, kind: revolute, second: b, spring: {stiffness: 8}}]\n",
            "s");
    };
    Running whole(read()), stopped(read()), resumed(read());
    for (int i = 0; i < all; ++i) whole.simulation.step();
    for (int i = 0; i < first; ++i) stopped.simulation.step();
    const ScratchFolder scratch;
    const auto file = scratch / "checkpoint.json";
    write_checkpoint({"scene", {{"main", stopped.simulation.save(), {}}}}, file);
    resumed.simulation.load(read_checkpoint(file).systems[0].simulation);
    for (int i = first; i < all; ++i) resumed.simulation.step();
    const auto expected = whole.simulation.save(), got = resumed.simulation.save();
    EXPECT_GT(stopped.simulation.state().q.at(7), 4.0 * M_PI);
    EXPECT_EQ(bits(got.state.q), bits(expected.state.q));
    EXPECT_EQ(bits(got.state.v), bits(expected.state.v));
    EXPECT_EQ(got.totals.energy, expected.totals.energy);
}

TEST(Checkpoint, DamagedFilesAreRefused) {
    const ScratchFolder scratch;
    const auto file = scratch / "checkpoint.json";
    const auto told = [&](const std::string& text) -> std::string {
        std::ofstream(file) << text;
        try {
            static_cast<void>(read_checkpoint(file));
        } catch (const InputError& error) {
            return std::string(error.what()).substr(file.string().size() + 2);
        }
        return "taken";
    };
    EXPECT_EQ(told("{"), "the checkpoint is damaged");
    EXPECT_EQ(told("{\"format\": \"x\", \"version\": 1}"),
              "the checkpoint cannot be used: it is not a checkpoint of Delassus");
    EXPECT_EQ(told("{\"format\": \"delassus-checkpoint\", \"version\": 1}"),
              "the checkpoint cannot be used: it was written by another version of Delassus");
    EXPECT_EQ(told("{\"format\": \"delassus-checkpoint\", \"version\": 8}"),
              "the checkpoint cannot be used: it was written by another version of Delassus");
    EXPECT_EQ(told("{\"format\": \"delassus-checkpoint\", \"version\": 20, \"scene\": \"\", \"systems\": []}"),
              "the checkpoint cannot be used: it is damaged: its checksum is not that of its content");
}

// Also one that leaves JSON and numbers whole.
TEST(Checkpoint, EveryChangedCharacterIsSeen) {
    const ScratchFolder scratch;
    const auto file = scratch / "checkpoint.json";
    SimulationState state;
    state.state = {0.25, {1.0, 2.0}, {3.0}};
    Checkpoint written{"scene", {{"main", state, {0.5}, {}, {7, 8}}}, true, 3, 5};
    write_checkpoint(written, file);
    const Checkpoint read = read_checkpoint(file);
    EXPECT_TRUE(read.contact_forces);
    EXPECT_EQ(read.every, 3);
    EXPECT_EQ(read.pictures, 5);
    EXPECT_FALSE(read.dump);
    EXPECT_EQ(read.systems[0].written, (std::vector<std::uint64_t>{7, 8}));
    const std::string text = text_of(file);
    for (std::size_t at = 0; at < text.size(); ++at)
        for (const char other : {'0', '1', 'f', ' ', '"'}) {
            if (text[at] == other) continue;
            std::string changed = text;
            changed[at] = other;
            std::ofstream(file) << changed;
            EXPECT_THROW(static_cast<void>(read_checkpoint(file)), InputError) << at << ": " << text.substr(at, 20);
        }
    for (const std::string& changed : {text.substr(0, text.size() - 1), text + " ", text + text, std::string()}) {
        std::ofstream(file) << changed;
        EXPECT_THROW(static_cast<void>(read_checkpoint(file)), InputError);
    }
}

/// A checkpoint of totals that all differ, as JSON.
struct WithTotals {
    WithTotals() {
        double number = 0.125;
        for (const TotalColumn& column : total_columns)
            std::visit([&](auto member) { set(totals.*member, number += 1.0); }, column.value);
        totals.first_unsolved = "step 7: \"so\"";
        SimulationState state;
        state.totals = totals;
        write_checkpoint({"scene", {{"main", state, {}}}}, file);
        std::ifstream(file) >> json;
    }
    static void set(double& total, double number) { total = number; }
    static void set(std::int64_t& total, double number) { total = static_cast<std::int64_t>(number); }
    static void set(std::string&, double) {}

    [[nodiscard]] nlohmann::json& written() { return json["systems"][0]["totals"]; }
    [[nodiscard]] SimulationTotals read() const { return read_checkpoint(file).systems.at(0).simulation.totals; }
    void expect_all_of(const SimulationTotals& got) const {
        for (const TotalColumn& column : total_columns)
            std::visit([&](auto member) { EXPECT_EQ(got.*member, totals.*member) << column.name; }, column.value);
    }

    ScratchFolder scratch;
    std::filesystem::path file = scratch / "checkpoint.json";
    SimulationTotals totals;
    nlohmann::json json;
};

TEST(Checkpoint, NamesItsTotals) {
    WithTotals checkpoint;
    checkpoint.expect_all_of(checkpoint.read());
    EXPECT_EQ(checkpoint.written().size(), total_columns.size());
    EXPECT_TRUE(checkpoint.written().contains("growth_share"));
}

TEST(Checkpoint, OfAnotherSystemIsRefused) {
    Running pendulum(read_scene(example_scene("pendulum"))), top(read_scene(example_scene("four_bar")));
    EXPECT_THROW(pendulum.simulation.load(top.simulation.save()), InputError);
}

TEST(Simulation, LastStepIsShorterWhereTheEndIsNoMultiple) {
    SceneOverrides overrides;
    overrides.step = 0.03;
    overrides.end = 0.1;
    Running run(read_scene(example_scene("pendulum"), overrides));
    run.finish();
    EXPECT_EQ(run.simulation.record().step, 4);
    EXPECT_DOUBLE_EQ(run.simulation.state().t, 0.1);
}

// Whose steps are divided since they gain energy: the share that a step may gain does not depend on where a run is
// ended for a time.
TEST(Simulation, ARunThatIsEndedBeforeTakesTheSameSteps) {
    const std::string text =
        "step: 0.009\nend: 4\nmaterials: {m: {friction: 0.6}}\nbodies:\n"
        "- {name: ground, fixed: true, shapes: [{plane: {}, material: m}]}\n"
        "- {name: wheel, mass: 1, inertia: {xx: 0.004, yy: 0.004, zz: 0.004}, position: [0.05, 0, 0.1], shapes: "
        "[{cylinder: "
        "{radius: 0.1, length: 0.2}, position: [-0.05, 0, 0], orientation: {axis: [1, 0, 0], angle: 90}, material: "
        "m}]}\n";
    Running whole(parse_scene(text, "test.yaml"));
    SceneOverrides overrides;
    overrides.end = 1.404;
    Running first(parse_scene(text, "test.yaml", overrides));
    first.finish();
    ASSERT_GT(first.simulation.totals().divided_steps, 0);
    while (whole.simulation.record().step < first.simulation.record().step) whole.simulation.step();
    EXPECT_EQ(bits(first.simulation.state().q), bits(whole.simulation.state().q));
}

TEST(Simulation, FailedStepLeavesTheLastState) {
    SceneOverrides overrides;
    overrides.integrator = "euler_implicit(max_newton_iterations=1)";
    Running run(read_scene(example_scene("heavy_top"), overrides));
    const State before = run.simulation.state();
    try {
        while (true) run.simulation.step();
    } catch (const StepFailure& failure) {
        EXPECT_NE(std::string(failure.what()).find("system \"main\", step 1 from t = 0 s: "), std::string::npos)
            << failure.what();
    }
    EXPECT_EQ(bits(run.simulation.state().q), bits(before.q));
    EXPECT_EQ(run.simulation.record().step, 0);
}

}  // namespace
}  // namespace delassus::tests::resume_test
