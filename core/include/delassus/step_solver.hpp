// SPDX-License-Identifier: BSD-3-Clause
// What stands between a timestepper and the solver plugins: it takes the problem of a step, leaves out what needs no
// solver, loads a plugin when it is first needed, and keeps count.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "delassus/config.hpp"
#include "delassus/export.hpp"
#include "delassus/needs.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"

namespace delassus {

/// Effort since the counters were reset.
struct SolverEffort {
    std::int64_t solves = 0;         ///< calls of solve()
    std::int64_t plugin_solves = 0;  ///< of these (and of their islands), those that went to a plugin
    std::int64_t iterations = 0;     ///< of the plugin
    double seconds = 0.0;            ///< set-up and solve
    double worst_natural = 0.0;      ///< largest natural error of a plugin solve
    std::string unsolved;            ///< the first message of a solve that did not end solved; empty if none
};

/// Problems without rows are solved here: x = H⁻¹ a, block by block where H is block-diagonal, else by a factorisation
/// that is kept while the values of H stay. What was prepared for a step is kept for the next: where the entries stand
/// in the same places and H is block-diagonal, a step allocates nothing here.
class StepSolver {
public:
    /// An empty config.name means `auto` by its rules for simulations (docs/solvers/auto.md).
    /// The registry must outlive the solver.
    DELASSUS_API StepSolver(const Registry& registry, SolverConfig config);
    DELASSUS_API ~StepSolver();
    StepSolver(const StepSolver&) = delete;
    StepSolver& operator=(const StepSolver&) = delete;

    /// Has every problem solved whole, with H factorised as a sparse matrix, problems without rows too, and with `auto`
    /// by a solver that takes cones of every kind: what leaving out saves can be measured against that. Call it before
    /// the first solve.
    DELASSUS_API void leave_nothing_out();

    /// Solves the problem of a step. solution: the start if warm_start, then the result. Throws Unsupported if the
    /// configured solver cannot take the problem, InputError if the problem is not valid. A solve that does not reach
    /// its tolerance is counted in effort() and in the answer; the best iterate is in solution.
    DELASSUS_API bool solve(const Problem& problem, Solution& solution, bool warm_start);
    /// The same without a copy. What is left in the problem are arrays of an earlier step, to build the next one in.
    DELASSUS_API bool solve(Problem&& problem, Solution& solution, bool warm_start);

    [[nodiscard]] DELASSUS_API const SolverEffort& effort() const;
    DELASSUS_API void reset_effort();

    /// Called with every problem before it is solved, e.g. to dump it. May be empty.
    std::function<void(const Problem&)> on_problem;

    /// A part of a problem that is solved apart from the rest.
    struct Part {
        std::int32_t n = 0, m = 0;
        Structure structure = Structure::Diagonal;  ///< of H
        std::uint64_t needs = 0;                    ///< DELASSUS_CAN_* bits
    };
    /// The parts that solve() would make of the problem, in its order; nothing is loaded and nothing solved. Parts
    /// with m = 0 go to no plugin, unless nothing is left out.
    [[nodiscard]] DELASSUS_API std::vector<Part> parts(const Problem& problem) const;
    /// The name of the plugin that takes problems with these needs: the configured one, whatever it can, or the one
    /// that `auto` starts with; empty if there is none.
    [[nodiscard]] DELASSUS_API std::string choice(std::uint64_t needs) const;

    /// The names of the plugins loaded so far.
    [[nodiscard]] DELASSUS_API std::vector<std::string> loaded() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace delassus
