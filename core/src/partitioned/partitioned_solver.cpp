// SPDX-License-Identifier: BSD-3-Clause
// Solving with a plugin that takes partitioned problems, on all processes together.
#include "delassus/partitioned_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <map>

#include "delassus/error.hpp"
#include "partitioned/alone.hpp"
#include "partitioned/part_meter.hpp"
#include "partitioned/part_proof.hpp"
#include "partitioned/prepared_part.hpp"
#include "solver/acceptance.hpp"
#include "solver/auto_solver.hpp"
#include "solver/finished_solver.hpp"
#include "solver/judgement.hpp"
#include "solver/plugin_instance.hpp"
#include "solver/ranking.hpp"
#include "solver/rounds.hpp"
#include "solver/solver_implementation.hpp"
#include "support/finite.hpp"
#include "support/sentence.hpp"

namespace delassus {

namespace {

using Clock = Stopwatch::Clock;

/// Processes agree about so often on the time and on cancelling, in seconds; every time costs a reduction.
constexpr double seconds_between_agreements = 0.02;

/// The context of the progress callback on one process. All processes call it for the same iterations.
class PartListener {
public:
    PartListener(const PreparedPart& problem, const SolveSettings& settings, SolveReport& report, Stopwatch& watch,
                 ForeignCall& call)
        : problem_(problem), settings_(settings), report_(report), watch_(watch), call_(call) {}

    // The border: nothing is thrown through the plugin. A process that cannot go on ends the run of all, since the
    // others wait for it.
    static std::int32_t callback(void* context, std::int64_t iteration, const double* x,
                                 const double* lambda) noexcept {
        auto& self = *static_cast<PartListener*>(context);
        if (iteration < self.next_ && !self.settings_.give_up) {
            self.report_.iterations = iteration;
            return DELASSUS_CONTINUE;
        }
        try {
            const bool give_up = self.settings_.give_up && self.settings_.give_up(iteration, x, lambda);
            self.watch_.stop();
            const auto answer = self.hear(iteration, x, lambda, give_up);
            self.watch_.start();
            if (answer == DELASSUS_CONTINUE) self.call_.renew();
            return answer;
        } catch (const std::exception& error) {
            fail_alone(self.problem_.communicator(), sentence_of(error));
        }
    }

    [[nodiscard]] bool given_up() const { return given_up_; }

private:
    std::int32_t hear(std::int64_t iteration, const double* x, const double* lambda, bool give_up) {
        report_.iterations = iteration;
        std::array<double, 3> agreed = {report_.seconds_setup + watch_.seconds(), give_up ? 1.0 : 0.0,
                                        settings_.cancelled && settings_.cancelled() ? 1.0 : 0.0};
        problem_.communicator().max(agreed);
        const double seconds = agreed[0];
        given_up_ = given_up_ || agreed[1] > 0.0;
        if (settings_.record_curve && seconds >= next_sample_) {
            const CurveSample sample{iteration, seconds, problem_.natural(x, lambda)};
            next_sample_ = seconds * sample_spacing;
            if (std::isfinite(sample.natural)) {
                report_.curve.push_back(sample);
                if (settings_.on_sample) settings_.on_sample(sample);
            }
        }
        if (settings_.on_progress && Clock::now() >= next_display_) {
            settings_.on_progress(report_.curve.empty() ? CurveSample{iteration, seconds, NAN} : report_.curve.back());
            next_display_ = Clock::now() + std::chrono::milliseconds(100);
        }
        plan_next(iteration, seconds);
        if (agreed[2] > 0.0 || given_up_) return DELASSUS_STOP_CANCEL;
        return seconds >= settings_.time_limit ? DELASSUS_STOP_TIME : DELASSUS_CONTINUE;
    }

    /// From agreed numbers alone, so that all processes plan the same.
    void plan_next(std::int64_t iteration, double seconds) {
        const std::int64_t done = iteration - last_;
        const double each = done > 0 ? (seconds - last_seconds_) / static_cast<double>(done) : 1.0;
        const double wanted = seconds_between_agreements / std::max(each, 1e-9);
        stride_ = std::clamp<std::int64_t>(static_cast<std::int64_t>(wanted), 1, 2 * stride_);
        last_ = iteration;
        last_seconds_ = seconds;
        next_ = iteration + stride_;
    }

