// SPDX-License-Identifier: BSD-3-Clause
// Siconos' nonsmooth Gauss–Seidel held against our pgs: the same exact Coulomb problems, the same velocities.
#include <gtest/gtest.h>

#include "delassus/error.hpp"
#include "delassus/errors.hpp"
#include "delassus/generate.hpp"
#include "support/solving.hpp"

namespace delassus::siconos_test {
namespace {

using tests::solve_with;
using tests::to;

class Siconos : public testing::Test {
protected:
    void SetUp() override {
        if (!tests::is_built("siconos")) GTEST_SKIP() << "siconos is not built";
    }

    static void expect_velocities_of_pgs(Problem problem, const OptionTexts& options = {}) {
        problem.law = Law::Coulomb;
        const auto ours = solve_with("pgs", problem, to(1e-11, 1'000'000));
        const auto theirs = solve_with("siconos", problem, to(1e-11, 1'000'000), options);
        ASSERT_EQ(ours.report.status, Status::Solved) << ours.report.message;
        ASSERT_EQ(theirs.report.status, Status::Solved) << theirs.report.message;
        const PreparedProblem prepared(std::move(problem));
        const ErrorMeter meter(prepared);
        EXPECT_LT(meter.velocity(theirs.solution.x, ours.solution.x), 1e-9);
    }
};

Problem moving_pile(double mu) {
    return generate("sphere_pile", {{"contacts", 60}, {"layers", 3}, {"speed", 1.0}, {"mu", mu}});
}

TEST_F(Siconos, GivesTheVelocitiesOfPgs) {
    expect_velocities_of_pgs(moving_pile(0.3));
    expect_velocities_of_pgs(moving_pile(0.3), {{"scaling", "false"}});
    expect_velocities_of_pgs(moving_pile(0.3), {{"local_solver", "projection"}});
}

TEST_F(Siconos, TakesRowsWithoutFriction) {
    expect_velocities_of_pgs(moving_pile(0.0));
}

TEST_F(Siconos, TakesFiniteElements) {
    expect_velocities_of_pgs(generate("elastic_block", {{"elements", 2}, {"layers", 2}}));
}

// Few contacts, under a Newton method and ADMM: what works on compressed columns.
TEST_F(Siconos, FactoringMethodsAgreeToo) {
    const Problem pile = generate("sphere_pile", {{"contacts", 8}, {"layers", 2}, {"speed", 0.2}});
    for (const char* method : {"nsn_ac", "admm"}) expect_velocities_of_pgs(pile, {{"method", method}});
}

// Its library may exit the process: auto must not come to it by itself.
TEST_F(Siconos, IsAPeer) {
    EXPECT_EQ(Registry().find("siconos").flags, DELASSUS_FLAG_PEER);
}

TEST_F(Siconos, RefusesTheAssociatedLaw) {
    const Problem problem = tests::point_on_plane(1.0, 1.0, 2.0, 0.5, Law::Associated);
    EXPECT_THROW(solve_with("siconos", problem, to(1e-8)), Unsupported);
}

}  // namespace
}  // namespace delassus::siconos_test
