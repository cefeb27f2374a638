// SPDX-License-Identifier: BSD-3-Clause
// Mechanisms with redundant joints, written with few digits, against their closed forms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/plan.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::overconstrained_test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

const std::vector<std::string> implicit_methods = {"hht",         "newmark",        "generalized_alpha",
                                                   "trapezoidal", "euler_implicit", "euler_implicit_linearized"};

/// "[x, y, z]" with so many digits after the point.
std::string text(const Vector3d& v, int digits) {
    return fmt::format("[{:.{}f}, {:.{}f}, {:.{}f}]", v[0], digits, v[1], digits, v[2], digits);
}

Vector3d position(const Running& run, const std::string& body) {
    const auto p = run.pose(body).position;
    return {p[0], p[1], p[2]};
}

std::string head(const std::string& method, double step, double end, const std::string& gravity = "[0, 0, 0]",
                 const std::string& coordinates = "maximal") {
    return fmt::format("gravity: {}\nstep: {}\nend: {}\nintegrator: {}\ncoordinates: {}\n", gravity, step, end, method,
                       coordinates);
}

std::string body(const std::string& name, const Vector3d& at, int digits) {
    return fmt::format("- {{name: {}, mass: 1.3, inertia: {{xx: 0.05, yy: 0.06, zz: 0.07}}, position: {}}}\n", name,
                       text(at, digits));
}

std::string revolute(const std::string& name, const std::string& bodies, const Vector3d& point, const Vector3d& axis,
                     int digits) {
    return fmt::format("- {{name: {}, kind: revolute, {}, point: {}, axis: {}}}\n", name, bodies, text(point, digits),
                       text(axis, digits));
}

std::int32_t left_out(const Running& run) {
    const auto* joints = run.simulation.joint_coordinates();
    return run.system().constraint_rows() - run.system().m() - (joints ? joints->rows_saved() : 0);
}

/// Steps to the end; every solve must reach its tolerance. Calls check after each step.
template <class Check>
void finish(Running& run, Check&& check) {
    while (!run.simulation.finished()) {
        run.simulation.step();
        check();
    }
    EXPECT_EQ(run.simulation.totals().unsolved_steps, 0) << run.simulation.totals().first_unsolved;
}

// ---- Bennett's linkage ----
//
// Four bars of lengths a, b, a, b and twists α, β, α, β with a / sin α = b / sin β. Its joint angles obey
// θ₃ = −θ₁, θ₄ = −θ₂ and tan(θ₁/2) tan(θ₂/2) = sin((β + α)/2) / sin((β − α)/2) (Bennett 1903; with the frames of
// Denavit and Hartenberg, Rz(θ) Tx(length) Rx(twist) from joint to joint).

struct Bennett {
    double a = 0.8, b = 1.1, alpha = 0.5, beta = std::asin(b * std::sin(alpha) / a);
    double start = 1.2;  // θ₁ at t = 0

    static Isometry3d link(double theta, double length, double twist) {
        return AngleAxisd(theta, Vector3d::UnitZ()) * Translation3d(length, 0.0, 0.0) *
               AngleAxisd(twist, Vector3d::UnitX());
    }
    /// Frames of the joints 1 to 4.
    [[nodiscard]] std::array<Isometry3d, 4> joints(double theta1) const {
        const double constant = std::sin(0.5 * (beta + alpha)) / std::sin(0.5 * (beta - alpha));
        const double theta2 = 2.0 * std::atan(constant / std::tan(0.5 * theta1));
        std::array<Isometry3d, 4> frames;
        frames[0] = Isometry3d::Identity();
        frames[1] = frames[0] * link(theta1, a, alpha);
        frames[2] = frames[1] * link(theta2, b, beta);
        frames[3] = frames[2] * link(-theta1, a, alpha);
        return frames;
    }
    /// The middle of the bar from joint k to the next, k = 0, 1, 2.
    [[nodiscard]] Vector3d middle(double theta1, std::size_t k) const {
        const auto frames = joints(theta1);
        return 0.5 * (frames[k].translation() + frames[k + 1].translation());
    }
    [[nodiscard]] std::string scene(int digits, const std::string& motion, const std::string& first_lines) const {
        const auto frames = joints(start);
        std::string yaml = first_lines + "bodies:\n";
        for (std::size_t k = 0; k < 3; ++k) yaml += body(fmt::format("bar_{}", k), middle(start, k), digits);
        yaml += "joints:\n";
        const std::array<std::string, 4> bodies = {"second: bar_0", "first: bar_0, second: bar_1",
                                                   "first: bar_1, second: bar_2", "second: bar_2"};
        for (std::size_t k = 0; k < 4; ++k)
            yaml += revolute(fmt::format("joint_{}", k), bodies[k], frames[k].translation(), frames[k].linear().col(2),
                             digits);
        return yaml + "motors:\n- {name: drive, joint: joint_0, motion: {" + motion + "}}\n";
    }
};

