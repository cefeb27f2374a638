// SPDX-License-Identifier: BSD-3-Clause
// Solving a problem with a plugin, from the host's side.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/errors.hpp"
#include "delassus/export.hpp"
#include "delassus/needs.hpp"
#include "delassus/registry.hpp"
#include "delassus/thread_team.hpp"

namespace delassus {

/// How a solve ended, as judged by the host.
enum class Status {
    Solved,  ///< the solver said so, and the measured errors agree
    IterationLimit,
    TimeLimit,
    Stalled,
    Infeasible,
    NumericalFailure,
    Cancelled,
    Error,
    FalseClaim  ///< the solver claimed convergence; the measured error is above the tolerance
};

[[nodiscard]] DELASSUS_API std::string_view name_of(Status status);

/// A point of an error-against-time curve.
struct CurveSample {
    std::int64_t iteration = 0;
    double seconds = 0.0;  ///< of the solver's own time, setup included, measuring excluded
    double natural = 0.0;
};

/// Where a problem comes from. `auto` has orders of solvers for each.
enum class Origin {
    Alone,  ///< nothing is known of it
    Step    ///< a step of a simulation, close to the one before
};

/// The settings of one solve.
struct SolveSettings {
    double tolerance = 1e-8;  ///< natural error, > 0
    /// Above 0, the tolerance is a goal: what `auto` accepts grows with the work that it has spent, up to this natural
    /// error (SolveReport::near_goal; acceptable_error() in solver/acceptance.hpp).
    double loosest = 0.0;
    std::int64_t max_iterations = 1000000;
    /// Do all these iterations, whatever error they leave; the tolerance says nothing then.
    bool fixed_iterations = false;
    double time_limit = std::numeric_limits<double>::infinity();  ///< seconds of the solver's own time
    bool warm_start = false;                                      ///< start from the Solution given
    /// The last call of this solver was for the same problem and left this solution: where it stopped at a limit, it
    /// goes on as if it had not, if it can (DELASSUS_FLAG_RESUMES); else the solution is a start like any other.
    bool resume = false;
    Origin origin = Origin::Alone;
    /// Of a step: whether bodies with these velocities, an answer with this natural error, all stand still. Empty: they
    /// move. Called by the thread that solves.
    std::function<bool(std::span<const double> x, double natural)> stands_still;
    /// Threads that the solver may share its work among; the answer is the same to the bit without them. May be null.
    std::shared_ptr<ThreadTeam> team;

    /// Measure the natural error along the way and keep the curve in the report. Samples are spaced by 2 % in time.
    bool record_curve = false;
    /// Called now and then (at most ten times a second), with the latest sample if the curve is recorded; iteration and
    /// seconds always. May be empty.
    std::function<void(const CurveSample&)> on_progress;
    /// Called for each sample of the curve as it is taken. May be empty.
    std::function<void(const CurveSample&)> on_sample;
    /// Asked at every progress call; true cancels the solve. May be empty.
    std::function<bool()> cancelled;
    /// Called with every iterate that the solver shows, on the solver's clock; true ends the solve as stalled. x may be
    /// null. May be empty. Where the problem is in parts: on all processes, with the same answer.
    std::function<bool(std::int64_t iteration, const double* x, const double* lambda)> give_up;

    /// What a solver is told: of a fixed number of iterations, a tolerance that it cannot reach.
    [[nodiscard]] double told_tolerance() const {
        return fixed_iterations ? std::numeric_limits<double>::min() : tolerance;
    }
};

/// One solver of several that worked on a problem one after another.
struct StageReport {
    std::string solver;
    OptionTexts options;  ///< those that were chosen
    Law law = Law::Associated;
    std::string reason;  ///< why this solver, now
    double tolerance = 0.0;
    Status status = Status::Error;
    std::string message;
    std::int64_t iterations = 0;
    double seconds = 0.0;  ///< setup and solve
    double natural = 0.0;  ///< reached, under the problem's own law
};

/// What a solve of a problem in parts cost one process.
struct SolveCost {
    double setup = 0.0, solve = 0.0;  ///< s, by the core's clock: analysis and factorisation; solving
    /// s, by delassus_phase, as the solver says; NaN where it does not. What of `solve` is in none of them is its own
    /// work on vectors, or unknown.
    std::array<double, DELASSUS_PHASE_COUNT> phases = {NAN, NAN, NAN, NAN, NAN, NAN};
    std::int64_t bytes_sent = -1;  ///< by the solver to other processes while it solved; −1 where it does not say
};

/// The phase's name in reports: "products".
[[nodiscard]] DELASSUS_API std::string_view name_of(delassus_phase phase);

/// What happened. Every number in `error` was computed by the core. Where the problem is in parts, all but `cost` is
/// the same on all processes, and seconds are those of the slowest.
struct SolveReport {
    std::string problem, solver, version;
    OptionTexts options;  ///< those that were chosen
    Law law = Law::Associated;
    double tolerance = 0.0;
    Status status = Status::Error;
    std::string message;  ///< what a person should know; may be empty
    std::int64_t iterations = 0;
    double seconds_setup = 0.0;  ///< analyze and factorize
    double seconds_solve = 0.0;
    std::int64_t analyses = 0, factorizations = 0;  ///< by the solver's own count, since it was made
    double claimed_residual = std::numeric_limits<double>::quiet_NaN();
    Errors error;
    std::vector<CurveSample> curve;
    std::vector<StageReport> stages;  ///< empty if one solver did it all
    /// Not solved, but acceptable after the work that was spent, where the tolerance is a goal.
    bool near_goal = false;
    SolveCost cost;  ///< where the problem is in parts
};

/// The report as JSON text, with the fields' names as a user of --json sees them (docs/report.md).
[[nodiscard]] DELASSUS_API std::string to_json(const SolveReport& report);

/// A solver made from a plugin, or from several in stages, for its whole life: it keeps its analysis and factorisation
/// from one solve to the next and renews what the problem's identity says has changed. Used by one thread at a time.
///
/// Of a problem in parts, solve() and refusal() are collective: all processes call them with the same settings, but for
/// the callbacks, which may be there on some alone. What they throw they throw on all. A plugin that fails on one
/// process alone leaves the others waiting for it: the run of all then ends within seconds, with a sentence of that
/// process, by Communicator::abort(3).
class Solver {
public:
    class Implementation;

    /// Throws InputError on a bad option, PluginError if the plugin cannot make a solver. With a registry, refusals
    /// name the solvers that could; it must outlive the solver.
    DELASSUS_API explicit Solver(std::shared_ptr<const Plugin> plugin, OptionTexts options = {},
                                 const Registry* registry = nullptr);
    explicit Solver(std::unique_ptr<Implementation> implementation);
    DELASSUS_API ~Solver();
    DELASSUS_API Solver(Solver&&) noexcept;
    DELASSUS_API Solver& operator=(Solver&&) noexcept;

    [[nodiscard]] DELASSUS_API const PluginInfo& info() const;

    /// Empty if the solver can take the problem with these settings; else the sentence of the refusal.
    [[nodiscard]] DELASSUS_API std::string refusal(const Prepared& problem, const SolveSettings& settings) const;

    /// Solves. solution (own entries) is the starting point if settings.warm_start, and holds the result: always of the
    /// right size and finite. Throws Unsupported with the refusal, or InputError on a bad setting. Everything else is a
    /// status.
    DELASSUS_API SolveReport solve(const Prepared& problem, Solution& solution, const SolveSettings& settings);

private:
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
