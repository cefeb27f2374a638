// SPDX-License-Identifier: BSD-3-Clause
// A run's own estimate of its error against closed forms.
#include "simulation/run_check.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "delassus/registry.hpp"

namespace delassus::run_check_test {
namespace {

/// change: made to the system of the second run.
RunCheck check_of(
    const std::string& text, void (*change)(SceneSystem&) = [](SceneSystem&) {}) {
    const Registry registry;
    Scene scene = parse_scene(text, "test.yaml"), again = parse_scene(text, "test.yaml");
    std::vector<Simulation> first, refined;
    first.emplace_back(scene.systems.at(0), registry);
    std::vector<Track> tracks{Track(first[0])};
    while (!first[0].finished()) {
        first[0].step();
        tracks[0].add(first[0]);
    }
    halve_errors(again.systems.at(0));
    change(again.systems[0]);
    refined.emplace_back(again.systems[0], registry);
    return check_runs(first, tracks, refined, [] { return false; }).at(0);
}

// The implicit Euler method falls ½ g h t too far: half of that with half the step.
TEST(RunCheck, OfAFallIsTheErrorOfTheMethod) {
    const double g = 9.81, h = 0.013, end = 40 * h;
    const auto check = check_of(
        fmt::format("step: {:.17g}\nend: {:.17g}\nintegrator: {{name: euler_implicit_linearized}}\ngravity: [0, 0, "
                    "-9.81]\nbodies:\n"
                    "- {{name: stone, mass: 2, inertia: {{xx: 1e-4, yy: 1e-4, zz: 1e-4}}, position: [1, 2, 3]}}\n",
                    h, end));
    const double off = 0.5 * g * h * end;
    EXPECT_NEAR(check.extent, 0.5 * (0.5 * g * end * end + off), 1e-9);
    EXPECT_NEAR(check.position, 0.5 * off, 1e-9);
    EXPECT_NEAR(check.error * check.extent, off, 1e-9);
    EXPECT_EQ(check.farthest, "stone");
    EXPECT_EQ(check.failure, "");
    ASSERT_TRUE(check.apart_from);  // where ¼ g h t is the accuracy times the extent
    EXPECT_NEAR(*check.apart_from, check.accuracy * check.extent / (0.25 * g * h), h);
}

// A pendulum of a method of order 2: the error of the angle against one of a hundredth of the step.
TEST(RunCheck, OfASwingHasTheOrderOfTheMethod) {
    const auto scene = [](double step) {
        return fmt::format(
            "step: {:.17g}\nend: 1.5\nintegrator: {{name: trapezoidal_linearized}}\ncoordinates: joint\nbodies:\n"
            "- {{name: rod, mass: 1, inertia: {{xx: 0.1, yy: 0.1, zz: 0.1}}, position: [0.5, 0, 1]}}\njoints:\n"
            "- {{name: pin, kind: revolute, second: rod, point: [0, 0, 1], axis: [0, 1, 0]}}\n",
            step);
    };
    const auto end_of = [&](double step) {
        const Registry registry;
        Scene made = parse_scene(scene(step), "test.yaml");
        Simulation simulation(made.systems.at(0), registry);
        while (!simulation.finished()) simulation.step();
        return made.systems[0].system->pose(simulation.state(), 0).position;
    };
    const auto check = check_of(scene(0.01));
    const auto coarse = end_of(0.01), fine = end_of(0.0001);
    const double off = std::hypot(coarse[0] - fine[0], coarse[2] - fine[2]) / 0.5;  // rad
    EXPECT_EQ(check.factor, 4.0);
    EXPECT_GT(off, 1e-5);
    EXPECT_NEAR(check.error, off, 0.1 * off + check.error - check.rotation * 4.0 / 3.0);
    EXPECT_FALSE(check.apart_from);
}

TEST(RunCheck, AMotionThatIsExactShowsNoDifference) {
    const auto check = check_of(
        "step: 0.01\nend: 0.5\ngravity: [0, 0, 0]\nbodies:\n"
        "- {name: puck, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, velocity: [0.5, 0, 0]}\n");
    EXPECT_LT(check.error, 1e-12);
    EXPECT_LT(check.on_the_way, 1e-12);
    EXPECT_EQ(check.farthest, "");
    EXPECT_FALSE(check.apart_from);
}

TEST(RunCheck, ASecondRunThatFailsIsTold) {
    const auto check = check_of(
        "step: 0.01\nend: 0.5\ngravity: [0, 0, 0]\nbodies:\n"
        "- {name: puck, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, velocity: [0.5, 0, 0]}\n",
        [](SceneSystem& system) { system.limits.drift = -1.0; });
    EXPECT_NE(check.failure.find("drift"), std::string::npos) << check.failure;
}

// Halving acts on whatever decides the error.
TEST(RunCheck, HalvesWhatMayBeWrong) {
    const std::string body = "bodies:\n- {name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n";
    Scene stepped = parse_scene("step: 0.02\nend: 1\naccuracy: 1e-4\nintegrator: {name: rk4}\n" + body, "test.yaml");
    halve_errors(stepped.systems[0]);
    EXPECT_DOUBLE_EQ(stepped.systems[0].step, 0.01);
    EXPECT_DOUBLE_EQ(stepped.systems[0].accuracy, 5e-5);
    EXPECT_FALSE(stepped.systems[0].integrator_options.contains("error_limit"));
    Scene limited = parse_scene("step: 0.02\nend: 1\nintegrator: {name: switching}\n" + body, "test.yaml");
    halve_errors(limited.systems[0]);
    EXPECT_EQ(limited.systems[0].integrator_options.at("error_limit"), "5e-05");
    Scene chosen = parse_scene("tolerance: 1e-5\nend: 1\n" + body, "test.yaml");
    const auto before = *chosen.systems[0].control;
    halve_errors(chosen.systems[0]);
    EXPECT_DOUBLE_EQ(chosen.systems[0].control->absolute, 0.5 * before.absolute);
    EXPECT_DOUBLE_EQ(chosen.systems[0].control->relative, 0.5 * before.relative);
}

}  // namespace
}  // namespace delassus::run_check_test