constexpr const char* swinging =
    "sine: {amplitude: 0.7, frequency: 0.4, phase: -1.5707963267948966, offset: 0.7}";  // 0.7 (1 − cos(0.8 π t))

struct Case {
    std::string method;
    int digits;
    std::string coordinates = "maximal";

    [[nodiscard]] std::string name() const {
        return fmt::format("{}_{}{}", method, digits, coordinates == "joint" ? "_joint" : "");
    }
};

void PrintTo(const Case& one, std::ostream* out) {
    *out << one.name();
}

class BennettLinkage : public testing::TestWithParam<Case> {};

TEST_P(BennettLinkage, FollowsItsClosedForm) {
    const auto& [method, digits, coordinates] = GetParam();
    const Bennett bennett;
    const double step = 0.00137;
    Running run(
        parse_scene(bennett.scene(digits, swinging, head(method, step, 1.0, "[0, 0, 0]", coordinates)), "bennett"));
    EXPECT_EQ(left_out(run), 3);  // 4 · 5 rows and the motor's; 18 velocities
    double worst = 0.0;
    finish(run, [&] {
        const double t = run.simulation.state().t;
        const double theta = bennett.start + 0.7 * (1.0 - std::cos(0.8 * std::numbers::pi * t));
        for (std::size_t k = 0; k < 3; ++k)
            worst = std::max(worst, (position(run, fmt::format("bar_{}", k)) - bennett.middle(theta, k)).norm());
    });
    // Constraints hold at the end of a step, to h² with the linearised method. Motion magnifies what digits are
    // missing.
    const double of_method = method == "euler_implicit_linearized" ? 2e-5 : 1e-9;
    EXPECT_LT(worst, of_method + 20.0 * std::pow(10.0, -digits));
}

std::vector<Case> all_cases() {
    std::vector<Case> cases;
    for (const auto& method : implicit_methods)
        for (const int digits : {6, 8, 9, 12, 16}) cases.push_back({method, digits});
    for (const std::string method : {"dormand_prince", "generalized_alpha", "euler_implicit_linearized"})
        for (const int digits : {6, 16}) cases.push_back({method, digits, "joint"});
    return cases;
}

INSTANTIATE_TEST_SUITE_P(Overconstrained, BennettLinkage, testing::ValuesIn(all_cases()),
                         [](const auto& one) { return one.param.name(); });

TEST(Overconstrained, BennettLinkageTakesTheMotorsSpeedAtTheStart) {
    const Bennett bennett;
    Running run(parse_scene(bennett.scene(6, "linear: {start: 0, rate: 0.9}", head("hht", 0.001, 0.3)), "bennett"));
    const double small = 1e-6;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vector3d v = (bennett.middle(bennett.start + small, k) - bennett.middle(bennett.start - small, k)) *
                           (0.9 / (2.0 * small));
        const auto got = run.velocities(fmt::format("bar_{}", k))[0];
        EXPECT_LT((Vector3d(got[0], got[1], got[2]) - v).norm(), 2e-5) << k;
    }
    EXPECT_NE(run.simulation.start().find("velocities changed"), std::string::npos);
    EXPECT_TRUE(run.simulation.warnings().empty());  // bodies at rest that a motor drives are no mistake
    finish(run, [] {});
}

