// SPDX-License-Identifier: BSD-3-Clause
// A solver that is one plugin: the border, and the clock that stands still while the host measures. Of a problem in
// parts everything is agreed upon by the processes that have them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>

#include "delassus/error.hpp"
#include "solver/judgement.hpp"
#include "solver/plugin_instance.hpp"
#include "solver/solver_implementation.hpp"
#include "support/alone.hpp"
#include "support/sentence.hpp"
#include "support/trace.hpp"

namespace delassus {

namespace {

using Clock = Stopwatch::Clock;

/// Several processes agree about so often on the time and on cancelling, in seconds; every time costs a reduction.
constexpr double seconds_between_agreements = 0.02;

/// The context of the progress callback during one solve. All processes call it for the same iterations.
class Listener {
public:
    Listener(const Prepared& problem, const SolveSettings& settings, SolveReport& report, Stopwatch& watch,
             ForeignCall& call)
        : problem_(problem), settings_(settings), report_(report), watch_(watch), call_(call) {}

    // The border: the clock stops, and nothing is thrown through the plugin. One of several processes that cannot go on
    // ends the run of all, since the others wait for it.
    static std::int32_t callback(void* context, std::int64_t iteration, const double* x,
                                 const double* lambda) noexcept {
        auto& self = *static_cast<Listener*>(context);
        std::int32_t answer = DELASSUS_STOP_CANCEL;
        try {
            self.given_up_ = self.given_up_ || (self.settings_.give_up && self.settings_.give_up(iteration, x, lambda));
            self.report_.iterations = iteration;
            if (!self.given_up_ && iteration < self.next_) return DELASSUS_CONTINUE;
            self.watch_.stop();
            answer = self.hear(iteration, x, lambda);
            if (answer == DELASSUS_CONTINUE) self.call_.renew();
        } catch (const std::exception& error) {
            if (self.several()) fail_alone(self.problem_.communicator(), sentence_of(error));
            self.fail();
        } catch (...) {
            if (self.several()) fail_alone(self.problem_.communicator(), "an exception of an unknown type");
            self.fail();
        }
        self.watch_.start();
        return answer;
    }

    [[nodiscard]] bool given_up() const { return given_up_; }
    /// Throws what a callback of the caller's threw.
    void rethrow() const {
        if (failure_) std::rethrow_exception(failure_);
    }

private:
    [[nodiscard]] bool several() const { return problem_.communicator().size() > 1; }
    void fail() {
        watch_.stop();
        failure_ = std::current_exception();
    }

    std::int32_t hear(std::int64_t iteration, const double* x, const double* lambda) {
        std::array<double, 2> agreed = {report_.seconds_setup + watch_.seconds(),
                                        settings_.cancelled && settings_.cancelled() ? 1.0 : 0.0};
        problem_.communicator().max(agreed);
        const double seconds = agreed[0];
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
        if (several()) plan_next(iteration, seconds);
        if (agreed[1] > 0.0 || given_up_) return DELASSUS_STOP_CANCEL;
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

    const Prepared& problem_;
    const SolveSettings& settings_;
    SolveReport& report_;
    Stopwatch& watch_;
    ForeignCall& call_;
    double next_sample_ = 0.0, last_seconds_ = 0.0;
    std::int64_t next_ = 0, last_ = 0, stride_ = 1;
    Clock::time_point next_display_ = Clock::now();
    std::exception_ptr failure_;
    bool given_up_ = false;
};

/// A solver's clock runs on while the core looks at an iterate, which does not count, and it may estimate phases from a
/// part of the iterations. Its phases are shares of the core's time at most.
void fit_phases(SolveCost& cost) {
    double sum = 0.0;
    for (const double seconds : cost.phases)
        if (std::isfinite(seconds)) sum += seconds;
    if (!(sum > cost.solve)) return;
    for (double& seconds : cost.phases) seconds *= cost.solve / sum;
}

/// How an operation of the plugin ended on all processes, with a sentence of the first on which it failed, if it did.
struct Ending {
    std::int32_t status = DELASSUS_SOLVED;
    std::string sentence;
};

/// Checks the claim that there is no solution, as any other claim is checked.
class PluginSolver : public Solver::Implementation {
public:
    PluginSolver(std::shared_ptr<const Plugin> loaded, OptionTexts texts, const Registry* known)
        : instance(std::move(loaded), texts), chosen(std::move(texts)), registry(known) {}