    const PreparedPart& problem_;
    const SolveSettings& settings_;
    SolveReport& report_;
    Stopwatch& watch_;
    ForeignCall& call_;
    double next_sample_ = 0.0, last_seconds_ = 0.0;
    std::int64_t next_ = 0, last_ = 0, stride_ = 1;
    Clock::time_point next_display_ = Clock::now();
    bool given_up_ = false;
};

/// What one stage does not tell, the sum does not know.
void add(SolveCost& total, const SolveCost& stage) {
    total.setup += stage.setup;
    total.solve += stage.solve;
    for (std::size_t k = 0; k < total.phases.size(); ++k) total.phases[k] += stage.phases[k];
    total.bytes_sent = total.bytes_sent < 0 || stage.bytes_sent < 0 ? -1 : total.bytes_sent + stage.bytes_sent;
}

/// A solver's clock runs on while the core looks at an iterate, which does not count, and it may estimate phases from a
/// part of the iterations. Its phases are shares of the core's time at most.
void fit_phases(SolveCost& cost) {
    double sum = 0.0;
    for (const double seconds : cost.phases)
        if (std::isfinite(seconds)) sum += seconds;
    if (!(sum > cost.solve)) return;
    for (double& seconds : cost.phases) seconds *= cost.solve / sum;
}

std::string quoted_name(const PreparedPart& problem) {
    const std::string& name = problem.problem().name;
    return name.empty() ? "the problem" : fmt::format("\"{}\"", name);
}

}  // namespace

struct PartitionedSolver::Implementation {
    const Registry& registry;
    SolverConfig config;
    std::shared_ptr<const Communicator> communicator;
    std::unique_ptr<PluginInstance> instance;  // or, for auto:
    std::unique_ptr<Ranking> ranking;
    bool simulation = false;  // by which of its rules
    PluginInfo info_of_auto;
    std::map<std::pair<std::string, OptionTexts>, PartitionedSolver> solvers;
    bool analyzed = false;
    std::uint64_t pattern_id = 0, values_id = 0;
    SolveCost cost = {};
    SetUpCounts own_counts = {};  // of the instance, at its last solve

    [[nodiscard]] SetUpCounts counts() const {
        SetUpCounts sum = own_counts;
        for (const auto& [key, solver] : solvers) sum += solver.implementation_->counts();
        return sum;
    }

    /// How a collective operation of the plugin ended; a sentence of the first process on which it failed, if it did.
    struct Ending {
        std::int32_t status = DELASSUS_SOLVED;
        std::string sentence;
    };
    /// The processes agree on it. own: how it ended on this one.
    Ending agree(std::int32_t own) {
        const bool failed = own == DELASSUS_ERROR || own == DELASSUS_NUMERICAL_FAILURE;
        const std::string sentence =
            failed ? fmt::format("{}: {}", instance->info().name, instance->last_error()) : std::string();
        std::vector<std::int64_t> statuses;
        if (failed) {
            const AloneAlarm alarm(*communicator, sentence);
            statuses = communicator->all(own);
        } else {
            statuses = communicator->all(own);
        }
        for (int rank = 0; rank < communicator->size(); ++rank) {
            const auto status = static_cast<std::int32_t>(statuses[static_cast<std::size_t>(rank)]);
            if (status == DELASSUS_ERROR || status == DELASSUS_NUMERICAL_FAILURE)
                return {status, communicator->broadcast(sentence, rank)};
        }
        for (const auto status : statuses)
            if (status != statuses.front())
                return {DELASSUS_ERROR,
                        fmt::format("{} ended as {} on one process and as {} on another", instance->info().name,
                                    name_of(status_of(static_cast<std::int32_t>(statuses.front()))),
                                    name_of(status_of(static_cast<std::int32_t>(status))))};
        return {own, {}};
    }

