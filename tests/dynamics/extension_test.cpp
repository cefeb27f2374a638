// SPDX-License-Identifier: BSD-3-Clause
// Continuous extensions: their orders, and that they meet the constraints and both ends of a step.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "delassus/continuous_extension.hpp"
#include "support/order.hpp"
#include "support/systems/elastic_pendulum.hpp"
#include "support/systems/heavy_top.hpp"
#include "support/systems/planar_pendulum.hpp"
#include "support/systems/slider_crank.hpp"

namespace delassus::tests::extension_test {
namespace {

struct Method {
    std::string name;
    OptionTexts options;
    int position, multiplier;  ///< orders
};

const Method dormand_prince{"dormand_prince", {}, 5, 5}, radau{"radau_iia", {{"newton_tolerance", "1e-13"}}, 4, 3};

struct Subject {
    std::string name;
    std::unique_ptr<DynamicalSystem> (*make)();
    double t;
    int steps;
};

std::vector<Subject> subjects() {
    return {{"elastic_pendulum", [] { return std::unique_ptr<DynamicalSystem>(new ElasticPendulum); }, 0.83, 20},
            {"reduced_top", [] { return std::unique_ptr<DynamicalSystem>(new HeavyTopReduced); }, 0.083, 40},
            {"planar_pendulum",
             [] {
                 return std::unique_ptr<DynamicalSystem>(
                     new PlanarPendulum(State{0.0, {std::sqrt(0.75), -0.5}, {1.0, std::sqrt(3.0)}}));
             },
             0.83, 20},
            {"driven_pendulum", [] { return std::unique_ptr<DynamicalSystem>(new DrivenPendulum); }, 0.83, 20},
            {"slider_crank", [] { return std::unique_ptr<DynamicalSystem>(new SliderCrank); }, 0.41, 80},
            {"heavy_top", [] { return std::unique_ptr<DynamicalSystem>(new HeavyTop); }, 0.083, 30}};
}

std::vector<double> residual(const DynamicalSystem& system, const State& state) {
    const auto m = system.m();
    std::vector<double> C(static_cast<std::size_t>(m)), rate(static_cast<std::size_t>(m));
    if (m == 0) return {};
    system.constraint(state, C.data());
    system.constraint_rate(state, rate.data());
    MatrixAssembler D;
    D.begin(m, system.n());
    system.add_constraint_jacobian(state, 0, D);
    D.finish().multiply_add(1.0, state.v.data(), rate.data());
    C.insert(C.end(), rate.begin(), rate.end());
    return C;
}

double largest(const std::vector<double>& values) {
    double most = 0.0;
    for (const double value : values) most = std::max(most, std::abs(value));
    return most;
}

class Extension : public testing::TestWithParam<std::tuple<Method, Subject>> {};

// The error at one time, in the middle of steps of which the last ends beyond it.
TEST_P(Extension, HasTheOrderClaimed) {
    const auto& [method, subject] = GetParam();
    const auto system = subject.make();
    const Motion reference = reference_solution(*system, subject.t, 200 * subject.steps);
    const Registry registry;
    StepSolver solver(registry, {});
    Convergence measured;
    VectorXd off(system->n());
    for (const int factor : {1, 2, 4, 8}) {
        measured.h.push_back(1.0 / factor);
        double position = 0.0, velocity = 0.0, multiplier = 0.0;
        for (const double theta : {0.15, 0.4, 0.6, 0.85}) {
            const int before = factor * subject.steps;
            const double h = subject.t / (before + theta);
            const auto stepper = make_timestepper(method.name, *system, method.options);
            State state = system->initial_state(), between;
            for (int step = 0; step <= before; ++step) stepper->step(state, h, solver);
            ContinuousExtension way;
            ASSERT_TRUE(stepper->has_extension());
            stepper->extend(way);
            DenseOutput output(*system);
            StepReport report;
            output.at(way, subject.t, between, solver, report);
            EXPECT_EQ(between.t, subject.t);
            EXPECT_LE(largest(residual(*system, between)), 1e-12 * (1.0 + largest(between.v)));
            system->difference(reference.state.q.data(), between.q.data(), off.data());
            position = std::max(position, off.norm());
            velocity = std::max(velocity, (Eigen::Map<const VectorXd>(between.v.data(), off.size()) -
                                           Eigen::Map<const VectorXd>(reference.state.v.data(), off.size()))
                                              .norm());
            const std::vector<double> lambda = output.multipliers(way, between, solver, report);
            ASSERT_EQ(static_cast<std::int32_t>(lambda.size()), system->m());
            for (Eigen::Index i = 0; i < reference.lambda.size(); ++i)
                multiplier = std::max(multiplier, std::abs(lambda[static_cast<std::size_t>(i)] - reference.lambda[i]));
        }
        measured.position.push_back(position);
        measured.velocity.push_back(velocity);
        measured.multiplier.push_back(multiplier);
    }
    const double q = measured.order(measured.position), v = measured.order(measured.velocity);
    EXPECT_GE(q, method.position - 0.3) << measured.position.back();
    EXPECT_GE(v, method.position - 0.3) << measured.velocity.back();
    const double lambda = system->m() > 0 ? measured.order(measured.multiplier) : 0.0;
    if (system->m() > 0) {
        EXPECT_GE(lambda, method.multiplier - 0.3) << measured.multiplier.back();
    }
    if (std::getenv("DELASSUS_PRINT_ORDERS") != nullptr)
        std::printf("%s on %s: q %.2f v %.2f lambda %.2f; errors %.1e %.1e %.1e\n", method.name.c_str(),
                    subject.name.c_str(), q, v, lambda, measured.position.back(), measured.velocity.back(),
                    measured.multiplier.back());
}

// Just after the beginning and just before the end it is where the step begins and ends.
TEST_P(Extension, MeetsBothEnds) {
    const auto& [method, subject] = GetParam();
    const auto system = subject.make();
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper(method.name, *system, method.options);
    State state = system->initial_state(), begin, between;
    const double h = subject.t / subject.steps;
    StepReport report;
    for (int step = 0; step < 3; ++step) {
        begin = state;
        stepper->step(state, h, solver, report);
    }
    ContinuousExtension way;
    stepper->extend(way);
    DenseOutput output(*system);
    VectorXd off(system->n());
    const auto expect_near = [&](const State& one, const State& other) {
        const double size = 1.0 + largest(one.q) + largest(one.v);
        system->difference(one.q.data(), other.q.data(), off.data());
        EXPECT_LE(off.lpNorm<Eigen::Infinity>(), 1e-12 * size);
        for (std::size_t i = 0; i < one.v.size(); ++i) EXPECT_NEAR(one.v[i], other.v[i], 1e-11 * size);
    };
    StepReport found;
    output.at(way, std::nextafter(begin.t, 1.0), between, solver, found);
    expect_near(begin, between);
    output.at(way, std::nextafter(state.t, 0.0), between, solver, found);
    expect_near(state, between);
    output.at(way, state.t, between, solver, found);
    EXPECT_EQ(between.q, state.q);
    EXPECT_EQ(between.v, state.v);
    EXPECT_EQ(output.multipliers(way, between, solver, found), report.multipliers);
    EXPECT_THROW(output.at(way, state.t + 1e-3 * h, between, solver, found), InputError);
    EXPECT_THROW(output.at(way, begin.t - 1e-3 * h, between, solver, found), InputError);
}

INSTANTIATE_TEST_SUITE_P(Methods, Extension,
                         testing::Combine(testing::Values(dormand_prince, radau), testing::ValuesIn(subjects())),
                         [](const auto& chosen) {
                             return std::get<0>(chosen.param).name + "_on_" + std::get<1>(chosen.param).name;
                         });

TEST(Extensions, AreOfTwoMethods) {
    PlanarPendulum pendulum(State{0.0, {1.0, 0.0}, {0.0, 0.0}});
    const Registry registry;
    StepSolver solver(registry, {});
    for (const auto& info : timesteppers()) {
        if (!info.constraints) continue;
        const auto stepper = make_timestepper(info.name, pendulum);
        const bool expected = info.name == "dormand_prince" || info.name == "radau_iia";
        EXPECT_EQ(stepper->has_extension(), expected) << info.name;
        ContinuousExtension way;
        way.degree = 7;
        stepper->extend(way);
        EXPECT_EQ(way.degree, 0) << info.name << " before the first step";
        State state = pendulum.initial_state();
        stepper->step(state, 1e-3, solver);
        stepper->extend(way);
        EXPECT_EQ(way.degree > 0, expected) << info.name;
    }
}

}  // namespace
}  // namespace delassus::tests::extension_test
