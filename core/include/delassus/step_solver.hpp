// SPDX-License-Identifier: BSD-3-Clause
// What stands between a timestepper and the solver plugins: it takes the problem of a step, leaves out what needs no
// solver, loads a plugin when it is first needed, and keeps count.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "delassus/needs.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"
#include "delassus/thread_team.hpp"

namespace delassus {

class SharedSteps;

/// Effort since the counters were reset.
struct SolverEffort {
    std::int64_t solves = 0;         ///< calls of solve()
    std::int64_t plugin_solves = 0;  ///< of these (and of their islands), those that went to a plugin
    std::int64_t resting_parts = 0;  ///< parts with rows that were left out because they stand still
    std::int64_t iterations = 0;     ///< of the plugin
    double seconds = 0.0;            ///< set-up and solve
    std::int64_t repeated = 0;       ///< solves that `auto` repeated, since the configured solver missed its tolerance
    std::int64_t failed = 0;         ///< of these, those in which the configured solver failed or made a false claim
    std::string failure;             ///< its sentence in the first of them
    /// Solves that ended above the tolerance that their step is worth, but within what a stage of `auto` allows.
    std::int64_t near_goal = 0;
    double worst_natural = 0.0;  ///< largest natural error of an answer that was used
    double worst_miss = 0.0;     ///< largest factor by which an answer missed its tolerance; 0: none did
    std::string unsolved;        ///< the first message of a solve that did not end solved; empty if none
};

/// What a step asks of the solve of its problem.
struct StepRequest {
    bool warm_start = false;  ///< the solution holds a start
    /// The error that the method itself makes in the velocities of this step, n, or empty where it is not known. Where
    /// the configuration gives no tolerance, each part of the problem is solved to a share of it; where it gives one to
    /// `auto`, to the smaller of the two (docs/tolerance.md).
    std::span<const double> method_error = {};
    /// The problem corrects what other solves or the method left of gaps and constraints, and method_error is empty: a
    /// small share of that may stay (docs/tolerance.md).
    bool corrects = false;
    /// What earlier solves left in method_error, n, for each velocity in the norm of the masses of its island; it is
    /// not taken for the method's own.
    std::span<const double> error_of_solves = {};
    /// DynamicalSystem::bodies_of_columns(), n, where the unknowns are the velocities at the end of the step: those of
    /// bodies that stand still, but for what the solver left, become 0. Empty: they stay as they are.
    std::span<const std::int32_t> bodies = {};
};

/// What came of it. The spans are valid until the next solve.
struct StepAnswer {
    bool solved = true;
    std::string message;   ///< why not, of the first part that was not
    double natural = 0.0;  ///< largest natural error of an answer that was used
    /// For each velocity, the natural error that the solve left in its part of the problem, n; 0 where nothing was to
    /// be solved.
    std::span<const double> left = {};
    /// The same as a velocity in the norm of the masses: times that of the velocities which the reactions had to
    /// correct (‖S r‖, docs/errors.md).
    std::span<const double> left_in_masses = {};
};

/// No solver takes a problem with cones whose H is indefinite, as strong pressure in elements makes it in a long step:
/// H = M + h R + h² K is definite in a short one.
class DELASSUS_API IndefiniteStep : public Unsupported {
public:
    using Unsupported::Unsupported;
};

/// The answer to StepSolver::interrupt_by() was yes.
class DELASSUS_API StepInterrupted : public Error {
public:
    using Error::Error;
};

/// Decides which parts of a step's problem stand still and need no solver. A part is what H and rows connect, with all
/// columns of a body (StepRequest::bodies); parts without rows are not asked about.
class DELASSUS_API RestingParts {
public:
    virtual ~RestingParts();
    /// Whether the part with these columns, ascending, stands still: then its x is 0 and its λ stays as it started.
    /// identity: a hash of all that the part's solution follows from but H, never 0 or 1.
    virtual bool rests(std::span<const std::int32_t> columns, std::uint64_t identity) = 0;
    /// Called with each part that was solved, x being its velocities, which may be changed.
    virtual void solved(std::span<const std::int32_t> columns, std::uint64_t identity, std::span<double> x) = 0;
};

/// Problems without rows are solved here: x = H⁻¹ a, block by block where H is block-diagonal, else by a factorisation
/// that is kept while the values of H stay. Parts that have nothing to do with one another are solved side by side
/// where there are threads and work enough; the results are the same to the bit for any number of threads. What was
/// prepared for a step is kept for the next: where the entries stand in the same places and H is block-diagonal, a step
/// allocates nothing here.
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
    /// Whether what a problem does not need is left out: false after leave_nothing_out().
    [[nodiscard]] DELASSUS_API bool leaves_out() const;