    /// Renews the analysis and the factorisation as far as the problem's identity asks.
    Ending set_up(const delassus_local_problem& raw, double limit) {
        if (analyzed && pattern_id == raw.pattern_id && values_id == raw.values_id) return {};
        if (!analyzed || pattern_id != raw.pattern_id) {
            analyzed = false;
            auto ending = agree(instance->guarded(
                "analyze", [&] { return instance->border().analyze_partitioned(instance->get(), &raw); }, limit));
            if (ending.status != DELASSUS_SOLVED) return ending;
        }
        analyzed = false;
        auto ending = agree(instance->guarded(
            "factorize", [&] { return instance->border().factorize_partitioned(instance->get(), &raw); }, limit));
        analyzed = ending.status == DELASSUS_SOLVED;
        pattern_id = raw.pattern_id;
        values_id = raw.values_id;
        return ending;
    }

    void solve_with_plugin(const PreparedPart& problem, Solution& own, const SolveSettings& settings,
                           SolveReport& report);
    /// All solvers that can, in rounds (solver/rounds.hpp).
    void solve_in_rounds(const PreparedPart& problem, Solution& own, const SolveSettings& settings,
                         SolveReport& report);
    /// The solver of a member of `auto`, made when it is first needed.
    PartitionedSolver& member(const RankedSolver& ranked);
    [[nodiscard]] const Order& order_of(const PreparedPart& problem) const {
        const auto rows = std::min<std::int64_t>(problem.raw().m_all, std::numeric_limits<std::int32_t>::max());
        return ranking->order({problem.needs(), simulation}, static_cast<std::int32_t>(rows));
    }
};

PartitionedSolver::PartitionedSolver(const Registry& registry, SolverConfig config,
                                     std::shared_ptr<const Communicator> communicator)
    : implementation_(new Implementation{registry, std::move(config), std::move(communicator), {}, {}, false, {}, {}}) {
    auto& self = *implementation_;
    together(*self.communicator, [&] {
        OptionTexts options = self.config.options;
        if (!take_finish(options).solver.empty())
            throw InputError("a partitioned problem is solved by one solver; leave out the option \"finish\"");
        if (self.config.name == auto_name) {
            self.ranking = std::make_unique<Ranking>(ranking_of(registry, options));
            self.simulation = of_steps(registry, options);
            self.info_of_auto = auto_info(registry);
            return;
        }
        self.instance = std::make_unique<PluginInstance>(registry.load(self.config.name), options);
    });
}

PartitionedSolver::~PartitionedSolver() = default;
PartitionedSolver::PartitionedSolver(PartitionedSolver&&) noexcept = default;
PartitionedSolver& PartitionedSolver::operator=(PartitionedSolver&&) noexcept = default;

const PluginInfo& PartitionedSolver::info() const {
    return implementation_->instance ? implementation_->instance->info() : implementation_->info_of_auto;
}

const SolveCost& PartitionedSolver::cost() const {
    return implementation_->cost;
}

std::string PartitionedSolver::refusal(const PreparedPart& problem, const SolveSettings& settings) const {
    std::uint64_t needs = problem.needs();
    if (const auto& self = *implementation_; self.ranking) {
        if (!unnamed(self.registry, needs).empty()) return {};
        for (const auto& ranked : self.order_of(problem).solvers)
            if (can(self.registry, ranked.solver, needs)) return {};
        return fmt::format("auto cannot solve {}: no installed solver can take {}.", quoted_name(problem),
                           problem.describe(needs));
    }
    if (settings.warm_start) needs |= DELASSUS_CAN_WARM_START;
    const auto missing = info().missing(needs);
    if (missing == 0) return {};
    return fmt::format("{} cannot solve {}: {}{}.", info().name, quoted_name(problem), problem.describe(missing),
                       who_can(implementation_->registry, needs));
}

void PartitionedSolver::Implementation::solve_with_plugin(const PreparedPart& problem, Solution& own,
                                                          const SolveSettings& settings, SolveReport& report) {
    const auto& raw = problem.raw();
    const auto& border = instance->border();
    if (border.use_team) {
        const sdk::Team team = settings.team ? settings.team->team() : sdk::Team();
        instance->guarded("use_team", [&] { return border.use_team(instance->get(), team.raw()), DELASSUS_SOLVED; });
    }
    Stopwatch setup, watch;
    setup.start();
    Ending ending = set_up(raw, limit_of_calls(settings));
    setup.stop();
    cost = {};
    cost.setup = setup.seconds();
    std::array<double, 2> seconds = {cost.setup, 0.0};
    communicator->max(seconds);
    report.seconds_setup = seconds[0];

    delassus_outcome outcome{};
    outcome.struct_size = sizeof outcome;
    outcome.residual = NAN;
    outcome.phase_seconds = cost.phases.data();
    outcome.phase_count = DELASSUS_PHASE_COUNT;
    outcome.bytes_sent = -1;
    bool given_up = false;
    std::string message;
    if (ending.status == DELASSUS_SOLVED) {
        ForeignCall call(instance->who(), "in solve", limit_of_calls(settings));
        PartListener listener(problem, settings, report, watch, call);
        const delassus_request request{
            sizeof request,      settings.warm_start ? 1 : 0, settings.tolerance, settings.max_iterations,
            settings.time_limit, &PartListener::callback,     &listener};
        watch.start();
        ending = agree(instance->guarded([&] {
            return border.solve_partitioned(instance->get(), &raw, &request, own.x.data(), own.lambda.data(), &outcome);
        }));
        watch.stop();
        if (ending.status != DELASSUS_ERROR) {
            report.iterations = outcome.iterations;
            own_counts = {outcome.analyses, outcome.factorizations};
        }
        if (outcome.message) message = outcome.message;
        given_up = listener.given_up();
    }
    cost.bytes_sent = outcome.bytes_sent;
    seconds[1] = cost.solve = watch.seconds();
    fit_phases(cost);
    communicator->max(seconds);
    report.seconds_solve = seconds[1];
    report.claimed_residual = outcome.residual;
    report.status = status_of(ending.status);
    if (given_up && report.status == Status::Cancelled) report.status = Status::Stalled;
    report.message = communicator->broadcast(message);
    if (!ending.sentence.empty()) report.message = ending.sentence;
    if (settings.record_curve)
        report.curve.push_back({report.iterations, report.seconds_setup + report.seconds_solve, NAN});
}

PartitionedSolver& PartitionedSolver::Implementation::member(const RankedSolver& ranked) {
    auto place = solvers.find({ranked.solver, ranked.options});
    if (place != solvers.end()) return place->second;
    SolverConfig one;
    one.name = ranked.solver;
    one.options = ranked.options;
    return solvers
        .emplace(std::pair(ranked.solver, ranked.options), PartitionedSolver(registry, std::move(one), communicator))
        .first->second;
}

void PartitionedSolver::Implementation::solve_in_rounds(const PreparedPart& problem, Solution& own,
                                                        const SolveSettings& settings, SolveReport& report) {
    const Order& order = order_of(problem);
    const std::vector<RankedSolver> ranked = members_of(registry, order, problem.needs());
    const Solution first = own;
    std::vector<Solution> left(ranked.size());
    double best = std::numeric_limits<double>::infinity(), spent = 0.0;
    SolveCost total;
    total.phases.fill(0.0);
    total.bytes_sent = 0;
    const auto take = [&](const Turn& turn) -> TurnResult {
        if (best <= acceptable_error(settings, turn.work)) {
            report.near_goal = true;
            return {TurnEnd::Done, best};
        }
        if (ranked[turn.member].law.value_or(problem.problem().law) != problem.problem().law)
            return {TurnEnd::Retired, best};
        PartitionedSolver& solver = member(ranked[turn.member]);
        SolveSettings stage = settings;
        stage.max_iterations = std::min(settings.max_iterations - report.iterations, turn.iterations);
        stage.time_limit = settings.time_limit - spent;
        stage.warm_start =
            (settings.warm_start || turn.start) && (solver.info().capabilities & DELASSUS_CAN_WARM_START) != 0;
        Solution& iterate = left[turn.member];
        iterate = turn.start ? left[*turn.start] : first;
        const SolveReport done = solver.solve(problem, iterate, stage);
        spent += done.seconds_setup + done.seconds_solve;
        add(total, solver.cost());
        report.iterations += done.iterations;
        report.seconds_setup += done.seconds_setup;
        report.seconds_solve += done.seconds_solve;
        report.curve.insert(report.curve.end(), done.curve.begin(), done.curve.end());
        report.stages.push_back({done.solver, done.options, done.law, fmt::format("round {}", turn.round + 1),
                                 stage.tolerance, done.status, done.message, done.iterations,
                                 done.seconds_setup + done.seconds_solve, done.error.natural});
        const double worst = worst_of(done.error);
        if ((std::isfinite(worst) && worst < best) || done.status == Status::Solved) {
            own = iterate;
            best = worst;
            report.claimed_residual = done.claimed_residual;
        }
        report.status = done.status;
        const auto end = [&] {
            switch (done.status) {
                case Status::Solved:
                case Status::Cancelled:
                case Status::Infeasible:
                case Status::TimeLimit:
                    return TurnEnd::Done;
                case Status::IterationLimit:
                    return report.iterations >= settings.max_iterations ? TurnEnd::Done : TurnEnd::Exhausted;
                case Status::Error:
                    return TurnEnd::Retired;
                default:
                    return TurnEnd::Ended;
            }
        };
        return {end(), worst, done.iterations};
    };
    const RoundsEnd end = run_rounds(traits_of(registry, ranked), take);
    if (end == RoundsEnd::Stale && report.status != Status::Solved) report.status = Status::Stalled;
    cost = total;
    std::vector<std::string> names;
    for (const auto& stage : report.stages) names.push_back(stage.solver);
    report.message = fmt::format("{}: {}", order.name, fmt::join(names, ", then "));
}

SolveReport PartitionedSolver::solve(const PreparedPart& problem, Solution& own, const SolveSettings& settings) {
    auto& self = *implementation_;
    const Communicator& run = *self.communicator;
    check_settings(settings);
    if (const std::string sentence = refusal(problem, settings); !sentence.empty()) throw Unsupported(sentence);
    const auto n = static_cast<std::size_t>(problem.raw().n), m = static_cast<std::size_t>(problem.raw().m);
    together(run, [&] {
        if (!settings.warm_start) {
            own.x.assign(n, 0.0);
            own.lambda.assign(m, 0.0);
        } else if (own.x.size() != n || own.lambda.size() != m) {
            throw InputError(fmt::format("the warm start has {} and {} entries; the part has n = {} and m = {}",
                                         own.x.size(), own.lambda.size(), n, m));
        } else if (!all_finite(own.x) || !all_finite(own.lambda)) {
            throw InputError("the warm start holds a value that is not finite");
        }
    });

    SolveReport report;
    report.problem = problem.problem().name;
    report.solver = info().name;
    report.version = info().version;
    report.options = self.config.options;
    report.law = problem.problem().law;
    report.tolerance = settings.tolerance;
    if (std::isnan(problem.reference())) {
        refuse_to_judge(report);
        report.error = problem.measure(own.x, own.lambda);
        return report;
    }
    self.ranking ? self.solve_in_rounds(problem, own, settings, report)
                 : self.solve_with_plugin(problem, own, settings, report);
    const SetUpCounts counts = self.counts();
    report.analyses = counts.analyses;
    report.factorizations = counts.factorizations;

    std::int64_t not_finite = all_finite(own.x) && all_finite(own.lambda) ? 0 : 1;
    run.max(std::span(&not_finite, 1));
    if (not_finite != 0) {
        report.status = Status::NumericalFailure;
        report.message =
            fmt::format("{} returned values that are not finite; they were replaced by zeros", info().name);
        own.x.assign(n, 0.0);
        own.lambda.assign(m, 0.0);
    }
    report.error = problem.measure(own.x, own.lambda);
    if (report.status == Status::Infeasible && !self.ranking)  // a stage of auto has been here
        judge_infeasibility(report, PartProof(*problem.implementation_).size(own.x, own.lambda));
    auto& part = *problem.implementation_;
    judge(report, part.only_cones(), [&] {
        return part.structure == Structure::Reduced
                   ? RoundingOfBalance()
                   : part.measuring().rounding_of_balance(own.x.data(), own.lambda.data());
    });
    if (settings.record_curve && !report.curve.empty()) report.curve.back().natural = report.error.natural;
    return report;
}

}  // namespace delassus
