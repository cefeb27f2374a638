// SPDX-License-Identifier: BSD-3-Clause
// The planar pendulum from (−1, 0) at rest: its period 4 K(½)/√(g/L) and its position at t = 10 s are known.
#include <gtest/gtest.h>

#include "support/order.hpp"
#include "support/systems/planar_pendulum.hpp"

namespace delassus::tests::pendulum_test {
namespace {

constexpr double period = 2.367841947576237;
constexpr double x_at_10 = -0.275087462576, y_at_10 = -0.961419205099;

TEST(Pendulum, TheReferenceSolutionHasTheKnownValues) {
    const PlanarPendulum pendulum;
    const auto at_10 = reference_solution(pendulum, 10.0, 60000);
    EXPECT_NEAR(at_10.state.q[0], x_at_10, 2e-11);
    EXPECT_NEAR(at_10.state.q[1], y_at_10, 2e-11);
    const auto back = reference_solution(pendulum, period, 10000);
    EXPECT_NEAR(back.state.v[1], 0.0, 1e-10);
}

struct Method {
    std::string name;
    OptionTexts options;
};
std::ostream& operator<<(std::ostream& out, const Method& method) {
    return out << method.name;
}

class Swinging : public testing::TestWithParam<Method> {
protected:
    Registry registry_;
    StepSolver solver_{registry_, {}};
};
class SwingingLong : public Swinging {};

// Errors of order 2 vanish by (4 e(h/2) − e(h))/3.
TEST_P(SwingingLong, ReachesTheKnownPositionAt10) {
    PlanarPendulum pendulum;
    const auto coarse = run(pendulum, GetParam().name, GetParam().options, 10.0, 8000, solver_);
    const auto fine = run(pendulum, GetParam().name, GetParam().options, 10.0, 16000, solver_);
    EXPECT_NEAR(fine.state.q[0], x_at_10, 1e-4);
    EXPECT_NEAR(fine.state.q[1], y_at_10, 1e-4);
    EXPECT_NEAR((4.0 * fine.state.q[0] - coarse.state.q[0]) / 3.0, x_at_10, 5e-7);
    EXPECT_NEAR((4.0 * fine.state.q[1] - coarse.state.q[1]) / 3.0, y_at_10, 5e-7);
}

// At the turning point the velocity passes through zero at the rate g.
TEST_P(Swinging, HasTheKnownPeriod) {
    const auto measured = [&](double h) {
        PlanarPendulum pendulum;
        const auto stepper = make_timestepper(GetParam().name, pendulum, GetParam().options);
        State now = pendulum.initial_state();
        for (double speed = 0.0;;) {
            stepper->step(now, h, solver_);
            if (now.t > 2.0 && speed > 0.0 && now.v[1] <= 0.0) return now.t - h * now.v[1] / (now.v[1] - speed);
            if (now.t > 3.0) return 0.0;
            speed = now.v[1];
        }
    };
    const double coarse = measured(2e-3), fine = measured(1e-3);
    EXPECT_NEAR(fine, period, 1e-5);
    EXPECT_NEAR((4.0 * fine - coarse) / 3.0, period, 1e-7);
}

const Method damped[] = {{"hht", {{"alpha", "-0.1"}, {"newton_tolerance", "1e-12"}}},
                         {"generalized_alpha", {{"newton_tolerance", "1e-12"}}}};
const Method undamped[] = {{"trapezoidal", {{"newton_tolerance", "1e-12"}}},
                           {"trapezoidal_linearized", {}},
                           {"newmark", {{"newton_tolerance", "1e-12"}}}};
const auto name_of_method = [](const auto& chosen) { return chosen.param.name; };

INSTANTIATE_TEST_SUITE_P(Damped, Swinging, testing::ValuesIn(damped), name_of_method);
INSTANTIATE_TEST_SUITE_P(Undamped, Swinging, testing::ValuesIn(undamped), name_of_method);
INSTANTIATE_TEST_SUITE_P(Damped, SwingingLong, testing::ValuesIn(damped), name_of_method);

/// λ at t less that of the position reached, λ = −(3/2) g (−y) from rest at the height of the pivot.
double oscillation(const std::string& method, const OptionTexts& options, double t, int steps) {
    PlanarPendulum pendulum;
    const Registry registry;
    StepSolver solver(registry, {});
    const auto end = run(pendulum, method, options, t, steps, solver);
    return std::abs(end.lambda[0] - 1.5 * 9.81 * end.state.q[1]);
}

// Undamped methods do not only let λ oscillate in a constrained system: the amplitude grows exponentially in time, by
// the same factor with every step size. This is why they cannot be used for long, and it is not cured by small steps.
TEST(Undamped, MultipliersGrowInTimeWhateverTheStep) {
    const OptionTexts tight = {{"newton_tolerance", "1e-12"}};
    for (const auto& [method, options] :
         {Method{"trapezoidal", tight}, Method{"trapezoidal_linearized", {}}, Method{"newmark", tight},
          Method{"generalized_alpha", {{"rho_infinity", "1"}, {"newton_tolerance", "1e-12"}}}})
        for (const int steps : {200, 400, 800})
            EXPECT_GT(oscillation(method, options, 5.0, 5 * steps),
                      100.0 * oscillation(method, options, 2.0, 2 * steps))
                << method << " with " << steps << " steps a second";
}

TEST(Damped, MultipliersDoNotGrow) {
    for (const auto& [method, options] : damped) EXPECT_LT(oscillation(method, options, 9.0, 1800), 1e-2) << method;
}

}  // namespace
}  // namespace delassus::tests::pendulum_test
