// SPDX-License-Identifier: BSD-3-Clause
// The problem of a step whose bodies several processes share (docs/partitioned.md, "Simulating").
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "delassus/communicator.hpp"
#include "delassus/export.hpp"
#include "delassus/partitioned.hpp"
#include "delassus/registry.hpp"
#include "delassus/step_solver.hpp"
#include "dynamics/island_solver.hpp"
#include "partitioned/halo.hpp"

namespace delassus {

/// Whose the bodies are that this process steps, or has beside its own as ghosts.
struct StepShares {
    /// A body of the local problem: `count` columns from `column` on.
    struct Body {
        std::int32_t column = 0, count = 0;
        std::int32_t owner = 0;         ///< process
        std::int64_t first_column = 0;  ///< of these columns, among those of all processes
        std::int64_t decides = 0;       ///< of the bodies in a row the one with the least number has the row's process
    };
    std::vector<Body> bodies;                ///< by ascending column; they have all columns
    std::vector<std::int64_t> column_start;  ///< of the processes among all columns; processes + 1
    /// Of the bilateral rows of the local problem, which come first: their numbers in the whole system, ascending.
    std::vector<std::int32_t> rows;
    std::int32_t all_rows = 0;  ///< bilateral ones in the whole system
};

/// Each process assembles the problem of its own bodies and of ghosts, which are bodies of others that may have to do
/// with its own. Of that it keeps the rows of H of its own bodies, and the rows of D that fall to it. Together these
/// make a partitioned problem, which a solver for such problems takes.
///
/// What one process alone throws has to end the step on all of them: step() sees to that.
class DELASSUS_API SharedSteps {
public:
    /// registry outlives this. config: of the scene, with a name.
    SharedSteps(std::shared_ptr<const Communicator> communicator, const Registry& registry, SolverConfig config);
    ~SharedSteps();

    [[nodiscard]] const Communicator& communicator() const { return *communicator_; }

    /// Says whose is what from the next solve on. Collective.
    void set_shares(StepShares shares);

    /// Runs a step, in which solve() and on_all() are called as often on all processes. Throws what it throws; where it
    /// throws on some process, it throws an error of the same class with the sentence of the first such process on all.
    /// Collective.
    void step(const std::function<void()>& body);

    /// As StepSolver::solve(), of the local problem, within step(); request: of its columns, with a method_error where
    /// tolerances follow it. Of rows that fall to other processes λ ← 0, but for bilateral ones, of which all have the
    /// same. Collective.
    void solve(const Problem& local, Solution& solution, const StepRequest& request, const SolveSettings& settings,
               IslandResult& result);
    [[nodiscard]] bool on_all(bool own);
    [[nodiscard]] double largest_on_all(double own);

    /// Whether a cone of the last local problem fell to this process, by the cone's number.
    [[nodiscard]] const std::vector<bool>& own_cones() const { return own_cones_; }
    /// λ of the bilateral rows of the whole system, impulses, from the last solve.
    [[nodiscard]] const std::vector<double>& bilateral() const { return bilateral_; }
    /// Rows of D that fell to this process for each local body that decides them, as StepShares::bodies.
    [[nodiscard]] const std::vector<std::int32_t>& rows_of_bodies() const { return rows_of_bodies_; }
    [[nodiscard]] const std::set<std::string>& loaded() const { return solver_->loaded(); }

private:
    enum class Trouble : std::int64_t { None, Interrupted, TooLong, Failure, Unsupported, Input };
    /// Tells the others of trouble, and hears of theirs; throws if there is any. Whether flag was set nowhere.
    bool agree(Trouble trouble, const std::string& sentence, bool flag);
    /// The own part of the local problem.
    [[nodiscard]] PartitionedProblem part_of(const Problem& local);
    /// Finds whose each cone is, and numbers the rows that fall to this process.
    void share_rows(const Problem& local);
    [[nodiscard]] bool is_own(const StepShares::Body& body) const { return body.owner == communicator_->rank(); }
    /// The entries of own columns of a local vector; and back, with those of ghosts from their owners.
    [[nodiscard]] std::vector<double> own_columns(std::span<const double> local) const;
    void spread(std::vector<double> own, std::vector<double>& local) const;
    /// bilateral_ ← from the own rows of all processes.
    void gather_bilateral(const std::vector<double>& own);

    std::shared_ptr<const Communicator> communicator_;
    const Registry& registry_;
    SolverConfig config_;
    StepShares shares_;
    std::unique_ptr<IslandSolver> solver_;
    Halo columns_;
    bool ended_together_ = false;        ///< what is being thrown is thrown on all processes
    std::vector<std::int32_t> body_of_;  ///< of each local column
    std::vector<bool> own_cones_;
    std::vector<std::int32_t> own_rows_;  ///< of the local problem, ascending
    std::vector<std::int32_t> rows_of_bodies_;
    std::vector<double> bilateral_;
};

}  // namespace delassus
