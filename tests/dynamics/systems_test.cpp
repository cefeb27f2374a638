// SPDX-License-Identifier: BSD-3-Clause
// The test systems themselves: their derivatives against differences, their group, the reference solution.
#include <gtest/gtest.h>

#include "support/order.hpp"
#include "support/systems/elastic_pendulum.hpp"
#include "support/systems/heavy_top.hpp"
#include "support/systems/planar_pendulum.hpp"
#include "support/systems/slider_crank.hpp"

namespace delassus::tests::systems_test {
namespace {

template <class System>
class Systems : public testing::Test {
protected:
    System system_;
};
using All = testing::Types<ElasticPendulum, PlanarPendulum, DrivenPendulum, SliderCrank, HeavyTop, HeavyTopReduced>;
TYPED_TEST_SUITE(Systems, All);

VectorXd some(std::int32_t count, double size) {
    VectorXd result(count);
    for (std::int32_t i = 0; i < count; ++i) result[i] = size * std::sin(1.0 + 2.0 * i);
    return result;
}

TYPED_TEST(Systems, DerivativesAreThoseOfDifferences) {
    auto state = this->system_.initial_state();
    const auto n = this->system_.n();
    const VectorXd delta = some(n, 0.3);
    this->system_.increment(state.q.data(), delta.data(), state.q.data());
    for (std::int32_t i = 0; i < n; ++i) state.v[static_cast<std::size_t>(i)] = std::cos(2.0 * i);
    expect_derivatives(this->system_, state, some(this->system_.m(), 5.0));
    expect_group(this->system_, state, some(n, 0.8));
}

TYPED_TEST(Systems, StartConsistently) {
    const auto state = this->system_.initial_state();
    const auto m = this->system_.m();
    VectorXd C = VectorXd::Zero(m);
    MatrixAssembler D;
    D.begin(m, this->system_.n());
    this->system_.constraint(state, C.data());
    this->system_.add_constraint_jacobian(state, 0, D);
    D.finish().multiply_add(1.0, state.v.data(), C.data());
    VectorXd rate(m);
    this->system_.constraint_rate(state, rate.data());
    C += rate;
    EXPECT_LE(C.norm(), 1e-13);
}

// The two forms of the heavy top share nothing but their data and the rotation.
TEST(Reference, TwoFormsOfTheHeavyTopAgree) {
    const HeavyTop top;
    const HeavyTopReduced reduced;
    const auto full = reference_solution(top, 0.1, 8000), small = reference_solution(reduced, 0.1, 8000);
    VectorXd difference(3);
    rotation_between(&full.state.q[3], small.state.q.data(), difference.data());
    EXPECT_LE(difference.norm(), 1e-10);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(full.state.v[3 + i], small.state.v[i], 1e-8);
}

TEST(Rotations, AMillionIncrementsKeepTheUnitLength) {
    const HeavyTop top;
    auto state = top.initial_state();
    const VectorXd delta = some(6, 0.7);
    double worst = 0.0;
    for (int i = 0; i < 1000000; ++i) {
        top.increment(state.q.data(), delta.data(), state.q.data());
        worst = std::max(worst, std::abs(quaternion_at(&state.q[3]).norm() - 1.0));
    }
    EXPECT_LE(worst, 4e-16);
}

}  // namespace
}  // namespace delassus::tests::systems_test
