// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/step_solver.hpp"

#include <fmt/format.h>

#include <Eigen/SparseLU>
#include <algorithm>
#include <deque>
#include <optional>
#include <set>

#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"
#include "dynamics/islands.hpp"
#include "solver/auto_solver.hpp"

namespace delassus {

namespace {

/// x = H⁻¹ a for an H that is not definite: LU with partial pivoting. Throws StepSolver's sentence if H is singular.
std::vector<double> solve_by_lu(const PreparedProblem& problem) {
    const sdk::ProblemView view(problem.raw());
    const Eigen::SparseLU<sdk::SparseColumns> factor{sdk::SparseColumns(view.H)};
    if (factor.info() != Eigen::Success) throw InputError("H is singular, and no constraint holds what it leaves free");
    const sdk::Vector x = factor.solve(view.a);
    return {x.begin(), x.end()};
}

}  // namespace

/// What is kept of a part of the problem from one step to the next.
struct KeptPart {
    Problem data;  // unused where the whole problem is one part
    std::optional<PreparedProblem> prepared;
    Solution solution;
};

/// What is kept of the problems of one name: a method that solves several kinds of problems in a step finds its own
/// pattern again.
struct KeptKind {
    std::string name;
    Problem given;                // a copy of what solve() must not change
    std::deque<KeptPart> parts;   // by the number of the part
    std::vector<Solver> solvers;  // instances by the number of the part
};

struct StepSolver::Implementation {
    Implementation(const Registry& known, SolverConfig chosen)
        : registry(known), config(std::move(chosen)), settings(config.settings()) {
        if (config.name.empty()) config.name = auto_name;
        if (config.name == auto_name) config.options.try_emplace("simulation", "true");
    }

    KeptKind& kind(const std::string& name) {
        for (KeptKind& known : kinds)
            if (known.name == name) return known;
        kinds.emplace_back().name = name;
        return kinds.back();
    }
    Solver& solver(KeptKind& kind, std::size_t instance) {
        while (kind.solvers.size() <= instance) kind.solvers.push_back(make_solver(registry, config));
        return kind.solvers[instance];
    }

    /// Takes the arrays of the problem and leaves others.
    /// columns: of the part in the whole problem.
    bool solve_part(KeptKind& kind, Problem& problem, Solution& solution, bool warm_start, std::size_t number,
                    std::span<const std::int32_t> columns);
    /// Of a part, where the method makes this error: see docs/tolerance.md.
    [[nodiscard]] double tolerance_for(const PreparedProblem& part, std::span<const std::int32_t> columns) const;
    /// Solves with `auto` what the configured solver left at `report`, from the start `first`; the better answer is in
    /// solution, what it is worth in report.
    void solve_again(const PreparedProblem& prepared, const Solution& first, SolveSettings again, Solution& solution,
                     SolveReport& report);
    void count(const SolveReport& report);
    /// Whether the velocities without reactions vanish in rounding, so that no reactions are the answer: what recovers
    /// a penetration at constant speed is such a case. Errors relative to them say nothing. solution: that answer then.
    static bool moves_freely(const PreparedProblem& part, Solution& solution);
    /// Whether x = 0 without reactions is the answer, but for numbers too small to be squared.
    static bool is_at_rest(const Problem& problem);

    /// Tolerances below this are beyond what rounding allows in some problems: missing them is no miss by orders.
    static constexpr double rounding_limit = 1e-8;
    /// Parts beyond so many share instances; it bounds the memory.
    static constexpr std::size_t most_instances = 64;

