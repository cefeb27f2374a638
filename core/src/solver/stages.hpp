// SPDX-License-Identifier: BSD-3-Clause
// Several solvers on one problem, one after another: each starts from the best that was reached before it.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "delassus/solver.hpp"

namespace delassus {

/// What one solver is to do before the next takes over.
struct Stage {
    std::string reason;      ///< why this solver, now: for the report
    double tolerance = 0.0;  ///< natural error that ends the stage; 0: the one that was asked for
    /// The stage aims at this share of the tolerance, and has done its work where it reaches the tolerance itself. In a
    /// simulation the next steps then start within the tolerance, if they change little.
    double sharper = 1.0;
    std::int64_t max_iterations = std::numeric_limits<std::int64_t>::max();
    /// The stage is given up when, at the measured decrease, it would not reach its tolerance within max_iterations
    /// (see DecreaseWatch).
    bool watched = false;
    /// Where the tolerance is a goal, an error that is within what is needed (SolveSettings) does not end the solve
    /// here.
    bool to_goal = false;
    /// Much work for little: not begun where the answer so far is usable (SolveSettings).
    bool patient = false;
    /// An attempt: where it does not solve the problem, the next stage starts as if it had not been.
    bool attempt = false;
    /// The law that the stage solves with, if it is not the problem's own. The result is judged under the problem's own
    /// law.
    std::optional<Law> law = {};
};

/// Forecasts by measurement whether an iteration will reach a tolerance in time. At iterations 16, 32, 64, … the
/// natural error e is taken; let ln e fall by r₁ and then by r₂ in the last two doublings. An algebraic rate e ~ k^(−p)
/// has r₂ = r₁, a linear one e ~ q^k has r₂ = 2 r₁; so the next doublings are taken to bring g r₂, g² r₂, … with g =
/// r₂/r₁ held between 1 and 2. A forecast is trusted when it fails twice in a row. Iterations, not seconds: the same on
/// every machine.
class DecreaseWatch {
public:
    DELASSUS_API DecreaseWatch(double tolerance, std::int64_t max_iterations);

    /// Whether this iteration is one to measure at.
    [[nodiscard]] bool due(std::int64_t iteration) const { return iteration >= next_; }
    /// Takes the error at an iteration that is due; true if the tolerance is out of reach.
    DELASSUS_API bool hopeless(std::int64_t iteration, double natural);

private:
    /// Whether the tolerance would be reached by max_iterations, from this error after falls of r₁ and r₂.
    [[nodiscard]] bool in_reach(std::int64_t iteration, double natural, double first, double second) const;

    double tolerance_;
    std::int64_t max_iterations_;
    std::int64_t next_ = 16;
    int measured_ = 0, failed_ = 0;
    double before_ = 0.0, last_ = 0.0;  // ln e
};

/// Runs stages on one problem and adds them up in its report.
class StageRunner {
public:
    /// solution: the start if settings.warm_start; the best so far at any time. All must outlive the runner.
    StageRunner(const PreparedProblem& problem, Solution& solution, const SolveSettings& settings, SolveReport& report);

    /// The problem that the stage's solver gets: the problem itself, or a copy under the other law, which is made once.
    [[nodiscard]] const PreparedProblem& problem_of(const Stage& stage);

    /// Runs one stage. True if nothing is left to do: solved, proven infeasible, cancelled, or a limit of the whole
    /// solve reached.
    bool run(Solver& solver, const Stage& stage);

    /// Whether the start is within the tolerance, with the velocities that go with its reactions where H gives them
    /// cheaply: then there is nothing to do. Call it before the first stage.
    bool solved_at_start();

    /// The errors of the solution by the meter of the problem; none if nothing was run and there was no start.
    [[nodiscard]] std::optional<Errors> error() { return started_ ? std::optional(measured_error()) : std::nullopt; }

    /// The stages in a sentence: "ipm (9 iterations, 3.1e-07), ssn (2 iterations, 4.0e-13)".
    [[nodiscard]] std::string sentence() const;

private:
    [[nodiscard]] SolveSettings settings_of(const Stage& stage, DecreaseWatch& watch, bool warm,
                                            const PreparedProblem& problem) const;
    void add(const StageReport& stage, const SolveReport& result);
    const Errors& measured_error();

    const PreparedProblem& problem_;
    std::optional<PreparedProblem> other_;  // problem_ under the other law
    Solution& best_;
    const SolveSettings& settings_;
    SolveReport& report_;
    // Of the best so far, where there is one; the second is the greater of the natural error and the balance.
    std::optional<Errors> error_;
    double worst_ = std::numeric_limits<double>::quiet_NaN();
    bool started_ = false;
    bool of_attempt_ = false;  ///< the best so far is what an attempt left: no start, and less than any other answer
};

}  // namespace delassus
