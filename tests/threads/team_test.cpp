// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/thread_team.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <numeric>
#include <thread>
#include <vector>

namespace delassus::team_test {
namespace {

using sdk::Team;

/// More than there are processors: such a team never leaves a task to the calling thread alone.
const int many = usable_processors() + 1;

TEST(Team, EveryMemberPassesEveryBarrier) {
    for (const int members : {1, many, many + 2}) {
        ThreadTeam threads(members);
        const Team team = threads.team();
        std::vector<int> step(static_cast<std::size_t>(members), 0);
        for (int turn = 0; turn < 10; ++turn)
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
    ThreadTeam threads(3);
    const Team team = threads.team();
    std::size_t next = 0;
    for (int member = 0; member < 3; ++member) {
        const auto [first, last] = team.share(10, member);
        EXPECT_EQ(first, next);
        next = last;
    }
    EXPECT_EQ(next, 10u);
}

TEST(Team, TheCallerSeesWhatMembersWrote) {
    ThreadTeam threads(3);
    const Team team = threads.team();
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
    ThreadTeam threads(many);
    const Team team = threads.team();
    std::vector<int> calls(static_cast<std::size_t>(many), 0);
    for (int turn = 0; turn < 3; ++turn) {
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        team.run([&](int member) { ++calls[static_cast<std::size_t>(member)]; });
    }
    for (const int count : calls) EXPECT_EQ(count, 3);
    std::this_thread::sleep_for(std::chrono::milliseconds(30));  // the end reaches them as well
}

TEST(Team, EndsWithoutATask) {
    for (int k = 0; k < 20; ++k) {
        const ThreadTeam threads(1 + k % 4);
        EXPECT_EQ(threads.team().size(), 1 + k % 4);
    }
}

TEST(Team, DealsOutEachItemOnce) {
    ThreadTeam threads(3);
    std::vector<int> done(500, 0);
    threads.team().for_each(done.size(), [&](std::size_t k) { ++done[k]; });
    EXPECT_EQ(std::count(done.begin(), done.end(), 1), 500);
}

TEST(Team, ThrowsTheExceptionOfTheFirstItemThatFails) {
    ThreadTeam threads(3);
    for (int turn = 0; turn < 10; ++turn) {
        try {
            threads.team().for_each(40, [&](std::size_t k) {
                if (k % 2 == 1) throw static_cast<int>(k);
            });
            FAIL();
        } catch (int item) {
            EXPECT_EQ(item, 1);
        }
        int calls = 0;
        threads.team().for_each(1, [&](std::size_t) { ++calls; });
        EXPECT_EQ(calls, 1);
    }
}

TEST(Team, IsNoLargerThanThereAreProcessors) {
    EXPECT_EQ(ThreadTeam::for_threads(1)->team().size(), 1);
    EXPECT_EQ(ThreadTeam::for_threads({})->team().size(), usable_processors());
    EXPECT_EQ(ThreadTeam::for_threads(100000)->team().size(), usable_processors());
}

/// Members that have nothing to do use no processor.
TEST(Team, SleepsBetweenTasks) {
    ThreadTeam threads(2);
    threads.team().run([](int) {});
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::clock_t before = std::clock();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_LT(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC, 0.03);
}

#if !defined(__SANITIZE_THREAD__)  // which takes a fork of several threads for the end
TEST(Team, WorksInTheChildOfAFork) {
    ThreadTeam threads(many);
    std::vector<int> sums(static_cast<std::size_t>(many), 0);
    const auto add = [&](int member) { ++sums[static_cast<std::size_t>(member)]; };
    threads.team().run(add);
    const pid_t child = fork();
    if (child == 0) {
        threads.team().run(add);
        _exit(sums.front() == 2 && sums.back() == 2 ? 0 : 1);
    }
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    threads.team().run(add);
    EXPECT_EQ(sums.back(), 2);
}
#endif

TEST(Team, TwoTeamsWorkAtTheSameTime) {
    int sums[2] = {0, 0};
    std::vector<std::jthread> hosts;
    for (int& sum : sums)
        hosts.emplace_back([&sum] {
            ThreadTeam threads(many);
            const Team team = threads.team();
            std::vector<int> parts(static_cast<std::size_t>(many), 0);
            for (int turn = 0; turn < 100; ++turn)
                team.run([&](int member) { ++parts[static_cast<std::size_t>(member)]; });
            sum = std::accumulate(parts.begin(), parts.end(), 0);
        });
    hosts.clear();
    EXPECT_EQ(sums[0], 100 * many);
    EXPECT_EQ(sums[1], 100 * many);
}

/// Whatever the size is from task to task, shares cover everything.
TEST(Team, WorksAloneWhereOthersNeedTheProcessors) {
    std::atomic<bool> stop = false;
    std::vector<std::jthread> others;
    for (int k = 0; k < 2 * usable_processors(); ++k)
        others.emplace_back([&] {
            while (!stop) std::this_thread::yield();
        });
    ThreadTeam threads(2);
    std::vector<int> values(100, 0);
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(300);
    int turns = 0;
    for (; std::chrono::steady_clock::now() < end; ++turns) {
        const Team team = threads.team();
        team.run([&](int member) {
            const auto [first, last] = team.share(values.size(), member);
            for (std::size_t i = first; i < last; ++i) ++values[i];
        });
    }
    stop = true;
    EXPECT_EQ(values, std::vector<int>(100, turns));
}

}  // namespace
}  // namespace delassus::team_test
