// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/newton.hpp"

#include <gtest/gtest.h>

#include "support/order.hpp"
#include "support/systems/elastic_pendulum.hpp"
#include "support/systems/heavy_top.hpp"
#include "support/systems/planar_pendulum.hpp"
#include "support/systems/slider_crank.hpp"

namespace delassus::tests::newton_test {
namespace {

VectorXd some(std::int32_t count, double size, double phase) {
    VectorXd result(count);
    for (std::int32_t i = 0; i < count; ++i) result[i] = size * std::sin(phase + 2.0 * i);
    return result;
}

template <class System>
class NewtonMatrix : public testing::Test {
protected:
    System system_;
};
using All = testing::Types<ElasticPendulum, PlanarPendulum, DrivenPendulum, SliderCrank, HeavyTop, HeavyTopReduced>;
TYPED_TEST_SUITE(NewtonMatrix, All);

// Far from the beginning of the step, so that T⁻¹(Δ) is far from the identity.
TYPED_TEST(NewtonMatrix, IsTheDerivativeOfTheResidual) {
    auto& system = this->system_;
    const auto n = system.n(), m = system.m();
    Newton newton(system, {.method = "test"});
    const State begin = system.initial_state();
    const StepSlopes slopes{20.0, 400.0};
    StepPoint point{begin, some(n, 0.9, 0.3), some(n, 3.0, 1.0), some(m, 40.0, 2.0)};
    const VectorXd speed = some(n, 2.0, 0.7);
    point.state.v.assign(speed.begin(), speed.end());
    StepResidual residual;
    ASSERT_TRUE(newton.evaluate(begin, point, residual));
    const MatrixXd H = dense(newton.matrix(point, slopes)), D = dense(newton.jacobian(point.state));

    MatrixXd H_expected(n, n), D_expected(m, n);
    const double step = 1e-6;
    for (std::int32_t j = 0; j < n; ++j) {
        const auto at = [&](double distance) {
            const VectorXd x = distance * VectorXd::Unit(n, j);
            const State there = moved(system, point.state, x);
            StepPoint end = point;
            system.difference(begin.q.data(), there.q.data(), end.delta.data());
            const VectorXd change = end.delta - point.delta;
            end.acceleration += slopes.beta * change;
            for (std::int32_t i = 0; i < n; ++i) end.state.v[static_cast<std::size_t>(i)] += slopes.gamma * change[i];
            StepResidual result;
            EXPECT_TRUE(newton.evaluate(begin, end, result));
            return result;
        };
        const auto up = at(step), down = at(-step);
        H_expected.col(j) = (up.balance - down.balance) / (2.0 * step * slopes.beta);
        D_expected.col(j) = (up.constraint - down.constraint) / (2.0 * step);
    }
    expect_near(H, H_expected, 1e-7, "H");
    expect_near(D, D_expected, 1e-7, "D");
}

class NewtonOnTheTop : public testing::Test {
protected:
    /// The norms of the right-hand sides of one step's linear problems.
    std::vector<double> residuals(const OptionTexts& options, double h) {
        const auto stepper = make_timestepper("generalized_alpha", top_, options);
        State state = top_.initial_state();
        stepper->step(state, h, solver_);
        std::vector<double> result;
        solver_.watch([&](const Problem& problem) {
            result.push_back(std::hypot(Eigen::Map<const VectorXd>(problem.a.data(), problem.n()).norm(),
                                        Eigen::Map<const VectorXd>(problem.b.data(), problem.m()).norm()));
        });
        stepper->step(state, h, solver_);
        solver_.watch(nullptr);
        return result;
    }