    [[nodiscard]] const PluginInfo& info() const override { return instance.info(); }
    [[nodiscard]] const OptionTexts& options() const override { return chosen; }

    [[nodiscard]] std::string refusal(const Prepared& problem, const SolveSettings& settings) override {
        const std::uint64_t needs = needs_of(problem, settings);
        if (const auto missing = info().missing(needs))
            return fmt::format("{} cannot solve {}: {}{}.", info().name, quoted_name(problem),
                               problem.describe(missing), registry ? who_can(*registry, needs) : std::string());
        if (!border().accepts || !problem.whole()) return {};
        char reason[512] = "";
        const auto answer = instance.guarded(
            "accepts", [&] { return border().accepts(instance.get(), problem.whole(), reason, sizeof reason); },
            std::min(ForeignCall::patience, limit_of_calls(settings)));
        if (answer == 1 && instance.thrown().empty()) return {};
        reason[sizeof reason - 1] = '\0';
        return fmt::format("{} cannot solve {}: {}.", info().name, quoted_name(problem),
                           !instance.thrown().empty() ? instance.thrown()
                           : *reason                  ? reason
                                                      : "it gave no reason");
    }

    [[nodiscard]] SetUpCounts counts() const override { return counts_; }

    std::optional<Errors> run(const Prepared& problem, Solution& solution, const SolveSettings& settings,
                              SolveReport& report) override;

private:
    [[nodiscard]] const delassus_plugin_descriptor& border() const { return instance.border(); }

    /// own: how the operation ended on this process.
    [[nodiscard]] Ending agree(const Communicator& run, std::int32_t own) const {
        const bool failed = own == DELASSUS_ERROR || own == DELASSUS_NUMERICAL_FAILURE;
        std::string sentence = failed ? fmt::format("{}: {}", info().name, instance.last_error()) : std::string();
        if (run.size() == 1) return {own, std::move(sentence)};
        std::optional<AloneAlarm> alarm;
        if (failed) alarm.emplace(run, sentence);
        const std::vector<std::int64_t> statuses = run.all(own);
        alarm.reset();
        for (int rank = 0; rank < run.size(); ++rank) {
            const auto status = static_cast<std::int32_t>(statuses[static_cast<std::size_t>(rank)]);
            if (status == DELASSUS_ERROR || status == DELASSUS_NUMERICAL_FAILURE)
                return {status, run.broadcast(sentence, rank)};
        }
        for (const auto status : statuses)
            if (status != statuses.front())
                return {DELASSUS_ERROR, fmt::format("{} ended as {} on one process and as {} on another", info().name,
                                                    name_of(status_of(static_cast<std::int32_t>(statuses.front()))),
                                                    name_of(status_of(static_cast<std::int32_t>(status))))};
        return {own, {}};
    }

    std::int32_t analyze(const Prepared& problem) {
        const TraceSpan span("plugin", "analyze");
        return problem.whole() ? border().analyze(instance.get(), problem.whole())
                               : border().analyze_partitioned(instance.get(), problem.part());
    }
    std::int32_t factorize(const Prepared& problem) {
        const TraceSpan span("plugin", "factorize");
        return problem.whole() ? border().factorize(instance.get(), problem.whole())
                               : border().factorize_partitioned(instance.get(), problem.part());
    }
    std::int32_t solve(const Prepared& problem, const delassus_request& request, Solution& solution,
                       delassus_outcome& outcome) {
        double *x = solution.x.data(), *lambda = solution.lambda.data();
        return problem.whole()
                   ? border().solve(instance.get(), problem.whole(), &request, x, lambda, &outcome)
                   : border().solve_partitioned(instance.get(), problem.part(), &request, x, lambda, &outcome);
    }