TEST(Overconstrained, AStartFarFromTheMotorsAngleIsAssembled) {
    const Bennett bennett;
    for (const double angle : {0.6, 1.6, -2.2, 2.9}) {
        const auto motion = fmt::format("linear: {{start: {}, rate: 0}}", angle);
        Running run(parse_scene(bennett.scene(8, motion, head("newmark", 0.001, 0.05)), "bennett"));
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_LT((position(run, fmt::format("bar_{}", k)) - bennett.middle(bennett.start + angle, k)).norm(), 2e-5)
                << k << " at " << angle;
        ASSERT_EQ(run.simulation.warnings().size(), 1U);
        EXPECT_NE(run.simulation.warnings()[0].find("does not fit"), std::string::npos);
        finish(run, [] {});
    }
}

// Rows that are good to keep at the start are not so half a turn later.
TEST(Overconstrained, ATurningBennettLinkageChangesTheRowsItKeeps) {
    const Bennett bennett;
    for (const auto& [method, coordinates] :
         {std::pair{"hht", "maximal"}, {"euler_implicit_linearized", "maximal"}, {"dormand_prince", "joint"}}) {
        Running run(parse_scene(
            bennett.scene(6, "linear: {start: 0, rate: 1.7}", head(method, 0.002, 4.0, "[0, 0, 0]", coordinates)),
            "bennett"));
        const auto first = run.system().kept_rows();
        bool changed = false;
        double worst = 0.0;
        finish(run, [&] {
            changed = changed || run.system().kept_rows() != first;
            const double theta = bennett.start + 1.7 * run.simulation.state().t;
            worst = std::max(worst, (position(run, "bar_1") - bennett.middle(theta, 1)).norm());
        });
        EXPECT_TRUE(changed) << method;
        EXPECT_LT(worst, 2e-4) << method;
        Simulation again(run.scene.systems[0], registry());
        EXPECT_EQ(run.system().kept_rows(), first);  // a new run begins with those of the start
    }
}

TEST(Overconstrained, GoesOnWithTheRowsOfItsCheckpoint) {
    for (const auto& [method, coordinates] : {std::pair{"hht", "maximal"}, {"dormand_prince", "joint"}}) {
        const std::string text =
            Bennett().scene(6, "linear: {start: 0, rate: 1.7}", head(method, 0.002, 4.0, "[0, 0, 0]", coordinates));
        const auto scene = [&] { return parse_scene(text, "bennett"); };
        Running whole(scene()), resumed(scene());
        while (whole.simulation.state().t < 1.5) whole.simulation.step();
        EXPECT_NE(whole.system().kept_rows(), resumed.system().kept_rows());
        resumed.simulation.load(whole.simulation.save());
        EXPECT_EQ(whole.system().kept_rows(), resumed.system().kept_rows());
        for (int i = 0; i < 300; ++i) {
            whole.simulation.step();
            resumed.simulation.step();
        }
        EXPECT_EQ(whole.simulation.state().q, resumed.simulation.state().q);
        EXPECT_EQ(whole.simulation.state().v, resumed.simulation.state().v);
    }
}

TEST(Overconstrained, ReactionsKeepTheirLayout) {
    Running run(parse_scene(Bennett().scene(8, swinging, head("hht", 0.001, 0.1)), "bennett"));
    run.finish();
    const auto lambda = run.simulation.multipliers();
    ASSERT_EQ(lambda.size(), 21U);
    const auto& kept = run.system().kept_rows();
    for (std::int32_t row = 0; row < 21; ++row)
        EXPECT_EQ(lambda[static_cast<std::size_t>(row)] != 0.0, std::binary_search(kept.begin(), kept.end(), row))
            << row;
}

TEST(Overconstrained, PlanSaysHowManyRowsAreLeftOut) {
    Scene scene = parse_scene(Bennett().scene(6, swinging, head("hht", 0.001, 0.1)), "bennett");
    const auto plan = make_plan(scene, registry()).at(0);
    EXPECT_EQ(plan.constraints, 21);
    const bool said = std::any_of(plan.left_out.begin(), plan.left_out.end(), [](const PlanLine& line) {
        return line.what == "3 rows of joints and motors" && line.reason.find("imply") != std::string::npos;
    });
    EXPECT_TRUE(said);
}

