// SPDX-License-Identifier: BSD-3-Clause
// The principle of `auto`: the work that each solver gets doubles from round to round.
//
// Members take turns in a fixed order. In round k = 0, 1, … member i may work 2ᵏ wᵢ, counted in its own iterations, and
// goes on from where it stopped. By the end of the round that is (2^(k+1) − 1) wᵢ in all, rounded down: a member of
// dear iterations, with wᵢ < 1, waits for its first turn. A member s that would solve the problem by itself with work B
// is through in the first round k in which (2^(k+1) − 1) w_s ≥ B. The round before was not enough: (2ᵏ − 1) w_s < B. By
// then all members together have worked at most (2^(k+1) − 1) W with W = Σ wᵢ (wᵢ in a common unit such as seconds),
// and so
//
//     work of auto ≤ (1 + 2 B / w_s) W.
//
// A forecast may end a turn early, but not twice in a row: what that withholds from a member is at most what it had
// before, a factor of 3 for a member whose every forecast is wrong. A forecast may also let a turn run to twice its
// length where it says that this solves the problem: a factor of 2 where every such forecast is wrong.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "delassus/export.hpp"

namespace delassus {

struct Member {
    double iterations = 1.0;  ///< of its first turn, > 0
    bool can_start = true;    ///< it can begin at an iterate
    bool local = false;       ///< it converges from near a solution: it begins at the best iterate of all members
};

/// What a member may do in its turn.
struct Turn {
    std::size_t member = 0;
    int round = 0;
    std::int64_t iterations = 0;
    double work = 0.0;                 ///< of all turns before this one; a member's first turn in full is 1
    bool may_pass = true;              ///< a forecast may end the turn early
    std::optional<std::size_t> start;  ///< the member at whose last iterate it begins; none: at the start of the solve
};

/// How a turn ended.
enum class TurnEnd {
    Done,       ///< the solve is over: solved, infeasible, or at a limit of the caller's
    Exhausted,  ///< all iterations were used
    Passed,     ///< a forecast ended it
    Ended,      ///< the solver ended by itself: more work changes nothing, but another start may
    Retired     ///< the member gets no turn again: it cannot take the problem, or has done all that it was there for
};

struct TurnResult {
    TurnEnd end;
    double error;                 ///< of the iterate that the member left; infinite or NaN if it is none
    std::int64_t iterations = 0;  ///< that the turn took
    bool hopes = false;           ///< a forecast says that the member gets there in its next turn
};

/// How the rounds ended.
enum class RoundsEnd {
    Done,
    /// No member bettered its own error, above rounding, by a tenth in three rounds in which none waited, or none had a
    /// turn.
    Stale,
};

/// Runs the rounds. take: runs a turn. A member that ended by itself begins next at the best iterate that another
/// member has left since, and waits until there is one; if it ends again without bettering that by a tenth, it is
/// retired, unless it is local.
DELASSUS_API RoundsEnd run_rounds(std::span<const Member> members, const std::function<TurnResult(const Turn&)>& take);

}  // namespace delassus