    /// Renews the analysis and the factorisation as far as the problem's identity asks.
    Ending set_up(const Prepared& problem, double limit) {
        const std::uint64_t pattern = problem.whole() ? problem.whole()->pattern_id : problem.part()->pattern_id;
        const std::uint64_t values = problem.whole() ? problem.whole()->values_id : problem.part()->values_id;
        if (analyzed && pattern_id == pattern && values_id == values) return {};
        const Communicator& run = problem.communicator();
        if (!analyzed || pattern_id != pattern) {
            analyzed = false;
            Ending ending = agree(run, instance.guarded(
                                           "analyze", [&] { return analyze(problem); }, limit));
            if (ending.status != DELASSUS_SOLVED) return ending;
        }
        analyzed = stopped_ = false;
        Ending ending = agree(run, instance.guarded(
                                       "factorize", [&] { return factorize(problem); }, limit));
        analyzed = ending.status == DELASSUS_SOLVED;
        pattern_id = pattern;
        values_id = values;
        return ending;
    }

    PluginInstance instance;
    OptionTexts chosen;
    const Registry* registry;
    bool analyzed = false;
    bool stopped_ = false;  // at a limit, in a state that it can go on from
    SetUpCounts counts_;    // at the last solve
    std::uint64_t pattern_id = 0, values_id = 0;
};

std::optional<Errors> PluginSolver::run(const Prepared& problem, Solution& solution, const SolveSettings& settings,
                                        SolveReport& report) {
    const Communicator& run = problem.communicator();
    if (border().use_team) {
        const sdk::Team team = settings.team ? settings.team->team() : sdk::Team();
        instance.guarded("use_team", [&] { return border().use_team(instance.get(), team.raw()), DELASSUS_SOLVED; });
    }
    Stopwatch setup, watch;
    setup.start();
    Ending ending = set_up(problem, limit_of_calls(settings));
    setup.stop();
    report.cost.setup = report.seconds_setup = setup.seconds();
    run.max(std::span(&report.seconds_setup, 1));

    delassus_outcome outcome{};
    outcome.struct_size = sizeof outcome;
    outcome.residual = NAN;
    outcome.bytes_sent = -1;
    if (problem.part() || is_traced()) {
        outcome.phase_seconds = report.cost.phases.data();
        outcome.phase_count = DELASSUS_PHASE_COUNT;
    }
    bool given_up = false;
    if (ending.status == DELASSUS_SOLVED) {
        ForeignCall call(instance.who(), "in solve", limit_of_calls(settings));
        Listener listener(problem, settings, report, watch, call);
        const delassus_request request{sizeof request,
                                       settings.warm_start ? 1 : 0,
                                       settings.told_tolerance(),
                                       settings.max_iterations,
                                       settings.time_limit,
                                       &Listener::callback,
                                       &listener,
                                       settings.resume && stopped_ ? 1 : 0,
                                       0};
        stopped_ = false;
        TraceSpan span("plugin", "iterate");
        watch.start();
        ending = agree(run, instance.guarded([&] { return solve(problem, request, solution, outcome); }));
        watch.stop();
        for (std::size_t k = 0; k < report.cost.phases.size(); ++k)
            span.say(name_of(static_cast<delassus_phase>(k)), report.cost.phases[k]);
        listener.rethrow();
        if (ending.status != DELASSUS_ERROR) {
            report.iterations = outcome.iterations;
            counts_ = {outcome.analyses, outcome.factorizations};
            stopped_ = (info().flags & DELASSUS_FLAG_RESUMES) != 0 && outcome.iterations > 0 &&
                       (ending.status == DELASSUS_ITERATION_LIMIT || ending.status == DELASSUS_CANCELLED);
        }
        given_up = listener.given_up();
    }
    report.cost.bytes_sent = outcome.bytes_sent;
    report.cost.solve = report.seconds_solve = watch.seconds();
    fit_phases(report.cost);
    run.max(std::span(&report.seconds_solve, 1));
    report.claimed_residual = outcome.residual;
    report.status = status_of(ending.status);
    if (given_up && report.status == Status::Cancelled) report.status = Status::Stalled;
    report.message = run.broadcast(outcome.message ? outcome.message : "");
    if (!ending.sentence.empty()) report.message = std::move(ending.sentence);
    if (report.status == Status::Infeasible) judge_infeasibility(report, problem.proven_size(solution));
    if (settings.record_curve)
        report.curve.push_back({report.iterations, report.seconds_setup + report.seconds_solve, NAN});
    return std::nullopt;
}

}  // namespace

Solver::Solver(std::shared_ptr<const Plugin> plugin, OptionTexts options, const Registry* registry)
    : implementation_(std::make_unique<PluginSolver>(std::move(plugin), std::move(options), registry)) {}

}  // namespace delassus