    HeavyTop top_;
    Registry registry_;
    StepSolver solver_{registry_, {}};
};

// The body turns by 129° in this step. Order p means log(r₊/r) = p log(r/r₋).
TEST_F(NewtonOnTheTop, ConvergesQuadraticallyWithTheExactMatrix) {
    const auto r = residuals({{"newton_tolerance", "1e-13"}, {"jacobian", "exact"}, {"reuse", "full"}}, 1.5e-2);
    ASSERT_EQ(r.size(), 4u);
    for (std::size_t k = 1; k + 1 < r.size(); ++k)
        EXPECT_GE(std::log(r[k + 1] / r[k]) / std::log(r[k] / r[k - 1]), 1.8) << k;
}

TEST_F(NewtonOnTheTop, ConvergesLinearlyWithTheSymmetricPart) {
    const auto r = residuals({{"newton_tolerance", "1e-13"}, {"jacobian", "symmetric"}, {"reuse", "full"}}, 1.5e-2);
    ASSERT_GE(r.size(), 6u);
    EXPECT_LE(r.size(), 10u);
    for (std::size_t k = 1; k + 1 < r.size(); ++k) EXPECT_LE(r[k + 1], 0.1 * r[k]) << k;
}

// The residual is exact whichever matrix is used, so that the end of the run is the same.
TEST_F(NewtonOnTheTop, TheSolutionDoesNotDependOnTheMatrix) {
    const auto full =
        run(top_, "generalized_alpha", {{"newton_tolerance", "1e-13"}, {"jacobian", "exact"}}, 0.02, 40, solver_);
    for (const OptionTexts& options :
         {OptionTexts{{"newton_tolerance", "1e-13"}, {"jacobian", "symmetric"}},
          OptionTexts{{"newton_tolerance", "1e-13"}, {"reuse", "modified"}, {"jacobian", "exact"}},
          OptionTexts{{"newton_tolerance", "1e-13"}, {"reuse", "adaptive"}, {"jacobian", "exact"}},
          OptionTexts{{"newton_tolerance", "1e-13"}, {"reuse", "adaptive"}, {"jacobian", "symmetric"}}}) {
        const auto other = run(top_, "generalized_alpha", options, 0.02, 40, solver_);
        for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(other.state.q[i], full.state.q[i], 1e-12);
        for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(other.state.v[i], full.state.v[i], 1e-9);
        EXPECT_LE((other.lambda - full.lambda).norm(), 1e-8 * full.lambda.norm());
    }
}

/// How many different pairs of H and D the steps had.
std::size_t matrices(const std::string& reuse, std::int64_t& problems) {
    PlanarPendulum pendulum;
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper("generalized_alpha", pendulum, {{"reuse", reuse}});
    State state = pendulum.initial_state();
    std::vector<double> last;
    std::size_t count = 0;
    solver.watch([&](const Problem& problem) {
        auto values = problem.H.value;
        values.insert(values.end(), problem.D.value.begin(), problem.D.value.end());
        if (values != last) ++count;
        last = values;
    });
    for (int step = 0; step < 200; ++step) stepper->step(state, 2e-3, solver);
    problems = solver.effort().solves;
    return count;
}

TEST(NewtonReuse, MakesFewerMatrices) {
    std::int64_t full_problems = 0, modified_problems = 0, adaptive_problems = 0;
    const auto full = matrices("full", full_problems), modified = matrices("modified", modified_problems),
               adaptive = matrices("adaptive", adaptive_problems);
    EXPECT_EQ(full, static_cast<std::size_t>(full_problems));
    EXPECT_LE(modified, 201u);
    EXPECT_LE(adaptive, 50u);
    EXPECT_GE(modified_problems, full_problems);
    EXPECT_LE(adaptive_problems, 6 * full_problems);
}

/// The pendulum with its constraint twice, as x² + y² − 1 and as the distance less 1: parallel gradients, different
/// curvatures.
class TwiceHeld : public PlanarPendulum {
public:
    using PlanarPendulum::PlanarPendulum;
    [[nodiscard]] std::vector<std::int32_t> constraint_blocks() const override { return {1, 1}; }
    void constraint(const State& s, double* C) const override {
        PlanarPendulum::constraint(s, C);
        C[1] = std::hypot(s.q[0], s.q[1]) - 1.0;
    }
    void add_constraint_jacobian(const State& s, std::int32_t first_row, MatrixAssembler& D) const override {
        PlanarPendulum::add_constraint_jacobian(s, first_row, D);
        const double r = std::hypot(s.q[0], s.q[1]);
        D.add(first_row + 1, 0, s.q[0] / r);
        D.add(first_row + 1, 1, s.q[1] / r);
    }
    void constraint_curvature(const State& s, double* c) const override {
        PlanarPendulum::constraint_curvature(s, c);
        const double r = std::hypot(s.q[0], s.q[1]), speed = (s.q[0] * s.v[0] + s.q[1] * s.v[1]) / r;
        c[1] = (s.v[0] * s.v[0] + s.v[1] * s.v[1] - speed * speed) / r;
    }
    void add_constraint_stiffness(const State& s, const double* lambda, double factor, Tangent tangent,
                                  MatrixAssembler& H) const override {
        PlanarPendulum::add_constraint_stiffness(s, lambda, factor, tangent, H);
        const Eigen::Map<const Eigen::Vector2d> q(s.q.data());
        const Eigen::Vector2d direction = q.normalized();
        add_tangent<2>(lambda[1] / q.norm() * (Eigen::Matrix2d::Identity() - direction * direction.transpose()), 0,
                       factor, tangent, H);
    }
};

TEST(NewtonRedundant, RowsThatRepeatEachOtherChangeNothing) {
    const State initial{0.0, {std::sqrt(0.75), -0.5}, {1.0, std::sqrt(3.0)}};
    TwiceHeld twice(initial);
    PlanarPendulum once(initial);
    const Registry registry;
    StepSolver solver(registry, {});
    for (const char* method : {"euler_implicit", "hht", "generalized_alpha"}) {
        const auto stepper = make_timestepper(method, twice, {}), single = make_timestepper(method, once, {});
        State state = initial, expected = initial;
        StepReport report, single_report;
        for (int step = 0; step < 100; ++step) {
            stepper->step(state, 0.01, solver, report);
            EXPECT_TRUE(report.solved) << report.message;
            single->step(expected, 0.01, solver, single_report);
        }
        EXPECT_NEAR(state.q[0], expected.q[0], 1e-10) << method;
        EXPECT_NEAR(state.v[0], expected.v[0], 1e-8) << method;
        // Both rows pull along the same line: 2 λ₀ r + λ₁ is the force.
        const auto& lambda = report.multipliers;
        EXPECT_NEAR(2.0 * lambda[0] + lambda[1], 2.0 * single_report.multipliers[0], 1e-6) << method;
    }
}

/// v̇ = −4000 atan(q − 1), whose Newton's method overshoots more and more from |q − 1| > 1.39.
class Overshooting : public DynamicalSystem {
public:
    [[nodiscard]] std::int32_t n() const override { return 1; }
    [[nodiscard]] State initial_state() const override { return {0.0, {4.0}, {0.0}}; }
    void add_mass(const State&, double factor, MatrixAssembler& M) const override { M.add(0, 0, factor); }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        result[0] += factor * x[0];
    }
    void add_force(const State& s, double factor, double* result) const override {
        result[0] -= factor * 4000.0 * std::atan(s.q[0] - 1.0);
    }
    void add_stiffness(const State& s, double factor, Tangent, MatrixAssembler& H) const override {
        H.add(0, 0, factor * 4000.0 / (1.0 + (s.q[0] - 1.0) * (s.q[0] - 1.0)));
    }
};

TEST(NewtonSearch, HalvesWhatOvershoots) {
    Overshooting system;
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper("euler_implicit", system, {{"reuse", "full"}});
    State state = system.initial_state();
    const auto report = stepper->step(state, 10.0, solver);
    EXPECT_NEAR(state.q[0], 1.0, 1e-4);
    EXPECT_LE(report.newton_iterations, 12);
}

/// Two freedoms without rows: the second pushes the first, so that ∂f/∂q is not symmetric.
class OneSided : public DynamicalSystem {
public:
    [[nodiscard]] std::int32_t n() const override { return 2; }
    [[nodiscard]] State initial_state() const override { return {0.0, {0.3, 0.5}, {1.0, -0.4}}; }
    void add_mass(const State&, double factor, MatrixAssembler& M) const override {
        for (std::int32_t i = 0; i < 2; ++i) M.add(i, i, factor);
    }
    void multiply_mass(const State&, double factor, const double* x, double* result) const override {
        for (int i = 0; i < 2; ++i) result[i] += factor * x[i];
    }
    void add_force(const State& s, double factor, double* result) const override {
        result[0] -= factor * (100.0 * s.q[0] + 300.0 * std::sin(s.q[1]));
        result[1] -= factor * 100.0 * s.q[1];
    }
    void add_stiffness(const State& s, double factor, Tangent tangent, MatrixAssembler& H) const override {
        Eigen::Matrix2d K;
        K << 100.0, 300.0 * std::cos(s.q[1]), 0.0, 100.0;
        add_tangent<2>(K, 0, factor, tangent, H);
    }
};

// Without rows no solver has to take the matrix, and the derivative is used: its residuals fall quadratically, those of
// the symmetric part do not.
TEST(NewtonJacobian, IsTheDerivativeWhereNoPluginIsNeeded) {
    OneSided system;
    const Registry registry;
    StepSolver solver(registry, {});
    const auto iterations = [&](const std::string& jacobian) {
        const auto stepper = make_timestepper("euler_implicit", system, {{"jacobian", jacobian}, {"reuse", "full"}});
        State state = system.initial_state();
        const auto report = stepper->step(state, 0.05, solver);
        // Both end at the same state, where the residual of the implicit Euler step vanishes.
        const double h = 0.05;
        EXPECT_NEAR(state.v[1], -0.4 - h * 100.0 * state.q[1], 1e-9) << jacobian;
        EXPECT_NEAR(state.v[0], 1.0 - h * (100.0 * state.q[0] + 300.0 * std::sin(state.q[1])), 1e-9) << jacobian;
        return report.newton_iterations;
    };
    EXPECT_EQ(iterations("auto"), iterations("exact"));
    EXPECT_LE(iterations("auto"), 4);
    EXPECT_GT(iterations("symmetric"), iterations("exact") + 2);
    EXPECT_EQ(solver.effort().plugin_solves, 0);
}

// A solver that is to take every problem whole, and takes symmetric ones alone, is given the symmetric part.
TEST(NewtonJacobian, IsSymmetricWhereEverySolveGoesToAPluginThatWantsIt) {
    OneSided system;
    const Registry registry;
    SolverConfig config;
    config.name = "minres";
    StepSolver solver(registry, config);
    solver.leave_nothing_out();
    const auto stepper = make_timestepper("euler_implicit", system, {});
    State state = system.initial_state();
    try {
        stepper->step(state, 0.005, solver);
    } catch (const InputError& error) {
        GTEST_SKIP() << error.what();  // minres is not built
    }
    EXPECT_GT(solver.effort().plugin_solves, 0);
    EXPECT_NEAR(state.v[1], -0.4 - 0.005 * 100.0 * state.q[1], 1e-9);
}

TEST(NewtonFailure, SaysWhereAndLeavesTheState) {
    PlanarPendulum pendulum;
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper("generalized_alpha", pendulum, {{"max_newton_iterations", "2"}});
    State state = pendulum.initial_state();
    for (int step = 0; step < 10; ++step) stepper->step(state, 1e-3, solver);
    const State before = state;
    const auto memory = stepper->save();
    try {
        stepper->step(state, 0.3, solver);
        FAIL() << "the step was taken";
    } catch (const StepFailure& failure) {
        const std::string text = failure.what();
        EXPECT_NE(text.find("generalized_alpha cannot take the step from t = 0.01"), std::string::npos) << text;
        EXPECT_NE(text.find("with h = 0.3: after 2 iterations of Newton's method the scaled residual is"),
                  std::string::npos)
            << text;
    }
    EXPECT_EQ(state.t, before.t);
    EXPECT_EQ(state.q, before.q);
    EXPECT_EQ(state.v, before.v);
    EXPECT_EQ(stepper->save(), memory);
    stepper->step(state, 1e-3, solver);
}

TEST(NewtonFailure, AForceThatIsNotFinite) {
    class Broken : public Overshooting {
        void add_force(const State&, double, double* result) const override { result[0] = std::nan(""); }
    } system;
    const Registry registry;
    StepSolver solver(registry, {});
    for (const char* method : {"euler_explicit", "rk4", "euler_implicit", "trapezoidal", "generalized_alpha"}) {
        State state = system.initial_state();
        EXPECT_THROW(make_timestepper(method, system, {})->step(state, 0.1, solver), StepFailure) << method;
        EXPECT_EQ(state.q[0], 4.0);
    }
}

}  // namespace
}  // namespace delassus::tests::newton_test
