// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/step_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"
#include "dynamics/general_factor.hpp"
#include "dynamics/islands.hpp"
#include "dynamics/shared_steps.hpp"
#include "dynamics/step_tolerance.hpp"
#include "problem/symmetry.hpp"
#include "solver/auto_solver.hpp"
#include "solver/judgement.hpp"

namespace delassus {

/// What is kept of a part of the problem from one step to the next.
struct KeptPart {
    Problem data;  // unused where the whole problem is one part
    std::optional<PreparedProblem> prepared;
    GeneralFactor factor;  // of an H that is not definite, where there are no rows
    Solution solution;
    std::uint64_t identity = 0;  // as RestingParts knows it; 0: not asked about
    bool rests = false;
    bool waits = false;  // to be solved beside others
};

/// Parts that have the same solver: every most_instances-th from the first on.
struct Chain {
    std::int64_t rows = 0;
    std::size_t first = 0;
};

/// What solving a part came to.
struct PartResult {
    bool solved = true;
    double natural = 0.0;    ///< left in the solution
    double in_masses = 0.0;  ///< the same times ErrorMeter::reference()
    SolverEffort effort;
};

/// A solver of parts, used by one thread at a time.
struct Instance {
    Solver solver;
    std::optional<Solver> fallback;  // `auto`, where the configured solver is another
    Solution before;                 // the start of the part that is solved
    std::set<std::string> loaded;

    void count(const SolveReport& report, SolverEffort& effort);
};

/// What is kept of the problems of one name: a method that solves several kinds of problems in a step finds its own
/// pattern again.
struct KeptKind {
    std::string name;
    Problem given;                   // a copy of what solve() must not change
    std::deque<KeptPart> parts;      // by the number of the part
    std::deque<Instance> instances;  // likewise
};

struct StepSolver::Implementation {
    Implementation(const Registry& known, SolverConfig chosen)
        : registry(known), config(std::move(chosen)), settings(config.settings()) {
        if (config.name.empty()) config.name = auto_name;
        if (config.name == auto_name) config.options.try_emplace("simulation", "true");
        // A second thread has not been seen to pay in steps (docs/decisions, D020): who wants it says so.
        if (!config.threads) settings.team = ThreadTeam::for_threads(1);
    }

    KeptKind& kind(const std::string& name) {
        for (KeptKind& known : kinds)
            if (known.name == name) return known;
        kinds.emplace_back().name = name;
        return kinds.back();
    }
    /// The instance for a part. Those of other parts stay where they are.
    Instance& instance(KeptKind& kind, std::size_t number) const {
        while (kind.instances.size() <= number % most_instances)
            kind.instances.push_back({make_solver(registry, config), {}, {}, {}});
        return kind.instances[number % most_instances];
    }
    static KeptPart& part(KeptKind& kind, std::size_t number) {
        while (kind.parts.size() <= number) kind.parts.emplace_back();
        return kind.parts[number];
    }

