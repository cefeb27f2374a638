// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/sdk/team.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <numeric>
#include <thread>

namespace delassus::sdk::team_test {
namespace {

TEST(Team, EveryMemberPassesEveryBarrier) {
    for (const int members : {1, 2, 4}) {
        Team team(members);
        std::vector<int> step(static_cast<std::size_t>(members), 0);
        for (int turn = 0; turn < 50; ++turn)
            team.run([&](int member) {
                for (int k = 0; k < 20; ++k) {
                    ++step[static_cast<std::size_t>(member)];
                    team.barrier();
                    for (const int other : step) EXPECT_EQ(other, 20 * turn + k + 1);
                    team.barrier();
                }
            });
    }
}

TEST(Team, SharesCoverEverythingOnce) {
    Team team(3);
    std::size_t next = 0;
    for (int member = 0; member < 3; ++member) {
        const auto [first, last] = team.share(10, member);
        EXPECT_EQ(first, next);
        next = last;
    }
    EXPECT_EQ(next, 10u);
}

TEST(Team, TheCallerSeesWhatMembersWrote) {
    Team team(3);
    std::vector<int> values(1000);
    for (int turn = 1; turn <= 20; ++turn) {
        team.run([&](int member) {
            const auto [first, last] = team.share(values.size(), member);
            for (std::size_t i = first; i < last; ++i) values[i] = turn;
        });
        EXPECT_EQ(std::accumulate(values.begin(), values.end(), 0), 1000 * turn);
    }
}

/// Waiting members look at a counter first and then sleep: a task must reach them there too.
TEST(Team, WakesMembersThatSleep) {
    Team team(2);
    int calls[2] = {0, 0};
    for (int turn = 0; turn < 3; ++turn) {
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        team.run([&](int member) { ++calls[member]; });
    }
    EXPECT_EQ(calls[0], 3);
    EXPECT_EQ(calls[1], 3);
    std::this_thread::sleep_for(std::chrono::milliseconds(30));  // the end reaches them as well
}

TEST(Team, EndsWithoutATask) {
    for (int k = 0; k < 20; ++k) const Team team(1 + k % 4);
}

TEST(Team, TwoTeamsWorkAtTheSameTime) {
    int sums[2] = {0, 0};
    std::vector<std::jthread> hosts;
    for (int& sum : sums)
        hosts.emplace_back([&sum] {
            Team team(2);
            int parts[2] = {0, 0};
            for (int turn = 0; turn < 100; ++turn) team.run([&](int member) { parts[member] += member + 1; });
            sum = parts[0] + parts[1];
        });
    hosts.clear();
    EXPECT_EQ(sums[0], 300);
    EXPECT_EQ(sums[1], 300);
}

}  // namespace
}  // namespace delassus::sdk::team_test
