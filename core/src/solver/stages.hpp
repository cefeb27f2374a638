// SPDX-License-Identifier: BSD-3-Clause
// Several solvers on one problem, one after another: each starts from the best that was reached before it.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "delassus/solver.hpp"
#include "solver/rounds.hpp"

namespace delassus {

/// What one solver is to do before the next takes over.
struct Stage {
    std::string reason;      ///< why this solver, now: for the report
    double tolerance = 0.0;  ///< natural error that ends the stage; 0: the one that was asked for
    /// The stage aims at this fraction of the tolerance, and has done its work where it reaches the tolerance itself.
    double tighter = 1.0;
    /// Iterations; the forecast may allow twice as many (Forecast). 0: as many as the solve has left, unwatched.
    std::int64_t iterations = 0;
    bool may_pass = false;  ///< the forecast may end the stage early
    /// The law that the stage solves with, if it is not the problem's own. The result is judged under the problem's
    /// own.
    std::optional<Law> law = {};
    bool resume = false;  ///< SolveSettings::resume
};

/// Forecasts by measurement whether an iteration will reach a tolerance in twice the iterations of its turn, K. At …,
/// K/4, K/2, K (from 32 on, K/4 from 16 on) the natural error e is taken; let ln e fall by r₁ and then by r₂ in the
/// last two doublings. An algebraic rate e ~ k^(−p) has r₂ = r₁, a linear one e ~ q^k has r₂ = 2 r₁; so the next
/// doublings are taken to bring g r₂, g² r₂, … with g = r₂/r₁ held between 1 and 2. Where that fails twice in a row
/// before K, the turn is not worth its work; where it succeeds at K, the turn may go on to 2 K. Iterations, not
/// seconds: the same on every machine.
class Forecast {
public:
    DELASSUS_API Forecast(double tolerance, std::int64_t iterations);

    enum class Verdict {
        GoOn,
        Pass,      ///< before the end of the turn: it is out of reach
        Exhausted  ///< the turn is over, and twice its iterations would not do
    };

    /// Whether this iteration is one to measure at.
    [[nodiscard]] bool due(std::int64_t iteration) const { return iteration >= next_; }
    /// Takes the error at an iteration that is due.
    DELASSUS_API Verdict judge(std::int64_t iteration, double natural);
    /// At the end of a turn: whether the next one would do, which has twice the iterations and may go on to 4 K.
    [[nodiscard]] bool hopes() const { return hopes_; }

private:
    /// Whether the tolerance would be reached in so many turns, from this error after falls of r₁ and r₂.
    [[nodiscard]] bool in_reach(double turns, std::int64_t iteration, double natural, double first,
                                double second) const;

    double tolerance_;
    std::int64_t iterations_, next_;
    int measured_ = 0, failed_ = 0;
    bool hopes_ = false;
    double before_ = 0.0, last_ = 0.0;  // ln e
};

/// Runs stages on one problem and adds them up in its report.
class StageRunner {
public:
    /// solution: the start if settings.warm_start; the best so far at any time. All must outlive the runner.
    StageRunner(const Prepared& problem, Solution& solution, const SolveSettings& settings, SolveReport& report);

    /// The problem that a stage with this law solves: the problem itself, or a copy under the other law, made once;
    /// null where there is no copy (Prepared::under).
    [[nodiscard]] const Prepared* problem_of(std::optional<Law> law);

    /// Runs one stage, whose law has a problem, from the iterate, if it is a start and the solver can begin there, and
    /// leaves there what the stage came to.
    TurnResult run(Solver& solver, const Stage& stage, Solution& iterate, bool is_start);
    /// The same from the best so far.
    TurnResult run(Solver& solver, const Stage& stage);

    /// Whether the start is within the tolerance, with the velocities that go with its reactions where H gives them
    /// cheaply: then there is nothing to do. Call it before the first stage.
    bool solved_at_start();

    /// The errors of the solution by the meter of the problem; none if nothing was run and there was no start.
    [[nodiscard]] std::optional<Errors> error() { return started_ ? std::optional(measured_error()) : std::nullopt; }
    /// The greater of the natural error and the balance of the best so far; infinite where there is none.
    [[nodiscard]] double worst();

    /// The stages in a sentence: "ipm (9 iterations, 3.1e-07), ssn (2 iterations, 4.0e-13)".
    [[nodiscard]] std::string sentence() const;

private:
    [[nodiscard]] SolveSettings settings_of(const Stage& stage, const Prepared& problem, bool warm, Forecast& forecast,
                                            Forecast::Verdict& verdict) const;
    /// How the stage ended, whose iterate has this error.
    [[nodiscard]] TurnEnd end_of(Status status, Forecast::Verdict verdict, bool other_law, bool solved, double error);
    void add(const StageReport& stage, const SolveReport& result);
    const Errors& measured_error();

    const Prepared& problem_;
    std::unique_ptr<Prepared> other_;  // problem_ under the other law
    Solution& best_;
    const SolveSettings& settings_;
    SolveReport& report_;
    // Of the best so far, where there is one; the second is the greater of the natural error and the balance.
    std::optional<Errors> error_;
    double worst_ = std::numeric_limits<double>::quiet_NaN();
    bool started_ = false;
};

}  // namespace delassus
