// SPDX-License-Identifier: BSD-3-Clause
// Ten seconds of stiff mechanisms: constraints hold and nothing runs away (docs/measurements.md has the figures).
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "support/scenes.hpp"

namespace delassus::tests::stability_test {
namespace {

struct Method {
    const char* integrator;
    double step;   ///< s
    double drift;  ///< that is stated for it, m
};
void PrintTo(const Method& one, std::ostream* out) {
    *out << one.integrator;
}

SceneOverrides overrides_of(const Method& method, double end) {
    SceneOverrides overrides;
    overrides.integrator = method.integrator;
    overrides.step = method.step;
    overrides.end = end;
    return overrides;
}

class HeavyChain : public testing::TestWithParam<Method> {};

// Twenty links under a weight of a million times their mass: examples/scenes/chain_heavy_end.yaml.
TEST_P(HeavyChain, HoldsForTenSeconds) {
    Running run(read_scene(example_scene("chain_heavy_end"), overrides_of(GetParam(), 10.0)));
    double farthest = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        const auto at = run.pose("weight").position;
        farthest = std::max(farthest, std::hypot(at[0], at[1], at[2]));
    }
    EXPECT_LT(run.simulation.totals().worst_drift, GetParam().drift);
    EXPECT_LT(farthest, 4.1 + 21 * GetParam().drift + 1e-9);
    // Dissipative methods: no energy comes in but by the drift's own work on the weight.
    EXPECT_LT(run.simulation.totals().energy, 1000 * 9.81 * 21 * GetParam().drift + 1.0);
}

INSTANTIATE_TEST_SUITE_P(Methods, HeavyChain,
                         testing::Values(Method{"euler_implicit_linearized", 0.005, 2e-5},
                                         Method{"euler_implicit(newton_tolerance=1e-6)", 0.01, 1e-8},
                                         Method{"hht(alpha=-0.3,newton_tolerance=1e-8)", 0.01, 1e-8}),
                         [](const auto& chosen) {
                             return std::string(chosen.param.integrator, std::strcspn(chosen.param.integrator, "("));
                         });

// Out of its plane links turn about three axes under the pull, and the symmetric part of Newton's matrix leads astray:
// the steps are finished with the whole one. At 0.1 m/s the links, which start at rest, do not fit to the weight's
// speed.
TEST(HeavyChainOutOfItsPlane, HoldsWithNewtonsMethod) {
    for (const char* speed : {"0.01", "0.1"}) {
        SceneOverrides overrides = overrides_of({"euler_implicit(newton_tolerance=1e-6)", 0.01, 0.0}, 5.0);
        overrides.values = {{"bodies.weight.velocity", std::string("[0, ") + speed + ", 0]"}};
        Running run(read_scene(example_scene("chain_heavy_end"), overrides));
        run.finish();
        EXPECT_LT(run.simulation.totals().worst_drift, 2e-6) << speed;
        const auto at = run.pose("weight").position;
        EXPECT_NEAR(std::hypot(at[0], at[1], at[2]), 4.1, 1e-3) << speed;
    }
}

// What the method does without the stiffness of its constraints.
TEST(HeavyChainWithout, ConstraintStiffnessIsLost) {
    Running run(read_scene(example_scene("chain_heavy_end"),
                           overrides_of({"euler_implicit_linearized(constraint_stiffness=none)", 0.005, 0.0}, 1.0)));
    run.finish();
    EXPECT_GT(run.simulation.totals().worst_drift, 0.01);
}

// A bob of 1 kg on a spring of 1e8 N/m: ω = 1e4 rad/s, 20 to 100 times faster than a step. 3 m g stretch it by 2.94e-7
// m.
constexpr const char* stiff_pendulum = R"(
step: 0.01
end: 10
bodies:
  - {name: bob, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, position: [1, 0, 0]}
springs:
  - {name: rod, second: bob, first_point: [0, 0, 0], stiffness: 1.0e8}
)";

class StiffPendulum : public testing::TestWithParam<Method> {};

TEST_P(StiffPendulum, KeepsItsLengthForTenSeconds) {
    Running run(parse_scene(stiff_pendulum, "stiff pendulum", overrides_of(GetParam(), 10.0)));
    double worst = 0.0;
    while (!run.simulation.finished()) {
        run.simulation.step();
        const auto at = run.pose("bob").position;
        worst = std::max(worst, std::abs(std::hypot(at[0], at[1], at[2]) - 1.0));
    }
    EXPECT_LT(worst, GetParam().drift);
    EXPECT_LT(run.simulation.totals().energy, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Methods, StiffPendulum,
                         testing::Values(Method{"euler_implicit_linearized(linearization_limit=inf)", 0.01, 2e-5},
                                         Method{"euler_implicit", 0.002, 3e-7}, Method{"hht", 0.002, 3e-7},
                                         Method{"generalized_alpha", 0.002, 3e-7}),
                         [](const auto& chosen) {
                             return std::string(chosen.param.integrator, std::strcspn(chosen.param.integrator, "("));
                         });

}  // namespace
}  // namespace delassus::tests::stability_test
