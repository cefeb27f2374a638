// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/step_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <utility>

#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"
#include "delassus/timestepper.hpp"
#include "dynamics/bodies_at_rest.hpp"
#include "dynamics/general_factor.hpp"
#include "dynamics/island_solver.hpp"
#include "dynamics/islands.hpp"
#include "dynamics/shared_steps.hpp"
#include "problem/validate.hpp"
#include "solver/auto_solver.hpp"

namespace delassus {

/// What is kept of a part of the problem from one step to the next.
struct KeptPart {
    Problem data;  // unused where the whole problem is one part
    std::optional<PreparedProblem> prepared;
    GeneralFactor factor;  // of an H that is not definite, where there are no rows
    Solution solution;
    std::vector<double> method_error;
    std::uint64_t identity = 0;  // as RestingParts knows it; 0: not asked about
    bool rests = false;
    bool waits = false;  // to be solved beside others
};

/// Parts that have the same solver: every most_solvers-th from the first on.
struct Chain {
    std::int64_t rows = 0;
    std::size_t first = 0;
};

/// What is kept of the problems of one name: a method that solves several kinds of problems in a step finds its own
/// pattern again.
struct KeptKind {
    std::string name;
    Problem given;                     // a copy of what solve() must not change
    std::deque<KeptPart> parts;        // by the number of the part
    std::deque<IslandSolver> solvers;  // likewise
};

struct StepSolver::Implementation {
    Implementation(const Registry& known, SolverConfig chosen)
        : registry(known), config(std::move(chosen)), settings(config.settings()) {
        if (config.name.empty()) config.name = auto_name;
        settings.origin = Origin::Step;
        // A second thread has not been seen to pay in steps (docs/decisions, D020): who wants it says so.
        if (!config.threads) settings.team = ThreadTeam::for_threads(1);
    }

    KeptKind& kind(const std::string& name) {
        for (KeptKind& known : kinds)
            if (known.name == name) return known;
        kinds.emplace_back().name = name;
        return kinds.back();
    }
    /// The solver of a part. Those of other parts stay where they are.
    IslandSolver& solver(KeptKind& kind, std::size_t number) const {
        while (kind.solvers.size() <= number % most_solvers) kind.solvers.emplace_back(registry, config);
        return kind.solvers[number % most_solvers];
    }
    static KeptPart& part(KeptKind& kind, std::size_t number) {
        while (kind.parts.size() <= number) kind.parts.emplace_back();
        return kind.parts[number];
    }

    double share_of_tolerance = 1.0;   // solve_to()
    std::vector<double> error_bounds;  // bound_errors()

    bool solve(Problem& problem, Solution& solution, const StepRequest& request);
    bool solve_whole(KeptKind& kind, Problem& problem, Solution& solution, const StepRequest& request);
    /// Solves the parts in `list` that do not rest, from self.start into the parts' solutions.
    bool solve_parts(KeptKind& kind, std::span<const Island> list, const StepRequest& request);
    /// Takes the arrays of the problem and leaves others. Parts of different solvers may be solved at the same time.
    /// columns: of the part in the whole problem; all where there are none. threads: may be null.
    void solve_part(KeptKind& kind, Problem& problem, Solution& solution, const StepRequest& request,
                    std::size_t number, std::span<const std::int32_t> columns,
                    const std::shared_ptr<ThreadTeam>& threads, IslandResult& result);
    /// Adds to the effort and the answer; whether the part was solved.
    bool take(const IslandResult& result);
    /// Whether tolerances follow from the error of the method: see docs/tolerance.md.
    [[nodiscard]] bool follows_method(const StepRequest& request) const {
        return !config.sweeps && !request.method_error.empty() && (!config.tolerance || config.name == auto_name);
    }

    /// Parts beyond so many share solvers; it bounds the memory.
    static constexpr std::size_t most_solvers = 64;