    bool solve_whole(KeptKind& kind, Problem& problem, Solution& solution, bool warm_start);
    /// Solves the parts in `list` that do not rest, from self.start into the parts' solutions.
    bool solve_parts(KeptKind& kind, std::span<const Island> list, bool warm_start);
    /// Takes the arrays of the problem and leaves others. Parts of different instances may be solved at the same time.
    /// columns: of the part in the whole problem. threads: may be null.
    void solve_part(KeptKind& kind, Problem& problem, Solution& solution, bool warm_start, std::size_t number,
                    std::span<const std::int32_t> columns, const std::shared_ptr<ThreadTeam>& threads,
                    PartResult& result);
    /// Adds to the effort; whether the part was solved.
    bool take(const PartResult& result);
    /// Whether tolerances follow from the error of the method: see docs/tolerance.md.
    [[nodiscard]] bool follows_method() const {
        return !config.sweeps && !method_error.empty() && (!config.tolerance || config.name == auto_name);
    }
    /// The tolerance of a part then; nothing otherwise.
    [[nodiscard]] std::optional<double> goal_for(const PreparedProblem& part, const PartTraits& traits,
                                                 std::span<const std::int32_t> columns) const;
    /// Solves with `auto` what the configured solver left at `report`, from the start `first`; the better answer is in
    /// solution, what it is worth in report.
    void solve_again(const PreparedProblem& prepared, Instance& by, SolveSettings again, Solution& solution,
                     SolveReport& report, SolverEffort& spent) const;
    /// Whether the velocities without reactions vanish in rounding, so that no reactions are the answer: what recovers
    /// a penetration at constant speed is such a case. Errors relative to them say nothing. solution: that answer then.
    static bool moves_freely(const PreparedProblem& part, Solution& solution);
    /// How fast the velocities without reactions move the rows, as a share of the motion as a whole, about.
    static double share_of_rows(const PreparedProblem& part);
    /// Whether the velocities without reactions move the rows by no more than their own rounding, so that no reactions
    /// are the answer. solution: that answer then.
    static bool rows_feel_nothing(const PreparedProblem& part, Solution& solution);
    /// Whether x = 0 without reactions is the answer, but for numbers too small to be squared.
    static bool is_at_rest(const Problem& problem);
    /// Whether no reactions are within all bounds.
    static bool hold_zero(std::span<const Cone> cones);
    /// Whether the rows hold as well as rounding lets them. A body that is pushed along at a constant speed needs next
    /// to no reaction: errors are relative to it, and the speed's own rounding is large beside it.
    static bool rows_are_rounding(const Errors& error) {
        constexpr double slack = 32.0;
        return error.natural <= slack * error.rounding;
    }
    /// The same of an answer that also balances. That error is relative to the momenta, whatever the reactions are: a
    /// mechanism that falls freely has rows that hold at the speeds of the step before, too.
    static bool is_rounding(const Errors& error) {
        return rows_are_rounding(error) && error.balance <= rounding_limit_of_steps;
    }

    /// Parts beyond so many share instances; it bounds the memory.
    static constexpr std::size_t most_instances = 64;

