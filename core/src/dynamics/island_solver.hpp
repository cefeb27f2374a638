// SPDX-License-Identifier: BSD-3-Clause
// How a step solves one island: a part of its problem that has nothing to do with the rest, or all of a problem that
// several processes share.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "delassus/prepared.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"
#include "delassus/step_solver.hpp"

namespace delassus {

/// What the solve of an island is asked for. Where processes share it, all ask for the same.
struct IslandRequest {
    /// The configuration's, with origin, callbacks and threads. Tolerances follow from the error of the method where it
    /// is known.
    const SolveSettings& settings;
    bool warm_start = false;  ///< the solution holds a start
    bool leaves_out = true;   ///< answers that need no solver may be given without one
    /// The error that the method itself makes in the own velocities, n; none: it is not known.
    std::optional<std::span<const double>> method_error = {};
    double error_of_solves = 0.0;  ///< of that, at most, what earlier solves left, in the norm of the masses
    bool corrects = false;         ///< StepRequest::corrects
    double share = 1.0;            ///< of the tolerance that follows from it, ≤ 1 (StepSolver::solve_to())
    /// The island may be several, which other ways of solving see each apart.
    bool gathered = false;
};

/// What it came to.
struct IslandResult {
    bool solved = true;
    double natural = 0.0;    ///< left in the solution
    double in_masses = 0.0;  ///< the same times Prepared::reference()
    SolverEffort effort;
};

/// Keeps its solvers from one problem to the next. Used by one thread at a time.
class IslandSolver {
public:
    /// config: with a name. Both must outlive this. Throws as make_solver().
    IslandSolver(const Registry& registry, const SolverConfig& config);

    /// Solves a problem that has rows. Adds to the result. Throws Unsupported if the configured solver cannot take it
    /// (IndefiniteStep where H is indefinite beside cones), StepInterrupted. A solve by a configured solver that misses
    /// its tolerance is repeated by `auto`. Collective where processes share the problem.
    void solve(const Prepared& problem, Solution& solution, const IslandRequest& request, IslandResult& result);

    /// The names of the plugins that have worked.
    [[nodiscard]] const std::set<std::string>& loaded() const { return loaded_; }

private:
    SolveReport run(Solver& solver, const Prepared& problem, Solution& solution, const SolveSettings& settings,
                    SolverEffort& spent);
    /// Solves with `auto` what the configured solver left at `report`, from the start `before_`; the better answer is
    /// in solution, what it is worth in report.
    void run_again(const Prepared& problem, SolveSettings settings, Solution& solution, SolveReport& report,
                   SolverEffort& spent);

    const Registry& registry_;
    const SolverConfig& config_;
    Solver solver_;
    std::optional<Solver> fallback_;  // `auto`, where the configured solver is another
    Solution before_;                 // the start
    std::set<std::string> loaded_;
};

}  // namespace delassus
