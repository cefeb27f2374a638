// SPDX-License-Identifier: BSD-3-Clause
// Inputs: numbers that a program sets while a simulation runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "delassus/error.hpp"
#include "support/scenes.hpp"

namespace delassus::inputs_test {
namespace {

using tests::Running;

Running run_of(const std::string& text) {
    return Running(parse_scene(text, "test.yaml"));
}

std::string refusal(const std::string& text) {
    try {
        static_cast<void>(parse_scene(text, "test.yaml"));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

// A mass of 2 kg that a force pushes along x, 3 N, then −5 N, then 0. Whatever a method keeps of the step before a
// jump, the velocity is ∫ f/m.
class EveryMethod : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryMethod, AForceHoldsFromWhenItIsSet) {
    auto run =
        run_of(fmt::format("step: 0.01\nend: 1\nintegrator: {{name: {}}}\ngravity: [0, 0, 0]\nbodies:\n"
                           "- {{name: mass, mass: 2, inertia: {{xx: 1, yy: 1, zz: 1}}}}\nloads:\n"
                           "- {{name: push, body: mass, force: [{{input: {{name: f, start: 3}}}}, {{input: {{name: f, "
                           "scale: -2}}}}, 0]}}\n",
                           GetParam()));
    double v = 0.0, force = 3.0;
    for (const double next : {-5.0, 0.0, 1.0}) {
        for (int k = 0; k < 20; ++k) run.simulation.step();
        v += force / 2.0 * 0.2;
        EXPECT_NEAR(run.velocities("mass")[0][0], v, 1e-9);
        EXPECT_NEAR(run.velocities("mass")[0][1], -2.0 * v, 1e-9);
        run.simulation.set_input("f", next);
        EXPECT_EQ(run.simulation.input("f"), next);
        force = next;
    }
}

INSTANTIATE_TEST_SUITE_P(Inputs, EveryMethod,
                         ::testing::Values("auto", "euler_implicit_linearized", "euler_implicit", "rk4",
                                           "dormand_prince", "dormand_prince, options: {error_limit: 1e-6}",
                                           "radau_iia", "hht", "generalized_alpha", "moreau_jean",
                                           "nonsmooth_generalized_alpha", "linearly_implicit_trapezoidal",
                                           "switching"));

const std::string hinge =
    "bodies:\n- {name: disc, mass: 1, inertia: {xx: 1, yy: 1, zz: 0.5}}\njoints:\n"
    "- {name: pin, kind: revolute, second: disc, point: [0, 0, 0], axis: [0, 0, 1]}\n"
    "- {name: rail, kind: prismatic, second: cart, point: [0, 3, 0], axis: [1, 0, 0]}\n";

std::string with_cart(std::string text) {
    const std::string cart = "- {name: cart, mass: 3, inertia: {xx: 1, yy: 1, zz: 1}, position: [0, 3, 0]}\n";
    return text.insert(text.find("joints:"), cart);
}

// The angle is the integral of the speed, over more than a turn.
TEST(Inputs, AMotorFollowsItsSpeed) {
    for (const char* coordinates : {"joint", "maximal"}) {
        SCOPED_TRACE(coordinates);
        auto run = run_of(fmt::format("step: 0.005\nend: 2\ngravity: [0, 0, 0]\ncoordinates: {}\n", coordinates) +
                          with_cart(hinge) +
                          "motors:\n- {name: drive, joint: pin, speed: true, motion: {input: speed}}\n"
                          "actuators:\n- {name: servo, joint: rail, position: {input: place}, kp: 400, kd: 80}\n");
        double angle = 0.0, speed = 0.0;
        run.simulation.set_input("place", 0.25);
        for (const double next : {7.0, -2.0, 12.0, 0.0}) {
            for (int k = 0; k < 100; ++k) run.simulation.step();
            angle += 0.5 * speed;
            const auto [now, rate] = run.system().joint_coordinate(run.simulation.state(), 0);
            EXPECT_NEAR(std::remainder(now - angle, 2.0 * M_PI), 0.0, 1e-6);
            EXPECT_NEAR(rate, speed, 1e-6);
            speed = next;
            run.simulation.set_input("speed", next);
        }
        const auto [place, rate] = run.system().joint_coordinate(run.simulation.state(), 1);
        EXPECT_NEAR(place, 0.25, 1e-4);
        EXPECT_NEAR(rate, 0.0, 1e-3);
    }
}

TEST(Inputs, ACheckpointHasThem) {
    const std::string text = "step: 0.01\nend: 1\n" + with_cart(hinge) +
                             "loads:\n- {name: turn, body: disc, torque: [0, 0, {input: torque}]}\n"
                             "motors:\n- {name: drive, joint: rail, speed: true, motion: {input: speed}}\n";
    auto one = run_of(text), other = run_of(text);
    for (int k = 0; k < 7; ++k) one.simulation.step();
    one.simulation.set_input("torque", 1.5);
    one.simulation.set_input("speed", 0.2);
    for (int k = 0; k < 4; ++k) one.simulation.step();
    one.simulation.set_input("torque", -0.5);
    other.simulation.load(one.simulation.save());
    EXPECT_EQ(other.simulation.input("torque"), -0.5);
    for (int k = 0; k < 9; ++k) {
        one.simulation.step();
        other.simulation.step();
    }
    EXPECT_EQ(one.simulation.state().q, other.simulation.state().q);
    EXPECT_EQ(one.simulation.state().v, other.simulation.state().v);
}

TEST(Inputs, TwoSimulationsOfASystemHaveTheirOwn) {
    Scene scene = parse_scene("step: 0.01\nend: 1\ngravity: [0, 0, 0]\n" + with_cart(hinge) +
                                  "loads:\n- {name: push, body: cart, force: [{input: push}, 0, 0]}\n",
                              "test.yaml");
    Simulation first(scene.systems[0], tests::registry());
    first.set_input("push", 3.0);
    Simulation second(scene.systems[0], tests::registry());
    EXPECT_EQ(second.input("push"), 0.0);
    for (int k = 0; k < 10; ++k) {
        first.step();
        second.step();
    }
    EXPECT_EQ(first.input("push"), 3.0);
    const auto& system = *scene.systems[0].system;
    EXPECT_NEAR(system.joint_coordinate(first.state(), 1)[1], 0.1, 1e-9);
    EXPECT_NEAR(system.joint_coordinate(second.state(), 1)[1], 0.0, 1e-12);
}

TEST(Inputs, WhatCannotBeOneIsRefused) {
    const std::string head = "step: 0.01\nend: 1\n",
                      body = "bodies:\n- {name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n";
    const auto expect = [](const std::string& sentence, const char* part) {
        EXPECT_NE(sentence.find(part), std::string::npos) << sentence;
    };
    expect(refusal(head + with_cart(hinge) + "motors:\n- {name: m, joint: pin, motion: {input: a}}\n"), "which jumps");
    expect(refusal(head + "bodies:\n- {name: b, motion: {translation: [{input: a}, 0, 0]}}\n"), "which jumps");
    expect(refusal(head + body +
                   "loads:\n- {name: l, body: b, force: [{input: {name: a, start: 1}}, {input: {name: a, "
                   "start: 2}}, 0]}\n"),
           "the input \"a\" starts at 2, elsewhere at 1");
    expect(refusal(head + body + "loads:\n- {name: l, body: b, force: [{input: {scale: 2}}, 0, 0]}\n"), "lacks a name");
    auto run = run_of(head + body + "loads:\n- {name: l, body: b, force: [{input: push}, 0, 0]}\n");
    const auto told = [&](const char* name, double value) -> std::string {
        try {
            run.simulation.set_input(name, value);
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    expect(told("posh", 1.0), "did you mean \"push\"?");
    expect(told("push", std::nan("")), "must be finite");
    EXPECT_EQ(run.simulation.input("push"), 0.0);
}

}  // namespace
}  // namespace delassus::inputs_test
