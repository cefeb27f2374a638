// SPDX-License-Identifier: BSD-3-Clause
// The principle of `auto`, on members whose work is counted: whatever one of them solves is solved, within the bound of
// solver/rounds.hpp.
#include "solver/rounds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

namespace delassus::tests::rounds_test {
namespace {

/// A member that solves the problem after `needed` iterations, each of which costs `cost`.
struct Counted {
    double first = 1.0;  ///< iterations of its first turn
    double cost = 1.0;
    std::int64_t needed = std::numeric_limits<std::int64_t>::max();
    std::int64_t done = 0;
    bool always_passes = false;  ///< its forecasts say that it gets nowhere
    bool passed = false;         ///< its last turn
};

struct Result {
    RoundsEnd end;
    double work;
};

/// rounds_that_better: as many rounds lower each member's error by half.
Result run(std::vector<Counted>& counted, int rounds_that_better = 1000) {
    std::vector<Member> members;
    for (const Counted& one : counted) members.push_back({.iterations = one.first});
    double work = 0.0;
    const RoundsEnd end = run_rounds(members, [&](const Turn& turn) -> TurnResult {
        const double error = std::exp2(-std::min(turn.round, rounds_that_better - 1));
        Counted& member = counted[turn.member];
        EXPECT_EQ(turn.start, member.done == 0 && !member.passed ? std::nullopt : std::optional(turn.member));
        member.passed = member.always_passes && turn.may_pass;
        if (member.passed) return {TurnEnd::Passed, error};
        const std::int64_t most = std::min(turn.iterations, member.needed - member.done);
        member.done += most;
        work += static_cast<double>(most) * member.cost;
        return {member.done >= member.needed ? TurnEnd::Done : TurnEnd::Exhausted, error};
    });
    return {end, work};
}

TEST(Rounds, WorkIsBoundedByTheBestMember) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> exponent(0.0, 5.0);
    for (int trial = 0; trial < 2000; ++trial) {
        const bool pass = trial % 2 == 1;
        std::vector<Counted> members(1 + random() % 6);
        double unit = 0.0;
        for (Counted& member : members) {
            member.first = std::pow(10.0, exponent(random) - 2.0);
            member.cost = std::pow(10.0, exponent(random) - 2.0);
            if (random() % 2 == 0) member.needed = static_cast<std::int64_t>(std::pow(10.0, exponent(random))) + 1;
            member.always_passes = pass && random() % 3 == 0;
            unit += member.first * member.cost;
        }
        members[random() % members.size()].needed = 1 + static_cast<std::int64_t>(random() % 10000);
        double bound = std::numeric_limits<double>::infinity();
        for (const Counted& member : members) {
            if (member.needed == std::numeric_limits<std::int64_t>::max()) continue;
            const double own = static_cast<double>(member.needed) / member.first;
            bound = std::min(bound, unit * (1.0 + 2.0 * own) * (member.always_passes ? 3.0 : 1.0));
        }
        const Result result = run(members);
        EXPECT_EQ(result.end, RoundsEnd::Done);
        EXPECT_LE(result.work, bound * (1.0 + 1e-12)) << "trial " << trial;
    }
}

TEST(Rounds, EndWhereNobodyBettersTheError) {
    std::vector<Counted> members(2);
    EXPECT_EQ(run(members, 2).end, RoundsEnd::Stale);
    // Two rounds that better it, and three that do not: 1 + 2 + 4 + 8 + 16 iterations each.
    EXPECT_EQ(members[0].done, 31);
    EXPECT_EQ(members[1].done, 31);
}

// Who ended by itself begins next at what somebody else has reached since, be it worse, and waits where nobody has.
TEST(Rounds, WhoEndedBeginsWhereAnotherStopped) {
    struct Begun {
        std::size_t member;
        int round;
        std::optional<std::size_t> start;
        bool operator==(const Begun&) const = default;
    };
    std::vector<Begun> begun;
    const std::vector<Member> members = {{}, {.can_start = false}, {.local = true}, {}};
    const RoundsEnd end = run_rounds(members, [&](const Turn& turn) -> TurnResult {
        begun.push_back({turn.member, turn.round, turn.start});
        if (turn.round == 3) return {TurnEnd::Done, 1.0};
        switch (turn.member) {
            case 0:
                return {turn.round == 0 ? TurnEnd::Exhausted : TurnEnd::Ended, turn.round == 2 ? 0.001 : 0.5};
            case 1:
                return {TurnEnd::Ended, 0.1};
            case 2:
                return {turn.round == 0 ? TurnEnd::Exhausted : TurnEnd::Ended, 0.01};
            default:
                return {TurnEnd::Retired, 1.0};
        }
    });
    EXPECT_EQ(end, RoundsEnd::Done);
    const std::vector<Begun> expected = {
        {0, 0, {}}, {1, 0, {}}, {2, 0, 1}, {3, 0, {}},  // the local one begins at the best iterate
        {0, 1, 0},  {2, 1, 2},                          // each from its own; the second ended and cannot begin anywhere
        {0, 2, 2},  {2, 2, 0},                          // both ended: from each other's
        {0, 3, 2}};
    EXPECT_EQ(begun.size(), expected.size());
    for (std::size_t k = 0; k < std::min(begun.size(), expected.size()); ++k)
        EXPECT_EQ(begun[k], expected[k]) << "turn " << k << ": member " << begun[k].member << ", round "
                                         << begun[k].round;
}

// A member that does not profit from the starts of others would do the same again in every round.
TEST(Rounds, WhoEndsAgainNoNearerIsRetired) {
    std::vector<int> turns(3);
    const std::vector<Member> members = {{}, {}, {.local = true}};
    const RoundsEnd end = run_rounds(members, [&](const Turn& turn) -> TurnResult {
        ++turns[turn.member];
        const double error = std::exp2(-turn.round);
        if (turn.member == 0) return {turn.round == 5 ? TurnEnd::Done : TurnEnd::Exhausted, error};
        return {TurnEnd::Ended, error};
    });
    EXPECT_EQ(end, RoundsEnd::Done);
    EXPECT_EQ(turns, (std::vector<int>{6, 2, 5})) << "one round alone, one from another's iterate; the local one on";
}

TEST(Rounds, EndWhereNobodyHasATurn) {
    int turns = 0;
    const RoundsEnd end = run_rounds(std::vector<Member>(1), [&](const Turn&) -> TurnResult {
        ++turns;
        return {TurnEnd::Ended, 1.0};
    });
    EXPECT_EQ(end, RoundsEnd::Stale);
    EXPECT_EQ(turns, 1) << "nobody has left a start since";
}

// Below rounding an error falls by chance, and may do so for ever.
TEST(Rounds, ABettermentBelowRoundingIsNone) {
    int rounds = 0;
    double error = 1e-13;
    const std::vector<Member> members = {{.iterations = 3}};
    const auto end = run_rounds(members, [&](const Turn& turn) -> TurnResult {
        rounds = turn.round + 1;
        error *= 0.5;
        return {turn.round == 100 ? TurnEnd::Done : TurnEnd::Exhausted, error};
    });
    EXPECT_EQ(end, RoundsEnd::Stale);
    EXPECT_EQ(rounds, 4 + 3);  // the fourth goes below 1e-14
}

TEST(Rounds, TheWorkOfARoundDoesNotOverflow) {
    std::int64_t last = 0;
    double error = 1e100;
    const std::vector<Member> members = {{.iterations = 3}};
    static_cast<void>(run_rounds(members, [&](const Turn& turn) -> TurnResult {
        EXPECT_GE(turn.iterations, last);
        last = turn.iterations;
        error *= 0.5;
        return {turn.round == 200 ? TurnEnd::Done : TurnEnd::Exhausted, error};
    }));
    EXPECT_EQ(last, std::int64_t{1} << 62);
}

}  // namespace
}  // namespace delassus::tests::rounds_test
