// SPDX-License-Identifier: BSD-3-Clause
// Prescribed functions of time: values, derivatives, integrals, and what is refused.
#include <gtest/gtest.h>

#include <cmath>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"

namespace delassus::motions_test {
namespace {

/// Rate, acceleration and integral against differences of the value and of the integral.
void expect_consistent(const Motion& motion, double from, double to) {
    constexpr double step = 1e-6;
    const auto slope = [&](const std::function<double(double)>& of, double t) {
        return (of(t + step) - of(t - step)) / (2.0 * step);
    };
    for (int k = 0; k < 101; ++k) {
        const double t = from + (to - from) * (k + 0.37) / 101.0;
        EXPECT_NEAR(motion.rate(t), slope(motion.value, t), 1e-7) << t;
        EXPECT_NEAR(motion.acceleration(t), slope(motion.rate, t), 1e-6) << t;
        EXPECT_NEAR(motion.value(t), slope(motion.integral, t), 1e-7) << t;
    }
    EXPECT_NEAR(motion.integral(0.0), 0.0, 1e-15);
}

TEST(Table, GoesInStraightLinesAndKeepsItsEnds) {
    const Motion table = Motion::table({1.0, 2.0, 4.0}, {3.0, 5.0, 4.0});
    EXPECT_EQ(table.value(0.0), 3.0);
    EXPECT_EQ(table.value(1.5), 4.0);
    EXPECT_EQ(table.value(2.0), 5.0);
    EXPECT_EQ(table.value(3.0), 4.5);
    EXPECT_EQ(table.value(9.0), 4.0);
    EXPECT_EQ(table.rate(0.5), 0.0);
    EXPECT_EQ(table.rate(1.5), 2.0);
    EXPECT_EQ(table.rate(3.0), -0.5);
    EXPECT_EQ(table.rate(5.0), 0.0);
    EXPECT_NEAR(table.integral(5.0), 3.0 + 4.0 + 9.0 + 4.0, 1e-14);
    EXPECT_NEAR(table.integral(-1.0), -3.0, 1e-14);
    expect_consistent(table, -1.0, 6.0);
}

TEST(Table, Repeats) {
    const Motion table = Motion::table({0.5, 1.0, 2.5}, {0.0, 1.0, 0.0}, Interpolation::Linear, true);
    for (const double t : {0.6, 0.9, 1.7})
        for (const double periods : {-4.0, -2.0, 2.0, 6.0})
            EXPECT_NEAR(table.value(t + periods), table.value(t), 1e-14);
    EXPECT_NEAR(table.integral(20.0), 10.0, 1e-12);
    expect_consistent(table, -7.0, 11.0);
}

// With slopes 0 at its ends the spline of a cubic that has them is the cubic.
TEST(Table, OfACubicIsTheCubic) {
    const auto cubic = [](double t) { return t * t * (3.0 - 2.0 * t); };
    std::vector<double> times = {0.0, 0.1, 0.35, 0.6, 0.8, 1.0}, values;
    for (const double t : times) values.push_back(cubic(t));
    const Motion spline = Motion::table(times, values, Interpolation::Cubic);
    for (double t = 0.0; t <= 1.0; t += 0.01) EXPECT_NEAR(spline.value(t), cubic(t), 1e-14);
    EXPECT_NEAR(spline.integral(1.0), 0.5, 1e-14);
    expect_consistent(spline, -0.5, 1.5);
}

// A periodic spline converges to a sine with the fourth power of the distance of its points.
TEST(Table, RepeatsSmoothly) {
    const auto error = [](int count) {
        std::vector<double> times, values;
        for (int k = 0; k <= count; ++k) {
            times.push_back(2.0 * M_PI * k / count);
            values.push_back(k == count ? 0.0 : std::sin(times.back()));
        }
        const Motion spline = Motion::table(times, values, Interpolation::Cubic, true);
        double worst = 0.0;
        for (double t = -9.0; t < 9.0; t += 0.01) worst = std::max(worst, std::abs(spline.value(t) - std::sin(t)));
        if (count == 16) expect_consistent(spline, -9.0, 9.0);
        return worst;
    };
    EXPECT_LT(error(16), 3e-4);
    EXPECT_NEAR(std::log2(error(16) / error(32)), 4.0, 0.2);
    static_cast<void>(error(2));  // few points: every point has the same neighbour on both sides
    static_cast<void>(error(1));
}

TEST(Table, IsRefusedWhereItIsNone) {
    const auto told = [](const std::vector<double>& times, const std::vector<double>& values, bool periodic = false) {
        try {
            static_cast<void>(Motion::table(times, values, Interpolation::Cubic, periodic));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(told({0.0}, {1.0}), "a table has 1 times and 1 values; it needs two or more of each, and as many");
    EXPECT_EQ(told({0.0, 1.0, 1.0}, {1.0, 2.0, 3.0}), "the times of a table must ascend, and 1 is followed by 1");
    EXPECT_EQ(told({0.0, NAN}, {1.0, 2.0}), "the numbers of a table must be finite");
    EXPECT_EQ(told({0.0, 1.0}, {1.0, 2.0}, true),
              "a periodic table must end with the value that it begins with, 1, not with 2");
}

TEST(Polynomial, HasItsDerivatives) {
    const Motion motion = Motion::polynomial({1.0, -2.0, 0.5, 3.0});
    EXPECT_EQ(motion.value(2.0), 1.0 - 4.0 + 2.0 + 24.0);
    EXPECT_EQ(motion.rate(2.0), -2.0 + 2.0 + 36.0);
    EXPECT_EQ(motion.acceleration(2.0), 1.0 + 36.0);
    EXPECT_EQ(motion.integral(2.0), 2.0 - 4.0 + 4.0 / 3.0 + 12.0);
    EXPECT_THROW(static_cast<void>(Motion::polynomial({})), InputError);
}

TEST(Ramp, HasAsManyContinuousDerivativesAsItSays) {
    for (const int smoothness : {1, 2}) {
        const Motion ramp = Motion::ramp(2.0, 5.0, 1.0, 4.0, smoothness);
        EXPECT_EQ(ramp.value(0.0), 2.0);
        EXPECT_NEAR(ramp.value(3.0), 3.5, 1e-14);
        EXPECT_NEAR(ramp.value(5.0), 5.0, 1e-14);
        EXPECT_NEAR(ramp.value(7.0), 5.0, 1e-14);
        EXPECT_NEAR(ramp.rate(3.0), 3.0 / 4.0 * (smoothness == 1 ? 1.5 : 1.875), 1e-14);
        for (const double end : {1.0, 5.0}) {
            const double inside = end + (end < 3.0 ? 1e-9 : -1e-9);
            EXPECT_NEAR(ramp.rate(inside), 0.0, 1e-8);
            if (smoothness == 2) {
                EXPECT_NEAR(ramp.acceleration(inside), 0.0, 1e-8);
            }
        }
        EXPECT_NEAR(ramp.integral(5.0), 2.0 + 4.0 * 3.5, 1e-13);
        expect_consistent(ramp, 0.0, 7.0);
    }
    EXPECT_THROW(static_cast<void>(Motion::ramp(0.0, 1.0, 0.0, 0.0)), InputError);
    EXPECT_THROW(static_cast<void>(Motion::ramp(0.0, 1.0, 0.0, 1.0, 3)), InputError);
}

TEST(Corners, AreWhereMotionsAreNotSmooth) {
    EXPECT_TRUE(Motion::constant(1.0).corners.empty());
    EXPECT_TRUE(Motion::linear(1.0, 2.0).corners.empty());
    EXPECT_TRUE(Motion::sine(1.0, 2.0).corners.empty());
    EXPECT_TRUE(Motion::polynomial({1.0, 2.0}).corners.empty());
    EXPECT_EQ(Motion::ramp(0.0, 1.0, 2.0, 0.5).corners, (std::vector<double>{2.0, 2.5}));
    const Motion table = Motion::table({1.0, 2.0, 4.0}, {3.0, 5.0, 3.0}, Interpolation::Linear, true);
    EXPECT_EQ(table.corners, (std::vector<double>{1.0, 2.0, 4.0}));
    EXPECT_EQ(table.period, 3.0);
    EXPECT_TRUE(table.foreseeable);
    EXPECT_FALSE(Motion().foreseeable);
}

// A motor, an actuator, a load and a body that moves as it is told.
TEST(Corners, OfASystemAreThoseOfAllItsMotions) {
    MultibodySystem system;
    BodyParameters body;
    body.name = "told";
    body.motion = BodyMotion{};
    body.motion->translation[1] = Motion::ramp(0.0, 1.0, 0.3, 0.5);
    body.motion->angle = Motion::table({0.0, 7.0}, {0.0, 1.0});
    static_cast<void>(system.add_body(body));
    body = {};
    body.name = "b";
    body.inertia = {1.0, 1.0, 1.0};
    const BodyIndex b = system.add_body(body);
    JointParameters joint;
    joint.kind = JointKind::Revolute;
    joint.second = b;
    const std::int32_t hinge = system.add_joint(joint);
    EXPECT_EQ(system.next_corner(0.8), 7.0);
    MotorParameters motor;
    motor.name = "m";
    motor.joint = hinge;
    motor.motion = Motion::table({1.0, 2.0, 2.5}, {0.0, 1.0, 0.0}, Interpolation::Linear, true);
    system.add_motor(motor);
    ActuatorParameters actuator;
    actuator.name = "a";
    actuator.joint = hinge;
    actuator.kp = 1.0;
    actuator.position = Motion::ramp(0.0, 1.0, 1.2, 1.0);
    system.add_actuator(actuator);
    LoadParameters load;
    load.name = "l";
    load.body = b;
    load.torque[2] = Motion::table({0.5, 6.1}, {0.0, 1.0});
    system.add_load(load);
    EXPECT_TRUE(system.foreseeable());
    // The motor repeats from the time 1 on, and before it.
    const std::vector<double> expected = {0.3, 0.5, 0.8, 1.0, 1.2, 2.0, 2.2, 2.5,
                                          3.5, 4.0, 5.0, 5.5, 6.1, 6.5, 7.0, 8.0};
    double t = 0.1;
    for (const double corner : expected) {
        t = system.next_corner(t);
        EXPECT_NEAR(t, corner, 1e-15);
    }
    load.name = "own";
    load.force[0] = Motion{[](double) { return 1.0; }, {}, {}, {}};
    system.add_load(load);
    EXPECT_FALSE(system.foreseeable());
    system.finish();
    const std::uint64_t before = system.revision();
    system.set_gravity({0.0, 0.0, 0.0});
    EXPECT_GT(system.revision(), before);
}

}  // namespace
}  // namespace delassus::motions_test
