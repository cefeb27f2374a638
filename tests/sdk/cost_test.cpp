// SPDX-License-Identifier: BSD-3-Clause
// Seconds by phase, and how they get through the border.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "delassus/sdk/cost.hpp"

namespace delassus::sdk::cost_test {
namespace {

using namespace std::chrono_literals;

TEST(PhaseClock, APhaseInsideAnotherTakesTheTimeFromIt) {
    PhaseClock clock;
    {
        const PhaseClock::Span outer(clock, DELASSUS_PHASE_PRODUCTS);
        std::this_thread::sleep_for(20ms);
        {
            const PhaseClock::Span inner(clock, DELASSUS_PHASE_EXCHANGE);
            std::this_thread::sleep_for(60ms);
        }
        std::this_thread::sleep_for(20ms);
    }
    std::this_thread::sleep_for(20ms);  // no phase's
    const auto seconds = clock.seconds();
    EXPECT_GE(seconds[DELASSUS_PHASE_PRODUCTS], 0.040);
    EXPECT_GE(seconds[DELASSUS_PHASE_EXCHANGE], 0.060);
    EXPECT_EQ(seconds[DELASSUS_PHASE_WAITING], 0.0);
    clock.move(DELASSUS_PHASE_EXCHANGE, DELASSUS_PHASE_WAITING, 0.05, false);
    EXPECT_DOUBLE_EQ(clock.seconds()[DELASSUS_PHASE_WAITING], 0.05);
    EXPECT_DOUBLE_EQ(clock.seconds()[DELASSUS_PHASE_EXCHANGE], seconds[DELASSUS_PHASE_EXCHANGE] - 0.05);
}

TEST(PhaseClock, SharesOfSomeIterationsStandForAll) {
    PhaseClock clock;
    clock.reset(4);
    const auto begin = PhaseClock::Clock::now();
    int timed = 0;
    for (int k = 0; k < 8; ++k) {
        clock.next_iteration();
        timed += clock.is_on() ? 1 : 0;
        const PhaseClock::Span span(clock, DELASSUS_PHASE_PROJECTIONS);
        std::this_thread::sleep_for(k == 5 ? 50ms : 5ms);  // the long one is not timed, but counts
    }
    clock.end_iterations();
    const double elapsed = std::chrono::duration<double>(PhaseClock::Clock::now() - begin).count();
    EXPECT_EQ(timed, 2);
    const double before = clock.seconds()[DELASSUS_PHASE_PROJECTIONS];
    EXPECT_GT(before, 0.010);  // what was timed
    EXPECT_LE(before, elapsed);
    clock.move(DELASSUS_PHASE_PROJECTIONS, DELASSUS_PHASE_WAITING, 0.001, true);
    const double after = clock.seconds()[DELASSUS_PHASE_PROJECTIONS], waiting = clock.seconds()[DELASSUS_PHASE_WAITING];
    EXPECT_GT(waiting, 0.001);  // that of the iterations which were not timed too
    EXPECT_NEAR(before, after + waiting, 1e-12);
    // One share for all, where none of the iterations stands for others.
    clock.reset(1);
    clock.next_iteration();
    clock.end_iterations();
    clock.move(DELASSUS_PHASE_PROJECTIONS, DELASSUS_PHASE_WAITING, 0.001, true);
    EXPECT_EQ(clock.seconds()[DELASSUS_PHASE_WAITING], 0.001);
}

TEST(Cost, GoesWhereTheHostHasFieldsForIt) {
    Cost cost;
    cost.seconds[DELASSUS_PHASE_PRODUCTS] = 1.5;
    cost.bytes_sent = 48;
    double seconds[2] = {NAN, NAN};
    delassus_outcome outcome{};
    outcome.struct_size = sizeof outcome;
    outcome.phase_seconds = seconds;
    outcome.phase_count = 1;  // an older host that knows one phase
    outcome.bytes_sent = -1;
    cost.write(outcome);
    EXPECT_EQ(seconds[0], 1.5);
    EXPECT_TRUE(std::isnan(seconds[1]));
    EXPECT_EQ(outcome.bytes_sent, 48);

    outcome.bytes_sent = -1;
    seconds[0] = NAN;
    outcome.struct_size = offsetof(delassus_outcome, phase_seconds);  // a host of 2.3
    cost.write(outcome);
    EXPECT_TRUE(std::isnan(seconds[0]));
    EXPECT_EQ(outcome.bytes_sent, -1);
    outcome.struct_size = sizeof outcome;
    outcome.phase_seconds = nullptr;  // nobody asks
    cost.write(outcome);
    EXPECT_EQ(outcome.bytes_sent, 48);
}

}  // namespace
}  // namespace delassus::sdk::cost_test
