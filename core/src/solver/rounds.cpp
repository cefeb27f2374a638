// SPDX-License-Identifier: BSD-3-Clause
#include "solver/rounds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace delassus {

namespace {

constexpr double no_iterate = std::numeric_limits<double>::infinity();

/// What the rounds know of a member.
struct Record {
    TurnEnd last = TurnEnd::Exhausted;
    double error = no_iterate;   // of its last iterate
    double lowest = no_iterate;  // of all its iterates
    std::int64_t turn = 0;       // the number of its last turn; 0: it had none
};

/// Of round k, at most 2⁶²: (2ᵏ − 1) w are before it, rounded down.
std::int64_t iterations_of(int round, double first) {
    const auto before = [first](int k) { return std::floor((std::exp2(k) - 1.0) * first); };
    return static_cast<std::int64_t>(std::min(before(round + 1) - before(round), 0x1p62));
}

/// The member with the best iterate among those that others have left after this turn; none if no one has.
std::optional<std::size_t> best_after(const std::vector<Record>& records, std::int64_t turn, std::size_t but) {
    std::optional<std::size_t> best;
    for (std::size_t k = 0; k < records.size(); ++k)
        if (k != but && records[k].turn > turn && records[k].error < (best ? records[*best].error : no_iterate))
            best = k;
    return best;
}

}  // namespace

RoundsEnd run_rounds(std::span<const Member> members, const std::function<TurnResult(const Turn&)>& take) {
    constexpr int patience = 3;
    constexpr double better = 0.9;
    constexpr double rounding = 1e-14;  // errors are relative: one below it changes by chance
    std::vector<Record> records(members.size());
    std::int64_t turns = 0;
    double work = 0.0;
    for (int round = 0, stale = 0; stale < patience; ++round) {
        bool worked = false, bettered = false, waits = false;
        for (std::size_t k = 0; k < members.size(); ++k) {
            Record& own = records[k];
            if (own.last == TurnEnd::Retired) continue;
            const double first = members[k].iterations;
            Turn turn{.member = k,
                      .round = round,
                      .iterations = iterations_of(round, first),
                      .work = work,
                      .may_pass = own.last != TurnEnd::Passed,
                      .start = {}};
            if (turn.iterations < 1) {
                waits = true;
                continue;
            }
            if (own.last == TurnEnd::Ended) {
                turn.start = best_after(records, own.turn, k);
                if (!turn.start || !members[k].can_start) continue;
            } else if (members[k].local) {
                turn.start = best_after(records, 0, members.size());
            } else if (own.turn > 0) {
                turn.start = k;
            }
            const bool again = own.last == TurnEnd::Ended;
            const double begun = turn.start ? records[*turn.start].error : no_iterate;
            const TurnResult result = take(turn);
            if (result.end == TurnEnd::Done) return RoundsEnd::Done;
            worked = true;
            work += static_cast<double>(result.iterations) / first;
            const bool in_vain = again && result.end == TurnEnd::Ended && !(result.error < better * begun);
            own.last = in_vain && !members[k].local ? TurnEnd::Retired : result.end;
            own.error = result.error;
            own.turn = ++turns;
            if (own.error < better * own.lowest) {
                bettered = bettered || own.lowest > rounding;
                own.lowest = own.error;
            }
        }
        if (waits) continue;
        if (!worked) break;
        stale = bettered ? 0 : stale + 1;
    }
    return RoundsEnd::Stale;
}

}  // namespace delassus