    const Registry& registry;
    bool leaves_out = true;
    std::uint64_t also_needs = 0;  ///< of every problem, where nothing is left out
    SolverConfig config;
    SolveSettings settings;
    std::deque<KeptKind> kinds;  // few
    Islands islands;
    std::vector<PartResult> results;  // by the number of the part
    std::vector<double> left, left_in_masses;
    std::vector<Chain> chains;
    Solution start;
    std::span<const double> method_error, error_of_solves;
    SolverEffort effort;
};

StepSolver::StepSolver(const Registry& registry, SolverConfig config)
    : implementation_(std::make_unique<Implementation>(registry, std::move(config))) {}
StepSolver::~StepSolver() = default;

RestingParts::~RestingParts() = default;

namespace {

/// The kinds that rows of scenes can have: a cone that only tests know is none of them.
constexpr std::uint64_t cones_of_scenes =
    sdk::cones_that([](const sdk::ConeOperations& row) { return row.kind <= DELASSUS_CONE_FRICTION; });

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

bool StepSolver::solve(const Problem& problem, Solution& solution, bool warm_start) {
    Problem& given = implementation_->kind(problem.name).given;
    given = problem;
    return solve(std::move(given), solution, warm_start);
}

// The parts of a problem are solved each by a solver instance of its own: the k-th part of a step is, as
// long as bodies keep their neighbours, the k-th of the next, and what was prepared and analysed for it is used again.
bool StepSolver::solve(Problem&& problem, Solution& solution, bool warm_start) {
    auto& self = *implementation_;
    problem.law = law();
    if (on_problem) on_problem(problem);
    self.settings.cancelled = cancelled;
    self.method_error = method_error;
    self.error_of_solves = error_of_solves;
    ++self.effort.solves;
    self.left.assign(static_cast<std::size_t>(problem.n()), 0.0);
    self.left_in_masses.assign(static_cast<std::size_t>(problem.n()), 0.0);
    if (shared) {
        PartResult result;
        result.solved = shared->solve(problem, solution, warm_start, self.settings,
                                      self.follows_method() ? method_error : std::span<const double>{}, result.effort);
        std::ranges::fill(self.left, result.effort.worst_natural);
        return self.take(result);
    }
    const auto n = static_cast<std::size_t>(problem.n()), m = static_cast<std::size_t>(problem.m());
    KeptKind& kind = self.kind(problem.name);
    warm_start = warm_start && solution.x.size() == n && solution.lambda.size() == m;
    if (!self.leaves_out || m == 0 || !Islands::can_part(problem))
        return self.solve_whole(kind, problem, solution, warm_start);

    self.islands.find(problem, resting ? resting->bodies() : std::span<const std::int32_t>{});
    const auto list = self.islands.list();
    if (!resting && list.size() == 1 && list[0].cones.size() == problem.cones.size())
        return self.solve_whole(kind, problem, solution, warm_start);
    if (!warm_start) {
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }
    self.start = solution;
    std::fill(solution.lambda.begin(), solution.lambda.end(), 0.0);  // of rows that belong to no part
    for (std::size_t number = 0; number < list.size(); ++number) {
        KeptPart& part = Implementation::part(kind, number);
        part.identity = resting && !list[number].cones.empty() ? self.islands.identity(list[number]) : 0;
        part.rests = part.identity != 0 && resting->rests(list[number].columns, part.identity);
        if (!part.rests) continue;
        self.islands.take(list[number], self.start, part.solution);
        std::fill(part.solution.x.begin(), part.solution.x.end(), 0.0);
        ++self.effort.resting_parts;
    }
    const bool solved = self.solve_parts(kind, list, warm_start);
    for (std::size_t number = 0; number < list.size(); ++number) {
        KeptPart& part = kind.parts[number];
        if (part.identity != 0 && !part.rests) resting->solved(list[number].columns, part.identity, part.solution.x);
        self.islands.put(list[number], part.solution, solution);
    }
    return solved;
}

bool StepSolver::Implementation::solve_whole(KeptKind& kind, Problem& problem, Solution& solution, bool warm_start) {
    PartResult result;
    solve_part(kind, problem, solution, warm_start, 0, {}, settings.team, result);
    std::ranges::fill(left, result.natural);
    std::ranges::fill(left_in_masses, result.in_masses);
    return take(result);
}

// A part that is more than a thread's share of the step is solved by all threads together. The others are dealt out,
// the largest first. Parts that have the same solver follow one another: a chain. What a part's solution is depends on
// neither. On several processes all of them solve the same part at the same time.
bool StepSolver::Implementation::solve_parts(KeptKind& kind, std::span<const Island> list, bool warm_start) {
    constexpr std::int64_t worth_sharing = 96, worth_a_team = 2048;  // rows
    results.assign(list.size(), {});
    const auto solve = [&](std::size_t number, const std::shared_ptr<ThreadTeam>& threads) {
        KeptPart& part = kind.parts[number];
        islands.take(list[number], start, part.solution);
        islands.part(list[number], part.data);
        solve_part(kind, part.data, part.solution, warm_start, number, list[number].columns, threads, results[number]);
    };
    const sdk::Team team = settings.team ? settings.team->team() : sdk::Team();
    std::int64_t rows = 0, shared = 0;
    for (std::size_t number = 0; number < list.size(); ++number)
        if (!kind.parts[number].rests) rows += islands.rows(list[number]);
    chains.assign(std::min(list.size(), most_instances), {});
    for (std::size_t number = 0; number < list.size(); ++number) {
        KeptPart& part = kind.parts[number];
        const std::int64_t own = islands.rows(list[number]);
        const bool alone = team.size() == 1 || process_count() > 1;
        part.waits = !part.rests && !alone && !(own >= worth_a_team && own * team.size() > rows);
        if (!part.waits && !part.rests) solve(number, settings.team);
        if (!part.waits) continue;
        if (own > 0) static_cast<void>(instance(kind, number));
        chains[number % most_instances].rows += own;
        shared += own;
    }
    for (std::size_t k = 0; k < chains.size(); ++k) chains[k].first = k;
    std::ranges::sort(chains, std::greater{}, &Chain::rows);
    team.if_worth(shared >= worth_sharing).for_each(chains.size(), [&](std::size_t k) {
        for (std::size_t number = chains[k].first; number < list.size(); number += most_instances)
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

bool StepSolver::Implementation::take(const PartResult& result) {
    const SolverEffort& part = result.effort;
    effort.plugin_solves += part.plugin_solves;
    effort.iterations += part.iterations;
    effort.seconds += part.seconds;
    effort.repeated += part.repeated;
    effort.near_goal += part.near_goal;
    effort.worst_natural = std::max(effort.worst_natural, part.worst_natural);
    effort.worst_miss = std::max(effort.worst_miss, part.worst_miss);
    if (effort.unsolved.empty()) effort.unsolved = part.unsolved;
    return result.solved;
}

void StepSolver::Implementation::solve_part(KeptKind& kind, Problem& problem, Solution& solution, bool warm_start,
                                            std::size_t number, std::span<const std::int32_t> columns,
                                            const std::shared_ptr<ThreadTeam>& threads, PartResult& result) {
    SolverEffort& spent = result.effort;
    auto& kept = part(kind, number).prepared;
    if (!kept) {
        kept.emplace(std::move(problem), also_needs);
        problem = {};
        kept->use(threads ? threads->team() : sdk::Team());
    } else {
        kept->use(threads ? threads->team() : sdk::Team());
        kept->renew(std::move(problem));
    }
    const PreparedProblem& prepared = *kept;
    if (settings.cancelled && settings.cancelled()) throw StepInterrupted("the step was interrupted");
    if (leaves_out && prepared.problem().m() == 0) {
        const auto structure = prepared.structure();
        const bool definite = structure == Structure::Diagonal || structure == Structure::Blocks ||
                              structure == Structure::Definite || structure == Structure::Reduced;
        if (definite) {
            prepared.meter().velocity_of({}, solution.x);
        } else {
            part(kind, number).factor.solve(sdk::ProblemView(prepared.raw()), prepared.raw(), solution.x);
        }
        solution.lambda.clear();
        return;
    }
    constexpr double suspicious = 1e-5, rounding_of_motion = 1e-13;
    const double share = share_of_rows(prepared);
    if (leaves_out && share < suspicious && rows_feel_nothing(prepared, solution)) return;
    Instance& by = instance(kind, number);
    Solver& solver = by.solver;
    SolveSettings part_settings = settings;
    part_settings.team = threads;
    const PartTraits traits{prepared.needs(), amplification_of(prepared.problem().cones, prepared.problem().law)};
    set_step_tolerance(config, traits, goal_for(prepared, traits, columns), part_settings);
    if (share < suspicious) {
        const double least = rounding_of_motion / share;
        part_settings.tolerance = std::max(part_settings.tolerance, least);
        if (part_settings.loosest > 0.0) part_settings.loosest = std::max(part_settings.loosest, least);
    }
    part_settings.warm_start = warm_start && (solver.info().capabilities & DELASSUS_CAN_WARM_START) != 0;
    const bool may_repeat = config.name != auto_name && !config.sweeps;
    if (may_repeat && part_settings.warm_start) by.before = solution;
    SolveReport report;
    try {
        report = solver.solve(prepared, solution, part_settings);
    } catch (const Unsupported& refusal) {
        // Of linear problems others may take such an H; the refusal names them.
        const auto& cones = prepared.problem().cones;
        const bool linear = std::ranges::all_of(cones, [](const Cone& cone) { return cone.kind == ConeKind::Free; });
        if (linear || (prepared.needs() & DELASSUS_CAN_H_INDEFINITE) == 0) throw;
        throw IndefiniteStep(refusal.what());
    }
    if (settings.cancelled && report.status == Status::Cancelled) throw StepInterrupted("the step was interrupted");
    ++spent.plugin_solves;
    by.count(report, spent);
    const auto done = [&] {
        return report.status == Status::Solved || report.near_goal ||
               (config.sweeps && report.status == Status::IterationLimit);
    };
    // Beside reactions that grow without bound, as where two bodies squeeze a third, every velocity is rounding, and
    // all measures that add the two are small.
    const auto count_rounding = [&] {
        if (!done())
            report.error.balance =
                std::max(report.error.balance, rounding_of_balance(prepared.problem(), solution).reactions);
    };
    count_rounding();
    if (!done() && (is_rounding(report.error) || moves_freely(prepared, solution))) return;
    if (!done() && may_repeat) solve_again(prepared, by, part_settings, solution, report, spent);
    count_rounding();
    if (!done()) report.near_goal = last_resort(config, traits, part_settings, report);
    result.natural = report.error.natural;
    result.in_masses = report.error.natural * prepared.meter().reference();
    spent.worst_natural = std::max(spent.worst_natural, report.error.natural);
    if (report.near_goal) ++spent.near_goal;
    if (done()) return;
    result.solved = false;
    spent.worst_miss =
        std::max(spent.worst_miss, worst_of(report.error) / std::max(part_settings.tolerance, rounding_limit_of_steps));
    if (spent.unsolved.empty())
        spent.unsolved =
            fmt::format("{} ended with {} at a natural error of {:.1e}{}{}", report.solver, name_of(report.status),
                        report.error.natural, report.message.empty() ? "" : ": ", report.message);
}

// What dry friction stops loses a share of its speed in each step that is as small as the tolerance, until the squares
// of all numbers vanish and no error can be measured any more. Far above that it counts as rest.
bool StepSolver::Implementation::is_at_rest(const Problem& problem) {
    constexpr double nothing = 1e-100;
    const auto vanish = [](std::span<const double> values) {
        return std::all_of(values.begin(), values.end(), [](double value) { return std::abs(value) < nothing; });
    };
    return vanish(problem.a) && vanish(problem.b) && hold_zero(problem.cones);
}

bool StepSolver::Implementation::hold_zero(std::span<const Cone> cones) {
    return std::ranges::all_of(cones, [](const Cone& cone) {
        return std::ranges::all_of(cone.lo, [](double bound) { return bound <= 0.0; }) &&
               std::ranges::all_of(cone.hi, [](double bound) { return bound >= 0.0; });
    });
}

// A mechanism that falls freely does not move its rows, whether they are joints or contacts between its bodies. What
// D x + b is then comes from the rounding of x = H⁻¹ a, and errors relative to it say nothing. |S D x| ≤ √m ‖x‖_H with
// ‖x‖_H = √(aᵀx), of which √(aᵀ diag(H)⁻¹ a) is a first guess. Rows that move by less than 10⁻¹² of that are still.
double StepSolver::Implementation::share_of_rows(const PreparedProblem& part) {
    const Problem& problem = part.problem();
    double twice_energy = 0.0;
    for (std::int32_t i = 0; i < problem.H.rows; ++i)
        if (const double mass = entry_of(problem.H, i, i); mass > 0.0)
            twice_energy += problem.a[i] * problem.a[i] / mass;
    return twice_energy > 0.0 ? part.meter().reference() / std::sqrt(problem.m() * twice_energy) : 1.0;
}

bool StepSolver::Implementation::rows_feel_nothing(const PreparedProblem& part, Solution& solution) {
    constexpr double rounding = 1e-12;
    const Problem& problem = part.problem();
    const Structure structure = part.structure();
    if (structure != Structure::Diagonal && structure != Structure::Blocks && structure != Structure::Definite)
        return false;
    if (!hold_zero(problem.cones)) return false;
    Solution free;
    free.lambda.assign(static_cast<std::size_t>(problem.m()), 0.0);
    part.meter().velocity_of(free.lambda, free.x);
    const double twice_energy = std::inner_product(free.x.begin(), free.x.end(), problem.a.begin(), 0.0);
    if (!(part.meter().reference() <= rounding * std::sqrt(problem.m() * std::max(twice_energy, 0.0)))) return false;
    solution = std::move(free);
    return true;
}

bool StepSolver::Implementation::moves_freely(const PreparedProblem& part, Solution& solution) {
    const Structure structure = part.structure();
    if (structure != Structure::Diagonal && structure != Structure::Blocks && structure != Structure::Definite)
        return false;
    Solution free;
    free.lambda.assign(solution.lambda.size(), 0.0);
    if (is_at_rest(part.problem())) {
        free.x.assign(static_cast<std::size_t>(part.problem().n()), 0.0);
        solution = std::move(free);
        return true;
    }
    part.meter().velocity_of(free.lambda, free.x);
    const Errors error = part.meter().measure(free.x, free.lambda);
    constexpr double no_digits = 1e-3;  // of rounding: what is measured has three digits at most
    if (!(error.rounding > no_digits && rows_are_rounding(error))) return false;
    solution = std::move(free);
    return true;
}

void Instance::count(const SolveReport& report, SolverEffort& effort) {
    if (report.stages.empty() && report.solver != auto_name) loaded.insert(report.solver);
    for (const auto& stage : report.stages) loaded.insert(stage.solver);
    effort.iterations += report.iterations;
    effort.seconds += report.seconds_setup + report.seconds_solve;
}

void StepSolver::Implementation::solve_again(const PreparedProblem& prepared, Instance& by, SolveSettings again,
                                             Solution& solution, SolveReport& report, SolverEffort& spent) const {
    if (!by.fallback) {
        SolverConfig other = config;
        other.name = auto_name;
        other.options = {{"simulation", "true"}};
        by.fallback = make_solver(registry, other);
    }
    again.max_iterations = SolveSettings{}.max_iterations;
    Solution other = again.warm_start ? by.before : Solution{};
    SolveReport second = by.fallback->solve(prepared, other, again);
    if (settings.cancelled && second.status == Status::Cancelled) throw StepInterrupted("the step was interrupted");
    by.count(second, spent);
    ++spent.repeated;
    if (second.status != Status::Solved && !(second.error.natural < report.error.natural)) return;
    solution = std::move(other);
    report = std::move(second);
}

std::optional<double> StepSolver::Implementation::goal_for(const PreparedProblem& part, const PartTraits& traits,
                                                           std::span<const std::int32_t> columns) const {
    if (!follows_method()) return {};
    const Problem& problem = part.problem();
    std::vector<double> errors(static_cast<std::size_t>(problem.H.rows));
    double square = 0.0, of_solves = 0.0;
    for (std::int32_t i = 0; i < problem.H.rows; ++i) {
        const auto column = static_cast<std::size_t>(columns.empty() ? i : columns[i]);
        const double error = method_error[column];
        errors[static_cast<std::size_t>(i)] = error;
        if (error != 0.0) square += entry_of(problem.H, i, i) * error * error;
        if (!error_of_solves.empty()) of_solves = std::max(of_solves, error_of_solves[column]);
    }
    // What solves left is known as a bound: a quarter of what is seen counts as the method's in any case.
    const auto of_method = [of_solves](double all) {
        return std::max(0.25 * all, std::sqrt(std::max(0.0, (all - of_solves) * (all + of_solves))));
    };
    return goal_of({.in_masses = of_method(std::sqrt(std::abs(square))),
                    .in_rows = of_method(part.meter().norm_in_rows(errors)),
                    .reference = part.meter().reference(),
                    .rows = static_cast<double>(problem.m())},
                   traits);
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
    const auto choice = auto_choice(implementation_->registry, config.options, needs);
    return choice.first.empty() ? std::string() : choice.first.front();
}

void StepSolver::use(std::shared_ptr<ThreadTeam> threads) {
    implementation_->settings.team = std::move(threads);
}
sdk::Team StepSolver::team() const {
    const auto& threads = implementation_->settings.team;
    return threads ? threads->team() : sdk::Team();
}

bool StepSolver::on_all(bool own) const {
    return shared ? shared->on_all(own) : own;
}
double StepSolver::largest_on_all(double own) const {
    return shared ? shared->largest_on_all(own) : own;
}
const SolverConfig& StepSolver::config() const {
    return implementation_->config;
}

std::span<const double> StepSolver::left() const {
    return implementation_->left;
}

std::span<const double> StepSolver::left_in_masses() const {
    return implementation_->left_in_masses;
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
std::vector<std::string> StepSolver::loaded() const {
    std::set<std::string> names;
    for (const KeptKind& kind : implementation_->kinds)
        for (const Instance& instance : kind.instances) names.insert(instance.loaded.begin(), instance.loaded.end());
    if (shared) names.insert(shared->loaded().begin(), shared->loaded().end());
    return {names.begin(), names.end()};
}

}  // namespace delassus
