// SPDX-License-Identifier: BSD-3-Clause
// A solver that is one plugin: the border, and the clock that stands still while the host measures.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>

#include "delassus/error.hpp"
#include "problem/infeasibility.hpp"
#include "solver/judgement.hpp"
#include "solver/plugin_instance.hpp"
#include "solver/solver_implementation.hpp"

namespace delassus {

namespace {

using Clock = Stopwatch::Clock;

/// The context of the progress callback during one solve.
struct Listener {
    const SolveSettings& settings;
    const ErrorMeter* meter;  // null unless the curve is recorded
    SolveReport& report;
    Stopwatch& watch;
    ForeignCall& call;
    double seconds_before;  // setup
    double next_sample = 0.0;
    Clock::time_point next_display = Clock::now();
    std::exception_ptr failure = {};
    bool given_up = false;

    [[nodiscard]] double elapsed() const { return seconds_before + watch.seconds(); }

    std::int32_t hear(std::int64_t iteration, const double* x, const double* lambda) {
        const double seconds = elapsed();
        report.iterations = iteration;
        if (meter && seconds >= next_sample) {
            const CurveSample sample{iteration, seconds, meter->natural(x, lambda)};
            next_sample = seconds * sample_spacing;
            if (std::isfinite(sample.natural)) {
                report.curve.push_back(sample);
                if (settings.on_sample) settings.on_sample(sample);
            }
        }
        if (settings.on_progress && Clock::now() >= next_display) {
            settings.on_progress(report.curve.empty() ? CurveSample{iteration, seconds, NAN} : report.curve.back());
            next_display = Clock::now() + std::chrono::milliseconds(100);
        }
        if (settings.cancelled && settings.cancelled()) return DELASSUS_STOP_CANCEL;
        return seconds >= settings.time_limit ? DELASSUS_STOP_TIME : DELASSUS_CONTINUE;
    }

    // The border: the clock stops, and nothing is thrown through the plugin.
    static std::int32_t callback(void* context, std::int64_t iteration, const double* x,
                                 const double* lambda) noexcept {
        auto& self = *static_cast<Listener*>(context);
        std::int32_t answer = DELASSUS_STOP_CANCEL;
        try {
            self.given_up = self.given_up || (self.settings.give_up && self.settings.give_up(iteration, x, lambda));
            self.watch.stop();
            answer = self.hear(iteration, x, lambda);
            if (self.given_up && answer == DELASSUS_CONTINUE) answer = DELASSUS_STOP_CANCEL;
            if (answer == DELASSUS_CONTINUE) self.call.renew();
        } catch (...) {
            self.watch.stop();
            self.failure = std::current_exception();
        }
        self.watch.start();
        return answer;
    }
};

/// Checks the claim that there is no solution, as any other claim is checked.
class PluginSolver : public Solver::Implementation {
public:
    PluginSolver(std::shared_ptr<const Plugin> loaded, OptionTexts texts, const Registry* known)
        : instance(std::move(loaded), texts), chosen(std::move(texts)), registry(known) {}

    [[nodiscard]] const PluginInfo& info() const override { return instance.info(); }
    [[nodiscard]] const OptionTexts& options() const override { return chosen; }

    [[nodiscard]] std::string refusal(const PreparedProblem& problem, const SolveSettings& settings) override {
        const std::uint64_t needs = needs_of(problem, settings);
        if (const auto missing = info().missing(needs))
            return fmt::format("{} cannot solve {}: {}{}.", info().name, quoted_name(problem),
                               problem.describe(missing), registry ? who_can(*registry, needs) : std::string());
        if (!border().accepts) return {};
        char reason[512] = "";
        const auto answer = instance.guarded(
            "accepts", [&] { return border().accepts(instance.get(), &problem.raw(), reason, sizeof reason); },
            std::min(ForeignCall::patience, limit_of_calls(settings)));
        if (answer == 1 && instance.thrown().empty()) return {};
        reason[sizeof reason - 1] = '\0';
        return fmt::format("{} cannot solve {}: {}.", info().name, quoted_name(problem),
                           !instance.thrown().empty() ? instance.thrown()
                           : *reason                  ? reason
                                                      : "it gave no reason");
    }