    const Registry& registry;
    bool leaves_out = true;
    std::uint64_t also_needs = 0;  ///< of every problem, where nothing is left out
    SolverConfig config;
    SolveSettings settings;
    std::deque<KeptKind> kinds;      // few
    std::optional<Solver> fallback;  // `auto`, where the configured solver is another
    Solution before;                 // the start of the part that is solved
    std::set<std::string> loaded;
    Islands islands;
    Solution start;
    std::span<const double> method_error;
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

// The parts of a problem are solved one by one, each by a solver instance of its own: the k-th part of a step is, as
// long as bodies keep their neighbours, the k-th of the next, and what was prepared and analysed for it is used again.
bool StepSolver::solve(Problem&& problem, Solution& solution, bool warm_start) {
    auto& self = *implementation_;
    problem.law = law();
    if (on_problem) on_problem(problem);
    self.settings.cancelled = cancelled;
    self.method_error = method_error;
    ++self.effort.solves;
    const auto n = static_cast<std::size_t>(problem.n()), m = static_cast<std::size_t>(problem.m());
    KeptKind& kind = self.kind(problem.name);
    warm_start = warm_start && solution.x.size() == n && solution.lambda.size() == m;
    if (!self.leaves_out || m == 0 || !Islands::can_part(problem))
        return self.solve_part(kind, problem, solution, warm_start, 0, {});

    self.islands.find(problem, resting ? resting->bodies() : std::span<const std::int32_t>{});
    const auto list = self.islands.list();
    if (!resting && list.size() == 1 && list[0].cones.size() == problem.cones.size())
        return self.solve_part(kind, problem, solution, warm_start, 0, {});
    if (!warm_start) {
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }
    self.start = solution;
    std::fill(solution.lambda.begin(), solution.lambda.end(), 0.0);  // of rows that belong to no part
    bool solved = true;
    for (std::size_t number = 0; number < list.size(); ++number) {
        if (number == kind.parts.size()) kind.parts.emplace_back();
        KeptPart& part = kind.parts[number];
        self.islands.take(list[number], self.start, part.solution);
        const std::uint64_t identity = resting && !list[number].cones.empty() ? self.islands.identity(list[number]) : 0;
        if (identity != 0 && resting->rests(list[number].columns, identity)) {
            std::fill(part.solution.x.begin(), part.solution.x.end(), 0.0);
            ++self.effort.resting_parts;
        } else {
            self.islands.part(list[number], part.data);
            solved =
                self.solve_part(kind, part.data, part.solution, warm_start, number, list[number].columns) && solved;
            if (identity != 0) resting->solved(list[number].columns, identity, part.solution.x);
        }
        self.islands.put(list[number], part.solution, solution);
    }
    return solved;
}

bool StepSolver::Implementation::solve_part(KeptKind& kind, Problem& problem, Solution& solution, bool warm_start,
                                            std::size_t number, std::span<const std::int32_t> columns) {
    if (number == kind.parts.size()) kind.parts.emplace_back();
    auto& kept = kind.parts[number].prepared;
    if (!kept) {
        kept.emplace(std::move(problem), also_needs);
        problem = {};
    } else {
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
            solution.x = solve_by_lu(prepared);
        }
        solution.lambda.clear();
        return true;
    }
    Solver& solver = this->solver(kind, number % most_instances);
    SolveSettings part_settings = settings;
    part_settings.tolerance = tolerance_for(prepared, columns);
    part_settings.warm_start = warm_start && (solver.info().capabilities & DELASSUS_CAN_WARM_START) != 0;
    const bool may_repeat = config.name != auto_name && !config.sweeps;
    if (may_repeat && part_settings.warm_start) before = solution;
    SolveReport report = solver.solve(prepared, solution, part_settings);
    if (settings.cancelled && report.status == Status::Cancelled) throw StepInterrupted("the step was interrupted");
    ++effort.plugin_solves;
    count(report);
    const auto done = [&] {
        return report.status == Status::Solved || (config.sweeps && report.status == Status::IterationLimit);
    };
    if (!done() && moves_freely(prepared, solution)) return true;
    if (!done() && may_repeat) solve_again(prepared, before, part_settings, solution, report);
    effort.worst_natural = std::max(effort.worst_natural, report.error.natural);
    if (done()) return true;
    effort.worst_miss = std::max(effort.worst_miss, std::max(report.error.natural, report.error.balance) /
                                                        std::max(part_settings.tolerance, rounding_limit));
    if (effort.unsolved.empty())
        effort.unsolved =
            fmt::format("{} ended with {} at a natural error of {:.1e}{}{}", report.solver, name_of(report.status),
                        report.error.natural, report.message.empty() ? "" : ": ", report.message);
    return false;
}

// What dry friction stops loses a share of its speed in each step that is as small as the tolerance, until the squares
// of all numbers vanish and no error can be measured any more. Far above that it counts as rest.
bool StepSolver::Implementation::is_at_rest(const Problem& problem) {
    constexpr double nothing = 1e-100;
    const auto vanish = [](const std::vector<double>& values) {
        return std::all_of(values.begin(), values.end(), [](double value) { return std::abs(value) < nothing; });
    };
    const auto hold_zero = [](const Cone& cone) {
        return std::all_of(cone.lo.begin(), cone.lo.end(), [](double bound) { return bound <= 0.0; }) &&
               std::all_of(cone.hi.begin(), cone.hi.end(), [](double bound) { return bound >= 0.0; });
    };
    return vanish(problem.a) && vanish(problem.b) && std::all_of(problem.cones.begin(), problem.cones.end(), hold_zero);
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
    if (!(error.rounding > no_digits && error.natural <= 32.0 * error.rounding)) return false;
    solution = std::move(free);
    return true;
}

void StepSolver::Implementation::count(const SolveReport& report) {
    if (report.stages.empty() && report.solver != auto_name) loaded.insert(report.solver);
    for (const auto& stage : report.stages) loaded.insert(stage.solver);
    effort.iterations += report.iterations;
    effort.seconds += report.seconds_setup + report.seconds_solve;
}

void StepSolver::Implementation::solve_again(const PreparedProblem& prepared, const Solution& first,
                                             SolveSettings again, Solution& solution, SolveReport& report) {
    if (!fallback) {
        SolverConfig other = config;
        other.name = auto_name;
        other.options = {{"simulation", "true"}};
        fallback = make_solver(registry, other);
    }
    again.max_iterations = SolveSettings{}.max_iterations;
    Solution other = again.warm_start ? first : Solution{};
    SolveReport second = fallback->solve(prepared, other, again);
    if (settings.cancelled && second.status == Status::Cancelled) throw StepInterrupted("the step was interrupted");
    count(second);
    ++effort.repeated;
    if (second.status != Status::Solved && !(second.error.natural < report.error.natural)) return;
    solution = std::move(other);
    report = std::move(second);
}

double StepSolver::Implementation::tolerance_for(const PreparedProblem& part,
                                                 std::span<const std::int32_t> columns) const {
    constexpr double share = 0.5, least = 1e-8, most = 1e-2, most_with_joints = 1e-4;
    if (config.tolerance || config.sweeps || method_error.empty()) return settings.tolerance;
    const Problem& problem = part.problem();
    double square = 0.0;
    for (std::int32_t i = 0; i < problem.H.rows; ++i) {
        const double error = method_error[static_cast<std::size_t>(columns.empty() ? i : columns[i])];
        if (error == 0.0) continue;
        for (auto e = problem.H.row_start[i]; e < problem.H.row_start[i + 1]; ++e)
            if (problem.H.column[e] == i) square += problem.H.value[e] * error * error;
    }
    const bool joints = (part.needs() & DELASSUS_CAN_FREE) != 0;
    return std::clamp(share * std::sqrt(std::abs(square)) / part.meter().reference(), least,
                      joints ? most_with_joints : most);
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
    const auto choice =
        auto_choice(implementation_->registry, config.options, needs, implementation_->settings.tolerance);
    return choice.first.empty() ? std::string() : choice.first.front();
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
    return {implementation_->loaded.begin(), implementation_->loaded.end()};
}

}  // namespace delassus