    const Registry& registry;
    bool leaves_out = true;
    std::uint64_t also_needs = 0;  ///< of every problem, where nothing is left out
    SolverConfig config;
    SolveSettings settings;
    std::deque<KeptKind> kinds;  // few
    Islands islands;
    BodiesAtRest at_rest;
    std::vector<IslandResult> results;  // by the number of the part
    std::vector<double> left, left_in_masses;
    std::vector<Chain> chains;
    Solution start;
    SolverEffort effort;
    StepAnswer answer;  // so far
    std::function<void(const Problem&)> look;
    RestingParts* resting = nullptr;
    SharedSteps* shared = nullptr;
};

StepSolver::StepSolver(const Registry& registry, SolverConfig config)
    : implementation_(std::make_unique<Implementation>(registry, std::move(config))) {}
StepSolver::~StepSolver() = default;

RestingParts::~RestingParts() = default;

namespace {

/// The kinds that rows of scenes can have: a cone that only tests know is none of them.
constexpr std::uint64_t cones_of_scenes =
    sdk::cones_that([](const sdk::ConeOperations& row) { return row.kind <= DELASSUS_CONE_FRICTION; });

/// Of the values in these columns, of all where there are none; 0 of no values.
double largest(std::span<const double> values, std::span<const std::int32_t> columns) {
    double result = 0.0;
    if (columns.empty())
        for (const double value : values) result = std::max(result, value);
    if (!values.empty())
        for (const std::int32_t column : columns) result = std::max(result, values[static_cast<std::size_t>(column)]);
    return result;
}

}  // namespace

bool StepSolver::leaves_out() const {
    return implementation_->leaves_out;
}

void StepSolver::leave_nothing_out() {
    auto& self = *implementation_;
    self.leaves_out = false;
    self.also_needs = DELASSUS_CAN_H_DEFINITE;
    if (self.config.name == auto_name) self.also_needs |= cones_of_scenes;
}

StepAnswer StepSolver::solve(const Problem& problem, Solution& solution, const StepRequest& request) {
    Problem& given = implementation_->kind(problem.name).given;
    given = problem;
    return solve(std::move(given), solution, request);
}

StepAnswer StepSolver::solve(Problem&& problem, Solution& solution, const StepRequest& request) {
    auto& self = *implementation_;
    problem.law = law();
    if (self.look) self.look(problem);
    ++self.effort.solves;
    self.left.assign(static_cast<std::size_t>(problem.n()), 0.0);
    self.left_in_masses.assign(static_cast<std::size_t>(problem.n()), 0.0);
    self.answer = {};
    self.at_rest.begin(problem, request.bodies);
    self.answer.solved = self.solve(problem, solution, request);
    self.at_rest.stop(self.left, solution.x);
    self.answer.left = self.left;
    self.answer.left_in_masses = self.left_in_masses;
    return self.answer;
}

// The parts of a problem are solved each by a solver of its own: the k-th part of a step is, as long as bodies keep
// their neighbours, the k-th of the next, and what was prepared and analysed for it is used again.
bool StepSolver::Implementation::solve(Problem& problem, Solution& solution, const StepRequest& given) {
    StepRequest request = given;
    if (!follows_method(request)) request.method_error = request.error_of_solves = {};
    request.corrects = request.corrects && !config.sweeps && !config.tolerance;
    if (shared) {
        IslandResult result;
        shared->solve(problem, solution, request, settings, result);
        std::ranges::fill(left, result.natural);
        std::ranges::fill(left_in_masses, result.in_masses);
        return take(result);
    }
    const auto n = static_cast<std::size_t>(problem.n()), m = static_cast<std::size_t>(problem.m());
    KeptKind& kind = this->kind(problem.name);
    request.warm_start = request.warm_start && solution.x.size() == n && solution.lambda.size() == m;
    if (!leaves_out || m == 0 || !Islands::can_part(problem)) return solve_whole(kind, problem, solution, request);

    islands.find(problem, resting ? request.bodies : std::span<const std::int32_t>{});
    const auto list = islands.list();
    if (!resting && list.size() == 1 && list[0].cones.size() == problem.cones.size())
        return solve_whole(kind, problem, solution, request);
    if (!request.warm_start) {
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }
    start = solution;
    std::fill(solution.lambda.begin(), solution.lambda.end(), 0.0);  // of rows that belong to no part
    for (std::size_t number = 0; number < list.size(); ++number) {
        KeptPart& part = this->part(kind, number);
        part.identity = resting && !list[number].cones.empty() ? islands.identity(list[number]) : 0;
        part.rests = part.identity != 0 && resting->rests(list[number].columns, part.identity);
        if (!part.rests) continue;
        islands.take(list[number], start, part.solution);
        std::fill(part.solution.x.begin(), part.solution.x.end(), 0.0);
        ++effort.resting_parts;
    }
    const bool solved = solve_parts(kind, list, request);
    for (std::size_t number = 0; number < list.size(); ++number) {
        KeptPart& part = kind.parts[number];
        if (part.identity != 0 && !part.rests) resting->solved(list[number].columns, part.identity, part.solution.x);
        islands.put(list[number], part.solution, solution);
    }
    return solved;
}

bool StepSolver::Implementation::solve_whole(KeptKind& kind, Problem& problem, Solution& solution,
                                             const StepRequest& request) {
    IslandResult result;
    solve_part(kind, problem, solution, request, 0, {}, settings.team, result);
    std::ranges::fill(left, result.natural);
    std::ranges::fill(left_in_masses, result.in_masses);
    return take(result);
}

// A part that is more than a thread's share of the step is solved by all threads together. The others are dealt out,
// the largest first. Parts that have the same solver follow one another: a chain. What a part's solution is depends on
// neither. On several processes all of them solve the same part at the same time.
bool StepSolver::Implementation::solve_parts(KeptKind& kind, std::span<const Island> list, const StepRequest& request) {
    constexpr std::int64_t worth_sharing = 96, worth_a_team = 2048;  // rows
    results.assign(list.size(), {});
    const auto solve = [&](std::size_t number, const std::shared_ptr<ThreadTeam>& threads) {
        KeptPart& part = kind.parts[number];
        islands.take(list[number], start, part.solution);
        islands.part(list[number], part.data);
        solve_part(kind, part.data, part.solution, request, number, list[number].columns, threads, results[number]);
    };
    const sdk::Team team = settings.team ? settings.team->team() : sdk::Team();
    std::int64_t rows = 0, waiting = 0;
    for (std::size_t number = 0; number < list.size(); ++number)
        if (!kind.parts[number].rests) rows += islands.rows(list[number]);
    chains.assign(std::min(list.size(), most_solvers), {});
    for (std::size_t number = 0; number < list.size(); ++number) {
        KeptPart& part = kind.parts[number];
        const std::int64_t own = islands.rows(list[number]);
        const bool alone = team.size() == 1 || process_count() > 1;
        part.waits = !part.rests && !alone && !(own >= worth_a_team && own * team.size() > rows);
        if (!part.waits && !part.rests) solve(number, settings.team);
        if (!part.waits) continue;
        if (own > 0) static_cast<void>(solver(kind, number));
        chains[number % most_solvers].rows += own;
        waiting += own;
    }
    for (std::size_t k = 0; k < chains.size(); ++k) chains[k].first = k;
    std::ranges::sort(chains, std::greater{}, &Chain::rows);
    team.if_worth(waiting >= worth_sharing).for_each(chains.size(), [&](std::size_t k) {
        for (std::size_t number = chains[k].first; number < list.size(); number += most_solvers)
            if (kind.parts[number].waits) solve(number, nullptr);
    });
    bool solved = true;
    for (std::size_t number = 0; number < list.size(); ++number) {
        solved = take(results[number]) && solved;
        for (const std::int32_t column : list[number].columns) {
            left[static_cast<std::size_t>(column)] = results[number].natural;
            left_in_masses[static_cast<std::size_t>(column)] = results[number].in_masses;
        }
    }
    return solved;
}

bool StepSolver::Implementation::take(const IslandResult& result) {
    const SolverEffort& part = result.effort;
    effort.plugin_solves += part.plugin_solves;
    effort.iterations += part.iterations;
    effort.seconds += part.seconds;
    effort.repeated += part.repeated;
    effort.failed += part.failed;
    if (effort.failure.empty()) effort.failure = part.failure;
    effort.near_goal += part.near_goal;
    effort.worst_natural = std::max(effort.worst_natural, part.worst_natural);
    effort.worst_miss = std::max(effort.worst_miss, part.worst_miss);
    if (effort.unsolved.empty()) effort.unsolved = part.unsolved;
    answer.natural = std::max(answer.natural, part.worst_natural);
    if (answer.message.empty()) answer.message = part.unsolved;
    return result.solved;
}

void StepSolver::Implementation::solve_part(KeptKind& kind, Problem& problem, Solution& solution,
                                            const StepRequest& request, std::size_t number,
                                            std::span<const std::int32_t> columns,
                                            const std::shared_ptr<ThreadTeam>& threads, IslandResult& result) {
    KeptPart& kept = part(kind, number);
    const sdk::Team team = threads ? threads->team() : sdk::Team();
    try {
        if (kept.prepared) {
            kept.prepared->use(team);
            kept.prepared->renew(std::move(problem));
        } else {
            kept.prepared.emplace(std::move(problem), also_needs);
            kept.prepared->use(team);
            problem = {};
        }
    } catch (const NotFinite& error) {  // a trial that went beyond what numbers hold, where a shorter step may not
        throw StepFailure(fmt::format("forces or constraints are not finite: {}", error.what()));
    }
    const PreparedProblem& prepared = *kept.prepared;
    if (settings.cancelled && settings.cancelled()) throw StepInterrupted("the step was interrupted");
    if (leaves_out && prepared.problem().m() == 0) {
        if (prepared.is_definite()) {
            prepared.free_velocities(solution.x);
        } else {
            kept.factor.solve(sdk::ProblemView(prepared.raw()), prepared.raw(), solution.x);
        }
        solution.lambda.clear();
        return;
    }
    SolveSettings own = settings;
    own.team = threads;
    const auto all_stand = [this, columns](std::span<const double> x, double error) {
        return at_rest.all_stand(columns, x, error);
    };
    own.stands_still = std::cref(all_stand);  // which allocates nothing
    IslandRequest island{.settings = own,
                         .warm_start = request.warm_start,
                         .leaves_out = leaves_out,
                         .corrects = request.corrects,
                         .share = share_of_tolerance};
    if (!request.method_error.empty()) {
        island.error_of_solves = largest(request.error_of_solves, columns);
        kept.method_error.clear();
        const std::size_t count = columns.empty() ? request.method_error.size() : columns.size();
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t column = columns.empty() ? i : static_cast<std::size_t>(columns[i]);
            const double error = request.method_error[column],
                         bound = error_bounds.empty() ? HUGE_VAL : error_bounds[column];
            kept.method_error.push_back(std::clamp(error, -bound, bound));
        }
        island.method_error = kept.method_error;
    }
    solver(kind, number).solve(prepared, solution, island, result);
}

