// SPDX-License-Identifier: BSD-3-Clause
// Solving and judging a problem of which each process holds a part (docs/partitioned.md).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/communicator.hpp"
#include "delassus/errors.hpp"
#include "delassus/export.hpp"
#include "delassus/needs.hpp"
#include "delassus/partitioned.hpp"
#include "delassus/plugin.h"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"

namespace delassus {

class PartMeter;

/// A validated part with the structure of the whole, its needs and identity, laid out for the plugin border. Every
/// member that is marked collective is called by all processes in the same order; what it returns or throws is the same
/// on all of them.
class DELASSUS_API PreparedPart {
public:
    /// Checks the parts, finds the structure of H and what the problem needs. Throws InputError if a part is not valid,
    /// or E or, beside cones that are not linear, H is not symmetric. Collective.
    PreparedPart(std::shared_ptr<const Communicator> communicator, PartitionedProblem problem);
    ~PreparedPart();
    PreparedPart(PreparedPart&&) noexcept;
    PreparedPart& operator=(PreparedPart&&) noexcept;

    [[nodiscard]] const Communicator& communicator() const;
    [[nodiscard]] const PartitionedProblem& problem() const;
    /// What crosses the border; valid as long as this object.
    [[nodiscard]] const delassus_local_problem& raw() const;
    /// Of the whole H. Diagonal and Blocks only if every block lies within one process.
    [[nodiscard]] Structure structure() const;
    /// DELASSUS_CAN_* bits that a solver must have, DELASSUS_CAN_PARTITIONED among them. The same on all processes.
    [[nodiscard]] std::uint64_t needs() const;
    /// The missing needs as a person would say them, with the numbers of all processes.
    [[nodiscard]] std::string describe(std::uint64_t missing) const;
    /// How many entries of x that others own the rows of this process have to do with.
    [[nodiscard]] std::int64_t ghosts() const;

    /// Changes the friction law; on all processes alike.
    void set_law(Law law);
    /// Replaces the own a (n) and b (m). Throws InputError on a wrong size or a value that is not finite. Collective.
    void set_right_hand_side(std::vector<double> a, std::vector<double> b);

    /// Every measure of docs/errors.md for all parts together, as ErrorMeter computes it of a whole problem; the two
    /// differ by rounding. x: n, lambda: m, own parts, finite. Throws InputError on wrong sizes, Unsupported for an
    /// unsymmetric H. The first call after a change of the problem computes S and r. Collective.
    [[nodiscard]] Errors measure(std::span<const double> x, std::span<const double> lambda) const;
    /// The natural error alone. x may be null (on all processes) where H is definite or n_all = 0: H⁻¹(a + Dᵀλ) is used
    /// then; elsewhere the answer is NaN without x. Collective.
    [[nodiscard]] double natural(const double* x, const double* lambda) const;

    /// ErrorMeter::reference() and norm_in_rows() of all parts together. v: n, own part. Collective.
    [[nodiscard]] double reference() const;
    [[nodiscard]] double norm_in_rows(std::span<const double> v) const;
    /// The velocities without reactions: x ← H⁻¹ a, own part. Throws Unsupported where H is not definite. Collective.
    void free_velocities(std::vector<double>& x) const;

private:
    friend class PartitionedSolver;
    friend class PartMeter;
    friend class PartProof;
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// What a solve cost one process.
struct SolveCost {
    double setup = 0.0, solve = 0.0;  ///< s, by the core's clock: analysis and factorisation; solving
    /// s, by delassus_phase, as the solver says; NaN where it does not. What of `solve` is in none of them is its own
    /// work on vectors, or unknown.
    std::array<double, DELASSUS_PHASE_COUNT> phases = {NAN, NAN, NAN, NAN, NAN, NAN};
    std::int64_t bytes_sent = -1;  ///< by the solver to other processes while it solved; −1 where it does not say
};

/// The phase's name in reports: "products".
[[nodiscard]] DELASSUS_API std::string_view name_of(delassus_phase phase);

/// A solver of partitioned problems, made from a plugin with DELASSUS_CAN_PARTITIONED, for its whole life. It is to a
/// part what Solver is to a whole problem: the same refusals, limits, curve and judgement.
class DELASSUS_API PartitionedSolver {
public:
    /// Throws InputError on a bad option, or if the plugin cannot be loaded or cannot make a solver: on all processes,
    /// with the sentence of the first that failed. The registry must outlive the solver. Collective.
    PartitionedSolver(const Registry& registry, SolverConfig config, std::shared_ptr<const Communicator> communicator);
    ~PartitionedSolver();
    PartitionedSolver(PartitionedSolver&&) noexcept;
    PartitionedSolver& operator=(PartitionedSolver&&) noexcept;

    [[nodiscard]] const PluginInfo& info() const;

    /// Empty if the solver can take the problem with these settings; else the sentence of the refusal.
    [[nodiscard]] std::string refusal(const PreparedPart& problem, const SolveSettings& settings) const;

    /// Solves. own: the own parts, n and m; the starting point if settings.warm_start, and the result: always of the
    /// right size and finite. Settings are the same on all processes, but for the callbacks, which may be there on some
    /// alone (give_up: on all or none). Times are those of the slowest process. Throws Unsupported with the refusal, or
    /// InputError on a bad setting, on all processes. Everything else is a status, the same on all. Collective.
    ///
    /// A plugin that fails on one process alone leaves the others waiting for it: the run of all then ends within
    /// seconds, with a sentence of that process, by Communicator::abort(3).
    SolveReport solve(const PreparedPart& problem, Solution& own, const SolveSettings& settings);

    /// Of this process in the latest solve; with auto, of all its stages together.
    [[nodiscard]] const SolveCost& cost() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// What one process had of a partitioned problem, and what it cost it.
struct ProcessReport {
    std::int64_t n = 0, m = 0;     ///< own columns and rows
    std::int64_t ghosts = 0;       ///< columns of others that its rows have to do with
    std::int64_t bytes_sent = 0;   ///< by the core since the start; a solver's own library counts for itself
    std::int64_t peak_memory = 0;  ///< bytes resident at most so far
    SolveCost cost = {};
};

/// Of all processes, by rank. cost: what the own solve cost. Collective.
[[nodiscard]] DELASSUS_API std::vector<ProcessReport> process_reports(const PreparedPart& problem,
                                                                      const SolveCost& cost);

/// The report as JSON text with the processes beside it (docs/report.md).
[[nodiscard]] DELASSUS_API std::string to_json(const SolveReport& report, const std::vector<ProcessReport>& processes);

}  // namespace delassus