    [[nodiscard]] SetUpCounts counts() const override { return counts_; }

    std::optional<Errors> run(const PreparedProblem& problem, Solution& solution, const SolveSettings& settings,
                              SolveReport& report) override;

private:
    [[nodiscard]] const delassus_plugin_descriptor& border() const { return instance.border(); }
    /// Renews the analysis and the factorisation as far as the problem's identity asks.
    std::int32_t set_up(const PreparedProblem& problem, double limit) {
        const auto& raw = problem.raw();
        if (analyzed && pattern_id == raw.pattern_id && values_id == raw.values_id) return DELASSUS_SOLVED;
        if (!analyzed || pattern_id != raw.pattern_id) {
            analyzed = false;
            if (const auto status = instance.guarded(
                    "analyze", [&] { return border().analyze(instance.get(), &raw); }, limit);
                status != DELASSUS_SOLVED)
                return status;
        }
        analyzed = false;
        const auto status = instance.guarded(
            "factorize", [&] { return border().factorize(instance.get(), &raw); }, limit);
        analyzed = status == DELASSUS_SOLVED;
        pattern_id = raw.pattern_id;
        values_id = raw.values_id;
        return status;
    }

    PluginInstance instance;
    OptionTexts chosen;
    const Registry* registry;
    bool analyzed = false;
    SetUpCounts counts_;  // at the last solve
    std::uint64_t pattern_id = 0, values_id = 0;
};

std::optional<Errors> PluginSolver::run(const PreparedProblem& problem, Solution& solution,
                                        const SolveSettings& settings, SolveReport& report) {
    if (border().use_team) {
        const sdk::Team team = settings.team ? settings.team->team() : sdk::Team();
        instance.guarded("use_team", [&] { return border().use_team(instance.get(), team.raw()), DELASSUS_SOLVED; });
    }
    Stopwatch setup, watch;
    setup.start();
    std::int32_t raw_status = set_up(problem, limit_of_calls(settings));
    setup.stop();
    report.seconds_setup = setup.seconds();

    delassus_outcome outcome{};
    outcome.struct_size = sizeof outcome;
    outcome.bytes_sent = -1;
    outcome.residual = NAN;
    bool given_up = false;
    if (raw_status == DELASSUS_SOLVED) {
        const ErrorMeter* meter = settings.record_curve ? &problem.meter() : nullptr;
        ForeignCall call(instance.who(), "in solve", limit_of_calls(settings));
        Listener listener{settings, meter, report, watch, call, report.seconds_setup};
        const delassus_request request{
            sizeof request,      settings.warm_start ? 1 : 0, settings.tolerance, settings.max_iterations,
            settings.time_limit, &Listener::callback,         &listener};
        watch.start();
        raw_status = instance.guarded([&] {
            return border().solve(instance.get(), &problem.raw(), &request, solution.x.data(), solution.lambda.data(),
                                  &outcome);
        });
        watch.stop();
        if (listener.failure) std::rethrow_exception(listener.failure);
        if (instance.thrown().empty()) {
            report.iterations = outcome.iterations;
            counts_ = {outcome.analyses, outcome.factorizations};
        }
        if (outcome.message) report.message = outcome.message;
        given_up = listener.given_up;
    }
    report.seconds_solve = watch.seconds();
    report.claimed_residual = outcome.residual;
    report.status = status_of(raw_status);
    if (given_up && report.status == Status::Cancelled) report.status = Status::Stalled;
    if (report.status == Status::Infeasible)
        judge_infeasibility(report, proven_size(problem, solution.x, solution.lambda));
    if (report.status == Status::Error || report.status == Status::NumericalFailure)
        report.message = fmt::format("{}: {}", info().name, instance.last_error());
    if (settings.record_curve)
        report.curve.push_back({report.iterations, report.seconds_setup + report.seconds_solve, NAN});
    return std::nullopt;
}

}  // namespace

Solver::Solver(std::shared_ptr<const Plugin> plugin, OptionTexts options, const Registry* registry)
    : implementation_(std::make_unique<PluginSolver>(std::move(plugin), std::move(options), registry)) {}

}  // namespace delassus
