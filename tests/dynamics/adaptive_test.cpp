// SPDX-License-Identifier: BSD-3-Clause
// Steps by tolerance: errors follow it, loads that jump are found, memory comes back.
#include "delassus/adaptive_stepping.hpp"

#include <gtest/gtest.h>

#include "support/order.hpp"
#include "support/systems/linear_oscillators.hpp"
#include "support/systems/planar_pendulum.hpp"
#include "support/systems/sudden_load.hpp"

namespace delassus::tests::adaptive_test {
namespace {

struct Run {
    State state;
    int steps = 0, rejected = 0;
    double smallest = HUGE_VAL, largest = 0.0;
};

Run run_to(DynamicalSystem& system, const std::string& method, const OptionTexts& options, const StepControl& control,
           double end) {
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper(method, system, options);
    AdaptiveStepping stepping(system, *stepper, control);
    Run run{system.initial_state()};
    while (run.state.t < end) {
        const auto report = stepping.step(run.state, end, solver);
        ++run.steps;
        run.rejected += report.rejected;
        run.smallest = std::min(run.smallest, report.h);
        run.largest = std::max(run.largest, report.h);
    }
    return run;
}

StepControl tolerance(double value) {
    StepControl control;
    control.absolute = value;
    control.smallest = 1e-9;
    control.largest = 1.0;
    return control;
}

struct Method {
    std::string name;
    OptionTexts options;
};
std::ostream& operator<<(std::ostream& out, const Method& method) {
    return out << method.name;
}

class Tolerance : public testing::TestWithParam<Method> {};

/// Errors at the end for three decades of tolerances, and the slope of log error over log tolerance.
template <class Error>
double slope(double loosest, Error&& error) {
    double sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0, count = 0.0;
    for (double value = loosest; value > 0.9e-3 * loosest; value *= std::sqrt(0.1)) {
        const double x = std::log10(value), y = std::log10(error(value));
        sum_x += x, sum_y += y, sum_xx += x * x, sum_xy += x * y, count += 1.0;
    }
    return (count * sum_xy - sum_x * sum_y) / (count * sum_xx - sum_x * sum_x);
}

TEST_P(Tolerance, IsProportionalToTheErrorOfThePendulum) {
    PlanarPendulum pendulum({0.0, {0.6, -0.8}, {0.8, 0.6}});
    const auto reference = reference_solution(pendulum, 1.0, 4000);
    const auto error = [&](double value) {
        const auto end = run_to(pendulum, GetParam().name, GetParam().options, tolerance(value), 1.0);
        const double result = std::hypot(end.state.q[0] - reference.state.q[0], end.state.q[1] - reference.state.q[1]);
        return result;
    };
    // Of order 1 the methods would take millions of steps for the tolerances of the others.
    EXPECT_NEAR(slope(GetParam().name.starts_with("euler") ? 0.3 : 1e-3, error), 1.0, 0.2);
}

// The stiff mode, ω = 1000, is in equilibrium; what a step may be follows from the slow one, ω = 1.
TEST_P(Tolerance, IsProportionalToTheErrorOfAStiffOscillator) {
    const double c = 0.5 * std::sqrt(3.0);
    LinearOscillators system(1.0, 1000.0, {0.0, {c, 0.5}, {0.0, 0.0}});
    const auto error = [&](double value) {
        const auto end = run_to(system, GetParam().name, GetParam().options, tolerance(value), 5.0);
        const double result = std::hypot(end.state.q[0] - c * std::cos(5.0), end.state.q[1] - 0.5 * std::cos(5.0));
        return result;
    };
    EXPECT_NEAR(slope(1e-3, error), 1.0, 0.2);
}

INSTANTIATE_TEST_SUITE_P(Methods, Tolerance,
                         testing::Values(Method{"euler_implicit_linearized", {}}, Method{"euler_implicit", {}},
                                         Method{"generalized_alpha", {}}, Method{"hht", {}}),
                         [](const auto& chosen) { return chosen.param.name; });

TEST(AdaptiveStepping, RejectsStepsOverASuddenLoad) {
    for (const char* method : {"generalized_alpha", "euler_implicit", "euler_implicit_linearized", "hht"}) {
        SuddenLoad system;
        StepControl control = tolerance(1e-4);
        control.initial = 0.01;
        const auto before = run_to(system, method, {}, control, 1.0 - 1e-6);
        EXPECT_EQ(before.rejected, 0) << method;
        EXPECT_GT(before.largest, 0.05) << method;
        const auto after = run_to(system, method, {}, control, 1.5);
        EXPECT_GE(after.rejected, 3) << method;
        EXPECT_LT(after.smallest, 1e-3) << method;
        // A step h over the jump is off by up to 100 h in v, of which h times as much is allowed.
        EXPECT_NEAR(after.state.v[0], 50.0, 0.1) << method;
        EXPECT_NEAR(after.state.q[0], 12.5, 0.05) << method;
    }
}

TEST(AdaptiveStepping, NeverGoesBeyondTheEndAndMeetsIt) {
    PlanarPendulum pendulum;
    for (const double end : {1e-5, 0.1, 1.0 / 3.0}) {
        const auto run = run_to(pendulum, "hht", {}, tolerance(1e-3), end);
        EXPECT_EQ(run.state.t, end);
    }
}

TEST(AdaptiveStepping, RefusesStepsBelowTheSmallest) {
    PlanarPendulum pendulum;
    StepControl control = tolerance(1e-6);
    control.smallest = control.initial = 0.05;
    try {
        run_to(pendulum, "hht", {}, control, 1.0);
        FAIL() << "no refusal";
    } catch (const StepFailure& failure) {
        EXPECT_NE(std::string(failure.what()).find("the step fell below 0.05 at t = "), std::string::npos)
            << failure.what();
    }
}

TEST(AdaptiveStepping, TriesAgainWhereNewtonFails) {
    PlanarPendulum pendulum;
    StepControl control = tolerance(1e-2);
    control.initial = 0.1;
    const auto run = run_to(pendulum, "hht", {{"max_newton_iterations", "3"}}, control, 0.3);
    EXPECT_GT(run.rejected, 0);
    EXPECT_EQ(run.state.t, 0.3);
}

TEST(AdaptiveStepping, AResumedRunHasTheSameBits) {
    const Registry registry;
    for (const char* method : {"generalized_alpha", "euler_implicit_linearized"}) {
        PlanarPendulum pendulum;
        StepSolver solver(registry, {});
        const auto stepper = make_timestepper(method, pendulum);
        AdaptiveStepping whole(pendulum, *stepper, tolerance(1e-3));
        State state = pendulum.initial_state();
        for (int step = 0; step < 20; ++step) whole.step(state, 10.0, solver);
        const auto memory = stepper->save(), control = whole.save();
        State resumed = state;
        for (int step = 0; step < 20; ++step) whole.step(state, 10.0, solver);

        StepSolver other_solver(registry, {});
        const auto other = make_timestepper(method, pendulum);
        AdaptiveStepping stepping(pendulum, *other, tolerance(1e-3));
        other->load(memory);
        stepping.load(control);
        for (int step = 0; step < 20; ++step) stepping.step(resumed, 10.0, other_solver);
        EXPECT_EQ(resumed.t, state.t) << method;
        EXPECT_EQ(resumed.q, state.q) << method;
        EXPECT_EQ(resumed.v, state.v) << method;
        EXPECT_EQ(stepping.save(), whole.save()) << method;
        EXPECT_THROW(stepping.load({1.0}), InputError);
    }
}

TEST(AdaptiveStepping, RefusesControlsThatMakeNoSense) {
    PlanarPendulum pendulum;
    const auto stepper = make_timestepper("hht", pendulum);
    const auto refused = [&](auto&& change) {
        StepControl control;
        change(control);
        EXPECT_THROW(AdaptiveStepping(pendulum, *stepper, control), InputError);
    };
    refused([](auto& control) { control.absolute = 0.0; });
    refused([](auto& control) { control.relative = -1.0; });
    refused([](auto& control) { control.absolute = HUGE_VAL; });
    refused([](auto& control) { control.smallest = 1.0; });
    refused([](auto& control) { control.largest = 1e-9; });
    refused([](auto& control) { control.initial = std::nan(""); });
}

}  // namespace
}  // namespace delassus::tests::adaptive_test