    /// Solves the problem of a step. solution: the start if one is asked for, then the result. Throws Unsupported if
    /// the configured solver cannot take the problem (IndefiniteStep where H is indefinite beside cones), InputError if
    /// the problem is not valid. A solve by a configured solver that misses its tolerance is repeated by `auto`. One
    /// that misses it still is counted in effort() and in the answer; the best iterate is in solution.
    DELASSUS_API StepAnswer solve(const Problem& problem, Solution& solution, const StepRequest& request = {});
    /// The same without a copy. What is left in the problem are arrays of an earlier step, to build the next one in.
    DELASSUS_API StepAnswer solve(Problem&& problem, Solution& solution, const StepRequest& request = {});

    /// From now on to this share of the tolerances that follow from the errors of methods; 1 unless set. For a step
    /// whose answer shows at its end that it was too loose.
    DELASSUS_API void solve_to(double share);

    /// From now on errors of methods count as at most these (n, > 0, in units of velocities), by which steps are solved
    /// the closer; empty: as they are.
    DELASSUS_API void bound_errors(std::vector<double> bounds);

    /// Before a trial of a step: misses so far are of what is kept, or of what was thrown away.
    DELASSUS_API void forget_misses();
    /// After it: throws StepTooLong if a solve since forget_misses() or reset_effort() missed its tolerance by orders,
    /// since its answer is no motion. Another length may have one, as past a position where rows become dependent.
    /// Within two orders the run goes on, and says at its end that it is not solved.
    DELASSUS_API void require_usable() const;

    /// Threads in place of those that the configuration asks for, e.g. to share them with other systems. Null: none but
    /// the calling thread. Call it between solves.
    DELASSUS_API void use(std::shared_ptr<ThreadTeam> threads);
    /// For other work of the step; valid as long as this object, until the next use().
    [[nodiscard]] DELASSUS_API sdk::Team team() const;

    /// The law of friction by which problems are solved, whatever theirs: the configured one, else law_of_scenes.
    [[nodiscard]] DELASSUS_API Law law() const;

    [[nodiscard]] DELASSUS_API const SolverEffort& effort() const;
    DELASSUS_API void reset_effort();

    /// Shows every problem before it is solved, e.g. to dump it. Empty: no more.
    DELASSUS_API void watch(std::function<void(const Problem&)> look);

    /// Asked before each part of a problem and whenever a solver at work shows an iterate; where the answer is yes,
    /// solve() throws StepInterrupted. Parts that are solved side by side ask from several threads at once. Empty: no
    /// more.
    DELASSUS_API void interrupt_by(std::function<bool()> asked);
    /// The answer now.
    [[nodiscard]] DELASSUS_API bool interrupted() const;

    /// Who decides which parts of a problem need no solver; null: all of them are solved. Not owned.
    DELASSUS_API void let_rest(RestingParts* parts);

    /// Whether a solve whose answer is known may be left out: no one watches problems, lets parts rest or shares the
    /// steps, and leave_nothing_out() was not called.
    [[nodiscard]] DELASSUS_API bool may_skip_solves() const;

    /// The processes that step the rest of the system, where there are several: problems are solved with them, and
    /// solve() is collective. Null: this process steps all of it. Not owned.
    DELASSUS_API void share(SharedSteps* steps);
    /// Whether its problems are parts of those of several processes, which all have to take part in a solve.
    [[nodiscard]] DELASSUS_API bool is_shared() const;
    /// Whether it is so on all of these processes. Collective.
    [[nodiscard]] DELASSUS_API bool on_all(bool own) const;
    /// The largest of these processes' values. Collective.
    [[nodiscard]] DELASSUS_API double largest_on_all(double own) const;

    /// As given, but for the name, which is `auto` if there was none.
    [[nodiscard]] DELASSUS_API const SolverConfig& config() const;

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