std::vector<StepSolver::Part> StepSolver::parts(const Problem& problem) const {
    const auto part_of = [this](const Problem& part) {
        PreparedProblem prepared(part, implementation_->also_needs);
        prepared.set_law(law());
        return Part{part.n(), part.m(), prepared.structure(), prepared.needs()};
    };
    if (!implementation_->leaves_out || problem.m() == 0 || !Islands::can_part(problem)) return {part_of(problem)};
    Islands islands;
    islands.find(problem);
    std::vector<Part> result;
    Problem part;
    for (const Island& island : islands.list()) {
        islands.part(island, part);
        result.push_back(part_of(part));
    }
    return result;
}

std::string StepSolver::choice(std::uint64_t needs) const {
    const auto& config = implementation_->config;
    if (config.name != auto_name) return config.name;
    const auto choice = auto_choice(implementation_->registry, config.options, needs, Origin::Step);
    return choice.first.empty() ? std::string() : choice.first.front();
}

void StepSolver::use(std::shared_ptr<ThreadTeam> threads) {
    implementation_->settings.team = std::move(threads);
}
sdk::Team StepSolver::team() const {
    const auto& threads = implementation_->settings.team;
    return threads ? threads->team() : sdk::Team();
}

void StepSolver::watch(std::function<void(const Problem&)> look) {
    implementation_->look = std::move(look);
}
void StepSolver::interrupt_by(std::function<bool()> asked) {
    implementation_->settings.cancelled = std::move(asked);
}
bool StepSolver::interrupted() const {
    const auto& asked = implementation_->settings.cancelled;
    return asked && asked();
}
void StepSolver::let_rest(RestingParts* parts) {
    implementation_->resting = parts;
}
bool StepSolver::may_skip_solves() const {
    const Implementation& self = *implementation_;
    return self.leaves_out && !self.look && !self.resting && !self.shared;
}
void StepSolver::share(SharedSteps* steps) {
    implementation_->shared = steps;
}