TEST(Overconstrained, WorksWithNothingLeftOutAndAdaptiveSteps) {
    SceneOverrides everything, chosen;
    everything.leave_out = false;
    chosen.tolerance = 1e-6;
    for (const auto& overrides : {everything, chosen}) {
        const Bennett bennett;
        Running run(
            parse_scene(bennett.scene(6, swinging, head("generalized_alpha", 0.001, 0.2)), "bennett", overrides));
        finish(run, [] {});
        const double theta = bennett.start + 0.7 * (1.0 - std::cos(0.8 * std::numbers::pi * 0.2));
        EXPECT_LT((position(run, "bar_1") - bennett.middle(theta, 1)).norm(), 2e-5);
    }
}

// ---- Cardan's joint ----
//
// Two shafts at an angle β: tan θ_out = cos β tan θ_in, angles from where the input's arm of the cross is normal to
// both shafts. Two bearings and a universal joint hold one freedom by 14 rows of 12 velocities.

class CardanJoint : public testing::TestWithParam<std::string> {};

TEST_P(CardanJoint, FollowsItsClosedForm) {
    const double beta = 0.55, rate = 2.7;
    const Vector3d shaft(std::cos(beta), std::sin(beta), 0.0), cross(-std::sin(beta), std::cos(beta), 0.0);
    constexpr int digits = 16;
    std::string yaml = head(GetParam(), 0.00137, 0.9) + "bodies:\n";
    yaml +=
        "- {name: input, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [-0.4, 0, 0], angular_velocity: " +
        text({rate, 0.0, 0.0}, digits) + "}\n";
    yaml += "- {name: output, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: " + text(0.4 * shaft, digits) +
            ", angular_velocity: " + text(rate * std::cos(beta) * shaft, digits) + "}\n";
    yaml += "joints:\n" + revolute("in", "second: input", {-0.4, 0.0, 0.0}, Vector3d::UnitX(), digits) +
            revolute("out", "second: output", 0.4 * shaft, shaft, digits);
    yaml +=
        "- {name: cross, kind: universal, first: input, second: output, point: [0, 0, 0], axis: [0, 0, 1], "
        "second_axis: " +
        text(cross, digits) + "}\n";
    yaml += fmt::format("motors:\n- {{name: drive, joint: in, motion: {{linear: {{start: 0, rate: {}}}}}}}\n", rate);
    Running run(parse_scene(yaml, "cardan"));
    EXPECT_EQ(left_out(run), 3);
    EXPECT_EQ(run.simulation.start(), "");  // the velocities were consistent
    double worst = 0.0;
    finish(run, [&] {
        const double theta = rate * run.simulation.state().t;
        // The direction of the output's arm of the cross, turned by ψ about the shaft.
        const Vector3d arm =
            (std::cos(theta) * cross + std::cos(beta) * std::sin(theta) * Vector3d::UnitZ()).normalized();
        const auto q = run.pose("output").orientation;
        const Vector3d got = Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * cross;
        worst = std::max(worst, (got - arm).norm());
    });
    EXPECT_LT(worst, GetParam() == "euler_implicit_linearized" ? 5e-5 : 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Overconstrained, CardanJoint, testing::ValuesIn(implicit_methods),
                         [](const auto& one) { return one.param; });

// ---- Other mechanisms with few digits ----

TEST(Overconstrained, PlanarFourBarInSpaceKeepsItsEnergy) {
    const Vector3d a(0.0, 0.0, 0.0), b(0.1234, 0.3871, 0.0), c(0.9017, 0.6543, 0.0), d(0.8521, 0.0, 0.0);
    for (const auto& method : {"hht", "generalized_alpha", "euler_implicit", "euler_implicit_linearized"}) {
        std::string yaml = head(method, 0.00137, 0.5, "[0, -9.81, 0]") + "bodies:\n" + body("crank", 0.5 * (a + b), 4) +
                           body("coupler", 0.5 * (b + c), 4) + body("rocker", 0.5 * (c + d), 4) + "joints:\n" +
                           revolute("a", "second: crank", a, Vector3d::UnitZ(), 4) +
                           revolute("b", "first: crank, second: coupler", b, Vector3d::UnitZ(), 4) +
                           revolute("c", "first: coupler, second: rocker", c, Vector3d::UnitZ(), 4) +
                           revolute("d", "second: rocker", d, Vector3d::UnitZ(), 4);
        Running run(parse_scene(yaml, "four-bar"));
        EXPECT_EQ(left_out(run), 3);
        EXPECT_EQ(run.simulation.start(), "");
        double above = 0.0;
        finish(run, [&] { above = std::max(above, std::abs(position(run, "coupler")[2])); });
        EXPECT_LT(above, 1e-9) << method;
        EXPECT_LT(run.simulation.totals().worst_drift, 1e-4) << method;
        // Methods of second order keep it; Euler's loses some of the 4 J that move.
        const bool second = std::string(method).find("euler") == std::string::npos;
        EXPECT_LT(std::abs(run.simulation.totals().energy - run.simulation.totals().start_energy), second ? 0.01 : 0.3)
            << method;
    }
}

// A plate on two pairs of hinged legs, in two planes that are not parallel: it moves along the line of the planes.
TEST(Overconstrained, SarrusLinkageMovesAlongALine) {
    const double angle = 1.1;
    const Vector3d up = Vector3d::UnitZ(), first(1.0, 0.0, 0.0), second(std::cos(angle), std::sin(angle), 0.0);
    for (const auto& method : implicit_methods) {
        std::string bodies = "bodies:\n" + body("plate", 0.8 * up, 5), joints = "joints:\n";
        for (const auto& [name, out] : {std::pair{"x", first}, std::pair{"s", second}}) {
            const std::string lower = fmt::format("lower_{}", name), upper = fmt::format("upper_{}", name);
            const Vector3d axis = up.cross(out), foot = 0.35 * out, knee = 0.65 * out + 0.4 * up, top = foot + 0.8 * up;
            bodies += body(lower, 0.5 * (foot + knee), 5) + body(upper, 0.5 * (knee + top), 5);
            joints += revolute(lower + "_foot", "second: " + lower, foot, axis, 5) +
                      revolute(lower + "_knee", "first: " + lower + ", second: " + upper, knee, axis, 5) +
                      revolute(upper + "_top", "first: " + upper + ", second: plate", top, axis, 5);
        }
        Running run(parse_scene(head(method, 0.00137, 0.25, "[0, 0, -9.81]") + bodies + joints, "sarrus"));
        EXPECT_EQ(left_out(run), 1);  // 30 rows, 30 velocities, one freedom
        double aside = 0.0;
        finish(run, [&] { aside = std::max(aside, std::hypot(position(run, "plate")[0], position(run, "plate")[1])); });
        EXPECT_LT(aside, method == "euler_implicit_linearized" ? 1e-4 : 1e-7) << method;
        EXPECT_LT(position(run, "plate")[2], 0.75) << method;
    }
}

// Each arm has two bushings on its axis, as a drawing has them.
TEST(Overconstrained, DoubleWishboneMoves) {
    const auto scene = [](const std::string& method, bool both) {
        const Vector3d along = Vector3d::UnitX();
        std::string yaml = head(method, 0.00137, 0.3, "[0, 0, -9.81]") + "bodies:\n" +
                           body("lower", {0.0123, 0.4512, 0.2011}, 4) + body("upper", {-0.0211, 0.5034, 0.5123}, 4) +
                           body("knuckle", {0.0042, 0.7211, 0.3512}, 4) + "joints:\n";
        const auto arm = [&](const std::string& name, const Vector3d& middle) {
            yaml += revolute(name + "_front", "second: " + name, middle - 0.15 * along, along, 4);
            if (both) yaml += revolute(name + "_rear", "second: " + name, middle + 0.15 * along, along, 4);
        };
        arm("lower", {0.0123, 0.2411, 0.2134});
        arm("upper", {-0.0211, 0.3124, 0.4987});
        yaml +=
            "- {name: ball_1, kind: spherical, first: lower, second: knuckle, point: [0.0101, 0.7013, 0.1923]}\n"
            "- {name: ball_2, kind: spherical, first: upper, second: knuckle, point: [-0.0149, 0.6712, 0.5251]}\n"
            "- {name: tie_rod, kind: distance, second: knuckle, point: [0.1312, 0.2711, 0.2713], second_point: "
            "[0.1213, 0.6914, 0.2611]}\n"
            "springs:\n- {name: coil, second: lower, first_point: [0.0123, 0.4011, 0.6512], second_point: [0.0123, "
            "0.5217, 0.1987], stiffness: 2500, damping: 120}\n";
        return yaml;
    };
    for (const auto& method : {"hht", "euler_implicit_linearized"}) {
        Running twice(parse_scene(scene(method, true), "wishbone")),
            once(parse_scene(scene(method, false), "wishbone"));
        EXPECT_EQ(left_out(twice), 10);
        EXPECT_EQ(left_out(once), 0);
        finish(twice, [] {});
        finish(once, [] {});
        EXPECT_LT((position(twice, "knuckle") - position(once, "knuckle")).norm(), 1e-4) << method;
        EXPECT_GT(std::abs(position(once, "knuckle")[2] - 0.3512), 1e-3) << method;
    }
}

// Flat, its rows depend on each other once more than elsewhere.
TEST(Overconstrained, AFlatParallelogramLosesNoRowThatItNeeds) {
    const Vector3d a(0.0, 0.0, 0.0), b(0.3, 0.0, 0.0), c(1.1, 0.0, 0.0), d(0.8, 0.0, 0.0), z = Vector3d::UnitZ();
    const std::string yaml =
        head("euler_implicit_linearized", 0.001, 0.01) + "bodies:\n" + body("one", 0.5 * (a + b), 4) +
        body("two", 0.5 * (b + c), 4) + body("three", 0.5 * (c + d), 4) + "joints:\n" +
        revolute("a", "second: one", a, z, 4) + revolute("b", "first: one, second: two", b, z, 4) +
        revolute("c", "first: two, second: three", c, z, 4) + revolute("d", "second: three", d, z, 4);
    Running run(parse_scene(yaml, "flat"));
    EXPECT_EQ(left_out(run), 3);
}

// A motor turns the crank through flat positions, which are states to be shown: at each of several phases and speeds.
TEST(Overconstrained, AParallelogramIsDrivenThroughItsFlatPositions) {
    for (const double turns : {1.0, 0.8, 1.25})
        for (const double start : {0.0, 0.25 * M_PI}) {
            Running run(parse_scene(
                fmt::format(
                    "step: 0.002\nend: 5\nbodies:\n"
                    "- {{name: crank, mass: 0.3, inertia: {{xx: 0.00225, yy: 0.00225, zz: 5.0e-6}}, position: "
                    "[0, 0, 0.15]}}\n"
                    "- {{name: coupler, mass: 1, inertia: {{xx: 1.7e-5, yy: 0.0833, zz: 0.0833}}, position: "
                    "[0.5, 0, 0.3]}}\n"
                    "- {{name: rocker, mass: 0.3, inertia: {{xx: 0.00225, yy: 0.00225, zz: 5.0e-6}}, position: "
                    "[1, 0, 0.15]}}\n"
                    "joints:\n"
                    "- {{name: O, kind: revolute, second: crank, axis: [0, -1, 0], start: {0}, start_rate: "
                    "{1}}}\n"
                    "- {{name: A, kind: revolute, first: crank, second: coupler, point: [0, 0, 0.3], axis: [0, "
                    "-1, 0]}}\n"
                    "- {{name: B, kind: revolute, first: coupler, second: rocker, point: [1, 0, 0.3], axis: [0, "
                    "-1, 0]}}\n"
                    "- {{name: G, kind: revolute, second: rocker, point: [1, 0, 0], axis: [0, -1, 0]}}\n"
                    "motors: [{{name: m, joint: O, speed: true, motion: {1}}}]\n",
                    start, 2.0 * M_PI * turns),
                "s"));
            ASSERT_NO_THROW(run.finish()) << turns << " " << start;
            const double angle = start + 10.0 * M_PI * turns;
            EXPECT_NEAR(run.pose("crank").position[0], -0.15 * std::sin(angle), 1e-5) << turns << " " << start;
            EXPECT_LT(run.simulation.totals().worst_drift, 1e-5);
        }
}

TEST(Overconstrained, MotorsThatContradictEachOtherAreNamed) {
    const auto scene = [](const std::string& second) {
        std::string yaml = Bennett().scene(8, swinging, head("hht", 0.001, 1.0));
        return yaml + "- {name: other, joint: joint_1, motion: {" + second + "}}\n";
    };
    Running run(parse_scene(scene("linear: {start: 0, rate: 0}"), "motors"));
    EXPECT_EQ(left_out(run), 4);
    try {
        run.finish();
        FAIL() << "the motors cannot both have their way";
    } catch (const StepFailure& error) {
        EXPECT_NE(std::string(error.what()).find("motor \"other\" contradicts motor \"drive\" now"), std::string::npos)
            << error.what();
    }
    const auto refusal = [&](const std::string& second) -> std::string {
        Scene contradictory = parse_scene(scene(second), "motors");
        try {
            Simulation simulation(contradictory.systems[0], registry());
        } catch (const InputError& error) {
            return error.what();
        }
        return "taken";
    };
    for (const char* second : {"linear: {start: 0.5, rate: 0}", "linear: {start: 0, rate: 0.1}"}) {
        const std::string told = refusal(second);
        EXPECT_NE(told.find("\"other\""), std::string::npos) << told;
        EXPECT_NE(told.find("\"drive\""), std::string::npos) << told;
        EXPECT_NE(told.find(" contradicts motor "), std::string::npos) << told;
    }
}

// ---- Everyday mechanisms that hold something twice ----

struct Everyday {
    std::string name, joints;
    int redundant;       // rows, in maximal coordinates
    double turn = 0.0;   // about z of the body that the world holds, at t = 0.5 s; it begins with 1 rad/s
    double slide = 0.0;  // along z, from 1 m/s
};

void PrintTo(const Everyday& one, std::ostream* out) {
    *out << one.name;
}

std::string on_axis(const std::string& name, const std::string& kind, double z, const std::string& more = "") {
    return fmt::format("- {{name: {}, kind: {}, second: a, point: [0, 0, {}], axis: [0, 0, 1]{}}}\n", name, kind, z,
                       more);
}

std::vector<Everyday> everyday() {
    return {
        {"two_hinges", on_axis("i", "revolute", 0.2) + on_axis("j", "revolute", 1.8), 5, 0.5},
        {"hinge_and_bearing", on_axis("i", "revolute", 0.0) + on_axis("j", "cylindrical", 1.0), 4, 0.5},
        {"hinge_and_ball",
         on_axis("i", "revolute", 0.0) + "- {name: j, kind: spherical, second: a, point: [0, 0, 1]}\n", 3, 0.5},
        {"two_rails",
         on_axis("i", "prismatic", 0.0) +
             "- {name: j, kind: prismatic, second: a, point: [0, 1, 0], axis: [0, 0, -1]}\n",
         5, 0.0, 0.5},
        {"weld_and_hinge", "- {name: i, kind: fixed, second: a, point: [0, 0, 0]}\n" + on_axis("j", "revolute", 0.0),
         5},
        {"two_welds",
         "- {name: i, kind: fixed, second: a, point: [0, 0, 0]}\n"
         "- {name: j, kind: fixed, second: a, point: [1, 0, 0]}\n",
         6},
        {"hinges_that_cross",
         on_axis("i", "revolute", 0.0) + "- {name: j, kind: revolute, second: a, point: [0, 0, 0], axis: [1, 0, 0]}\n",
         4},
        {"one_weld", "- {name: i, kind: fixed, second: a, point: [0, 0, 0]}\n", 0},
        {"two_motors",
         on_axis("i", "revolute", 0.0) + "motors:\n- {name: m, joint: i, motion: {linear: {rate: 1}}}\n"
                                         "- {name: n, joint: i, motion: {linear: {rate: 1}}}\n",
         1, 0.5},
        {"motors_of_two_hinges",
         on_axis("i", "revolute", 0.0) + on_axis("j", "revolute", 1.0) +
             "motors:\n- {name: m, joint: i, motion: {linear: {rate: 1}}}\n"
             "- {name: n, joint: j, motion: {linear: {rate: 1}}}\n",
         6, 0.5},
        {"slide_and_planar",
         on_axis("i", "prismatic", 0.0) + "- {name: j, kind: planar, second: a, point: [0, 0, 0], axis: [0, 1, 0]}\n",
         3, 0.0, 0.5}};
}

class HeldTwice : public testing::TestWithParam<std::tuple<Everyday, std::string>> {};

TEST_P(HeldTwice, MovesAsHeldOnce) {
    const auto& [one, coordinates] = GetParam();
    const std::string text = fmt::format(
        "gravity: [0, 0, 0]\nstep: 0.01\nend: 0.5\n{}bodies:\n- {{name: a, mass: 2, inertia: {{xx: 0.1, yy: 0.2, zz: "
        "0.25}}, position: [0.5, 0, 1], velocity: [0, {}, {}], angular_velocity: [0, 0, {}]}}\njoints:\n{}",
        coordinates.empty() ? "" : "coordinates: " + coordinates + "\n", one.turn, 2.0 * one.slide, 2.0 * one.turn,
        one.joints);
    Scene planned = parse_scene(text, "twice");
    const auto plan = make_plan(planned, registry()).at(0);
    const bool said = std::any_of(plan.left_out.begin(), plan.left_out.end(), [](const PlanLine& line) {
        return line.reason.find("reactions are not unique: of ") != std::string::npos;
    });
    EXPECT_EQ(said, one.redundant > 0);
    Running run(parse_scene(text, "twice"));
    EXPECT_EQ(left_out(run), one.redundant);
    EXPECT_EQ(run.system().joints_with_rows_left_out().empty(), one.redundant == 0);
    finish(run, [] {});
    const Vector3d at(0.5 * std::cos(one.turn), 0.5 * std::sin(one.turn), 1.0 + one.slide);
    EXPECT_LT((position(run, "a") - at).norm(), 1e-7);
    const auto q = run.pose("a").orientation;
    EXPECT_NEAR(2.0 * std::atan2(q[3], q[0]), one.turn, 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Overconstrained, HeldTwice,
                         testing::Combine(testing::ValuesIn(everyday()), testing::Values("", "joint", "maximal")),
                         [](const auto& one) {
                             const auto& coordinates = std::get<1>(one.param);
                             return std::get<0>(one.param).name + (coordinates.empty() ? "" : "_" + coordinates);
                         });

TEST(Overconstrained, TwoMotorsThatContradictEachOtherAreBothNamed) {
    for (const char* coordinates : {"", "coordinates: joint\n", "coordinates: maximal\n"}) {
        Scene scene = parse_scene(
            std::string(coordinates) +
                "step: 0.01\nend: 1\nbodies:\n- {name: a, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}}\njoints:\n" +
                on_axis("i", "revolute", 0.0) +
                "motors:\n- {name: up, joint: i, motion: {linear: {rate: 1}}}\n"
                "- {name: down, joint: i, motion: {linear: {rate: -2}}}\n",
            "motors");
        try {
            Simulation simulation(scene.systems[0], registry());
            FAIL() << "both cannot have their way";
        } catch (const InputError& error) {
            const std::string told = error.what();
            EXPECT_NE(told.find("motor \"up\""), std::string::npos) << told;
            EXPECT_NE(told.find("motor \"down\""), std::string::npos) << told;
        }
    }
}

TEST(Overconstrained, ConsistentStartsKeepTheirBits) {
    for (const auto* name : {"bricard", "four_bar", "squeezer", "slider_crank", "pendulum", "governor", "chain_1000"}) {
        Scene scene = read_scene(example_scene(name));
        MultibodySystem& system = *scene.systems[0].system;
        const State before = system.initial_state();
        const Assembly& done = system.assemble();
        const State after = system.initial_state();
        EXPECT_EQ(done.displacement, 0.0) << name;
        EXPECT_TRUE(before.q == after.q) << name;
        EXPECT_EQ(done.velocity_share_of_all, 0.0) << name;
        EXPECT_TRUE(before.v == after.v) << name;
    }
}

}  // namespace
}  // namespace delassus::tests::overconstrained_test
