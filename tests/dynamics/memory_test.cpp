// SPDX-License-Identifier: BSD-3-Clause
// Checkpoints, restarts, and what is refused.
#include <gtest/gtest.h>

#include "support/order.hpp"
#include "support/systems/elastic_pendulum.hpp"
#include "support/systems/heavy_top.hpp"
#include "support/systems/planar_block.hpp"
#include "support/systems/planar_pendulum.hpp"

namespace delassus::tests::memory_test {
namespace {

struct Method {
    std::string name;
    OptionTexts options;
};
std::ostream& operator<<(std::ostream& out, const Method& method) {
    out << method.name;
    for (const auto& [key, text] : method.options) out << '_' << text;
    return out;
}

class Memory : public testing::TestWithParam<Method> {};

void expect_same_bits(DynamicalSystem& system, const Method& method, double h) {
    const Registry registry;
    StepSolver solver(registry, {});
    const auto whole = make_timestepper(method.name, system, method.options);
    State state = system.initial_state();
    for (int step = 0; step < 20; ++step) whole->step(state, h, solver);
    const auto memory = whole->save();
    State resumed_state = state;
    StepReport report, resumed_report;
    for (int step = 0; step < 20; ++step) whole->step(state, h, solver, report);

    StepSolver other_solver(registry, {});
    const auto resumed = make_timestepper(method.name, system, method.options);
    resumed->load(memory);
    for (int step = 0; step < 20; ++step) resumed->step(resumed_state, h, other_solver, resumed_report);
    EXPECT_EQ(resumed_state.q, state.q);
    EXPECT_EQ(resumed_state.v, state.v);
    EXPECT_EQ(resumed_report.multipliers, report.multipliers);
    EXPECT_EQ(resumed->save(), whole->save());
}

TEST_P(Memory, AResumedRunHasTheSameBits) {
    ElasticPendulum free;
    expect_same_bits(free, GetParam(), 0.01);
    if (GetParam().name == "euler_explicit") return;
    HeavyTop top;
    expect_same_bits(top, GetParam(), 5e-4);
    PlanarPendulum pendulum;
    expect_same_bits(pendulum, GetParam(), 0.01);
}

// A block that slides, with contacts in reach: their impulses and what follows from them are part of the memory.
TEST_P(Memory, AResumedRunWithContactsHasTheSameBits) {
    PlanarBlock block({.inertia = 5.0 / 12.0,
                       .gravity = {3.0, -9.0},
                       .drag = 0.3,
                       .friction = 0.5,
                       .restitution = 0.3,
                       .corners = {{-1.0, -0.5}, {1.0, -0.5}}},
                      {0.0, {0.0, 0.6, 0.1}, {3.0, 0.0, 0.0}});
    for (const auto& info : timesteppers())
        if (info.name == GetParam().name && info.unilateral) expect_same_bits(block, GetParam(), 0.01);
}

// After a restart the state alone decides.
TEST_P(Memory, ARestartForgets) {
    PlanarPendulum pendulum;
    ElasticPendulum oscillator;
    const bool free = GetParam().name == "euler_explicit";
    DynamicalSystem& system = free ? static_cast<DynamicalSystem&>(oscillator) : pendulum;
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper(GetParam().name, system, GetParam().options);
    State state = system.initial_state();
    for (int step = 0; step < 5; ++step) stepper->step(state, 0.01, solver);
    stepper->restart();
    State again = system.initial_state(), fresh = again;
    stepper->step(again, 0.01, solver);
    make_timestepper(GetParam().name, system, GetParam().options)->step(fresh, 0.01, solver);
    EXPECT_EQ(again.q, fresh.q);
    EXPECT_EQ(again.v, fresh.v);
}

INSTANTIATE_TEST_SUITE_P(Methods, Memory,
                         testing::Values(Method{"euler_explicit", {}}, Method{"rk4", {}}, Method{"dormand_prince", {}},
                                         Method{"radau_iia", {}}, Method{"euler_implicit_linearized", {}},
                                         Method{"euler_implicit", {}}, Method{"trapezoidal", {}},
                                         Method{"trapezoidal_linearized", {}}, Method{"newmark", {}}, Method{"hht", {}},
                                         Method{"generalized_alpha", {}},
                                         Method{"generalized_alpha", {{"reuse", "adaptive"}}},
                                         Method{"generalized_alpha", {{"reuse", "modified"}}},
                                         Method{"moreau_jean", {}}, Method{"nonsmooth_generalized_alpha", {}},
                                         Method{"linearly_implicit_trapezoidal", {}}, Method{"switching", {}},
                                         Method{"switching", {{"flight", "radau_iia"}}}),
                         [](const auto& chosen) { return testing::PrintToString(chosen.param); });

TEST(MemoryErrors, AMemoryThatDoesNotFitIsRefused) {
    HeavyTop top;
    PlanarPendulum pendulum;
    const Registry registry;
    StepSolver solver(registry, {});
    const auto stepper = make_timestepper("hht", pendulum, {{"reuse", "adaptive"}});
    State state = pendulum.initial_state();
    stepper->step(state, 0.01, solver);
    auto memory = stepper->save();
    EXPECT_THROW(make_timestepper("hht", top, {})->load(memory), InputError);
    for (memory.pop_back(); memory.size() > 1; memory.pop_back())
        EXPECT_THROW(make_timestepper("hht", pendulum, {})->load(memory), InputError) << memory.size();
}

void expect_refusal(const std::string& method, DynamicalSystem& system, const OptionTexts& options,
                    const std::string& sentence) {
    try {
        static_cast<void>(make_timestepper(method, system, options));
        FAIL() << "no refusal";
    } catch (const Error& error) {
        EXPECT_EQ(error.what(), sentence);
    }
}

TEST(Refusals, ExplicitEulerTakesNoConstraints) {
    PlanarPendulum pendulum;
    const std::string others =
        " takes no constraints; the system has 1 rows of them. Can: dormand_prince, euler_implicit, "
        "euler_implicit_linearized, generalized_alpha, hht, linearly_implicit_trapezoidal, moreau_jean, newmark, "
        "nonsmooth_generalized_alpha, radau_iia, rk4, switching, trapezoidal, "
        "trapezoidal_linearized";
    expect_refusal("euler_explicit", pendulum, {}, "euler_explicit" + others);
}

TEST(Refusals, OthersTakeNoContacts) {
    class Stopped : public ElasticPendulum {
        [[nodiscard]] bool has_unilateral() const override { return true; }
    } system;
    for (const auto& info : timesteppers()) {
        if (info.unilateral) continue;
        expect_refusal(
            info.name, system, {},
            info.name +
                " takes no contacts, stops, dry friction of joints or force limits, which the system has. Can: "
                "euler_implicit_linearized, linearly_implicit_trapezoidal, moreau_jean, nonsmooth_generalized_alpha, "
                "switching");
    }
}

TEST(Refusals, StepsAndStatesThatMakeNoSense) {
    ElasticPendulum system;
    const Registry registry;
    StepSolver solver(registry, {});
    for (const auto& info : timesteppers()) {
        const auto stepper = make_timestepper(info.name, system);
        State state = system.initial_state();
        for (const double h : {0.0, -0.1, std::nan(""), HUGE_VAL})
            EXPECT_THROW(stepper->step(state, h, solver), InputError) << info.name << ' ' << h;
        state.q.pop_back();
        EXPECT_THROW(stepper->step(state, 0.1, solver), InputError) << info.name;
    }
}

TEST(Refusals, OptionsOutsideTheirRange) {
    PlanarPendulum pendulum;
    for (const auto& [method, key, text] :
         std::vector<std::array<std::string, 3>>{{"hht", "alpha", "0.1"},
                                                 {"hht", "alpha", "-0.5"},
                                                 {"generalized_alpha", "rho_infinity", "1.1"},
                                                 {"newmark", "gamma", "0.4"},
                                                 {"newmark", "beta", "0"},
                                                 {"newmark", "alpha", "0"},
                                                 {"trapezoidal", "jacobian", "none"},
                                                 {"euler_implicit", "reuse", "never"}})
        EXPECT_THROW(static_cast<void>(make_timestepper(method, pendulum, {{key, text}})), InputError) << method << key;
}

}  // namespace
}  // namespace delassus::tests::memory_test