bool StepSolver::is_shared() const {
    return implementation_->shared != nullptr;
}

bool StepSolver::on_all(bool own) const {
    return implementation_->shared ? implementation_->shared->on_all(own) : own;
}
double StepSolver::largest_on_all(double own) const {
    return implementation_->shared ? implementation_->shared->largest_on_all(own) : own;
}
const SolverConfig& StepSolver::config() const {
    return implementation_->config;
}

Law StepSolver::law() const {
    return implementation_->config.law.value_or(law_of_scenes);
}

const SolverEffort& StepSolver::effort() const {
    return implementation_->effort;
}
void StepSolver::reset_effort() {
    implementation_->effort = {};
}
void StepSolver::bound_errors(std::vector<double> bounds) {
    implementation_->error_bounds = std::move(bounds);
}

void StepSolver::solve_to(double share) {
    implementation_->share_of_tolerance = share;
}
void StepSolver::forget_misses() {
    implementation_->effort.worst_miss = 0.0;
    implementation_->effort.unsolved.clear();
}
void StepSolver::require_usable() const {
    const SolverEffort& effort = implementation_->effort;
    if (effort.worst_miss > 100.0)
        throw StepTooLong(fmt::format(
            "no forces of contacts and joints were found that fit: the best answer {}, and such an answer is not used "
            "({})",
            std::isfinite(effort.worst_miss) ? fmt::format("misses the tolerance by {:.2g} times", effort.worst_miss)
                                             : "needs forces without bound",
            effort.unsolved.substr(0, effort.unsolved.find(": "))));
}

std::vector<std::string> StepSolver::loaded() const {
    std::set<std::string> names;
    for (const KeptKind& kind : implementation_->kinds)
        for (const IslandSolver& solver : kind.solvers) names.insert(solver.loaded().begin(), solver.loaded().end());
    if (const SharedSteps* shared = implementation_->shared)
        names.insert(shared->loaded().begin(), shared->loaded().end());
    return {names.begin(), names.end()};
}

}  // namespace delassus
