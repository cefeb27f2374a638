// SPDX-License-Identifier: BSD-3-Clause
// One solve: refusal before the call, the clock that stands still while the host measures, and the judgement
// afterwards.
#include "delassus/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "delassus/distributed.hpp"
#include "delassus/error.hpp"

namespace delassus {

namespace {

using Clock = std::chrono::steady_clock;

/// Claims are compared with the tolerance up to this factor: the host and the solver round differently.
constexpr double claim_slack = 1.001;
/// A balance error at this level is rounding, whatever tolerance was asked.
constexpr double balance_floor = 1e-12;
/// A claim is true at the rounding floor as well: up to so many times Errors::rounding (sums of some hundred products),
/// and up to this natural error at most.
constexpr double rounding_slack = 32.0;
constexpr double rounding_limit = 1e-10;
/// Curve samples are spaced by this factor in time.
constexpr double sample_spacing = 1.02;

/// A stopwatch that can be stopped while the host does work of its own.
class Stopwatch {
public:
    void start() { begin_ = Clock::now(); }
    void stop() { seconds_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }
    [[nodiscard]] double seconds() const { return seconds_; }

private:
    Clock::time_point begin_;
    double seconds_ = 0.0;
};

/// What stands behind the progress callback during one solve.
struct Listener {
    const SolveSettings& settings;
    const ErrorMeter* meter;  // null unless the curve is recorded
    SolveReport& report;
    Stopwatch& watch;
    double seconds_before;  // setup
    double next_sample = 0.0;
    Clock::time_point next_display = Clock::now();
    std::string failure = {};

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
        self.watch.stop();
        std::int32_t answer = DELASSUS_STOP_CANCEL;
        try {
            answer = self.hear(iteration, x, lambda);
        } catch (const std::exception& error) {
            self.failure = error.what();
        }
        self.watch.start();
        return answer;
    }
};

Status status_of(std::int32_t raw) {
    switch (raw) {
        case DELASSUS_SOLVED:
            return Status::Solved;
        case DELASSUS_ITERATION_LIMIT:
            return Status::IterationLimit;
        case DELASSUS_TIME_LIMIT:
            return Status::TimeLimit;
        case DELASSUS_STALLED:
            return Status::Stalled;
        case DELASSUS_INFEASIBLE:
            return Status::Infeasible;
        case DELASSUS_NUMERICAL_FAILURE:
            return Status::NumericalFailure;
        case DELASSUS_CANCELLED:
            return Status::Cancelled;
        default:
            return Status::Error;
    }
}

bool all_finite(const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

void check_settings(const SolveSettings& settings) {
    if (!(settings.tolerance > 0.0) || !std::isfinite(settings.tolerance))
        throw InputError(fmt::format("the tolerance is {}; it must be positive", settings.tolerance));
    if (settings.max_iterations < 0)
        throw InputError(fmt::format("the iteration limit is {}; it must not be negative", settings.max_iterations));
    if (!(settings.time_limit > 0.0))
        throw InputError(fmt::format("the time limit is {} s; it must be positive", settings.time_limit));
}

}  // namespace

std::string_view name_of(Status status) {
    switch (status) {
        case Status::Solved:
            return "solved";
        case Status::IterationLimit:
            return "iteration_limit";
        case Status::TimeLimit:
            return "time_limit";
        case Status::Stalled:
            return "stalled";
        case Status::Infeasible:
            return "infeasible";
        case Status::NumericalFailure:
            return "numerical_failure";
        case Status::Cancelled:
            return "cancelled";
        case Status::Error:
            return "error";
        case Status::FalseClaim:
            return "false_claim";
    }
    return "error";
}

struct Solver::Implementation {
    Implementation(std::shared_ptr<const Plugin> chosen, OptionTexts texts, const Registry* known)
        : plugin(std::move(chosen)), options(std::move(texts)), registry(known) {
        const auto resolved = resolve_options(plugin->info().name, plugin->info().options, options);
        std::vector<delassus_option_value> values;
        for (const auto& value : resolved) {
            const bool textual = value.type == DELASSUS_OPTION_CHOICE || value.type == DELASSUS_OPTION_TEXT;
            values.push_back(
                {value.key.c_str(), value.type, 0, value.integer, value.real, textual ? value.text.c_str() : nullptr});
        }
        const auto status =
            guarded([&] { return border().create(values.data(), static_cast<std::int32_t>(values.size()), &solver); });
        if (status != DELASSUS_SOLVED || !solver)
            throw InputError(fmt::format("{} cannot be set up: {}", plugin->info().name, last_error(nullptr)));
    }

    ~Implementation() {
        if (solver) guarded([&] { return border().destroy(solver), DELASSUS_SOLVED; });
    }
    Implementation(const Implementation&) = delete;
    Implementation& operator=(const Implementation&) = delete;

    [[nodiscard]] const delassus_plugin_descriptor& border() const { return plugin->descriptor(); }

    /// Runs an operation of the plugin. Exceptions are not allowed through the border, but a plugin that throws all the
    /// same must not take the host down.
    template <class Operation>
    std::int32_t guarded(Operation&& operation) {
        thrown.clear();
        try {
            return operation();
        } catch (const std::exception& error) {
            thrown = fmt::format("it threw an exception through the plugin border: {}", error.what());
        } catch (...) {
            thrown = "it threw an exception through the plugin border";
        }
        return DELASSUS_ERROR;
    }

    [[nodiscard]] std::string last_error(void* instance) {
        if (!thrown.empty()) return thrown;
        const char* text = border().last_error(instance);
        return text && *text ? text : "it gave no reason";
    }

    [[nodiscard]] std::string refusal(const PreparedProblem& problem, const SolveSettings& settings) {
        const auto& info = plugin->info();
        std::uint64_t needs = problem.needs();
        if (settings.warm_start) needs |= DELASSUS_CAN_WARM_START;
        if (process_count() > 1) needs |= DELASSUS_CAN_DISTRIBUTED;
        const std::string name =
            problem.problem().name.empty() ? "the problem" : fmt::format("\"{}\"", problem.problem().name);
        if (const auto missing = info.missing(needs)) {
            std::string sentence = fmt::format("{} cannot solve {}: {}", info.name, name, problem.describe(missing));
            if (registry) {
                const auto capable = registry->capable(needs);
                sentence +=
                    capable.empty() ? ". No installed solver can" : fmt::format(". Can: {}", fmt::join(capable, ", "));
            }
            return sentence + ".";
        }
        if (!border().accepts) return {};
        char reason[512] = "";
        const auto answer = guarded([&] { return border().accepts(solver, &problem.raw(), reason, sizeof reason); });
        if (!thrown.empty()) return fmt::format("{} cannot solve {}: {}.", info.name, name, thrown);
        if (answer == 1) return {};
        reason[sizeof reason - 1] = '\0';
        return fmt::format("{} cannot solve {}: {}.", info.name, name, *reason ? reason : "it gave no reason");
    }

    /// Renews the analysis and the factorisation as far as the problem's identity asks.
    std::int32_t set_up(const PreparedProblem& problem) {
        const auto& raw = problem.raw();
        if (analyzed && pattern_id == raw.pattern_id && values_id == raw.values_id) return DELASSUS_SOLVED;
        if (!analyzed || pattern_id != raw.pattern_id) {
            analyzed = false;
            if (const auto status = guarded([&] { return border().analyze(solver, &raw); }); status != DELASSUS_SOLVED)
                return status;
        }
        analyzed = false;
        const auto status = guarded([&] { return border().factorize(solver, &raw); });
        analyzed = status == DELASSUS_SOLVED;
        pattern_id = raw.pattern_id;
        values_id = raw.values_id;
        return status;
    }

    std::shared_ptr<const Plugin> plugin;
    OptionTexts options;
    const Registry* registry;
    void* solver = nullptr;
    bool analyzed = false;
    std::uint64_t pattern_id = 0, values_id = 0;
    std::string thrown;
};

Solver::Solver(std::shared_ptr<const Plugin> plugin, OptionTexts options, const Registry* registry)
    : implementation_(std::make_unique<Implementation>(std::move(plugin), std::move(options), registry)) {}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

const PluginInfo& Solver::info() const {
    return implementation_->plugin->info();
}

std::string Solver::refusal(const PreparedProblem& problem, const SolveSettings& settings) const {
    return implementation_->refusal(problem, settings);
}

SolveReport Solver::solve(const PreparedProblem& problem, Solution& solution, const SolveSettings& settings) {
    auto& self = *implementation_;
    check_settings(settings);
    if (const std::string sentence = refusal(problem, settings); !sentence.empty()) throw Unsupported(sentence);

    const auto n = static_cast<std::size_t>(problem.problem().n());
    const auto m = static_cast<std::size_t>(problem.problem().m());
    if (settings.warm_start) {
        if (solution.x.size() != n || solution.lambda.size() != m)
            throw InputError(fmt::format("the warm start has {} and {} entries; the problem has n = {} and m = {}",
                                         solution.x.size(), solution.lambda.size(), n, m));
        if (!all_finite(solution.x) || !all_finite(solution.lambda))
            throw InputError("the warm start holds a value that is not finite");
    } else {
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }

    SolveReport report;
    report.problem = problem.problem().name;
    report.solver = info().name;
    report.version = info().version;
    report.options = self.options;
    report.law = problem.problem().law;
    report.tolerance = settings.tolerance;

    const ErrorMeter meter(problem);
    Stopwatch setup, watch;
    setup.start();
    std::int32_t raw_status = self.set_up(problem);
    setup.stop();
    report.seconds_setup = setup.seconds();

    delassus_outcome outcome{};
    outcome.struct_size = sizeof outcome;
    outcome.residual = NAN;
    if (raw_status == DELASSUS_SOLVED) {
        Listener listener{settings, settings.record_curve ? &meter : nullptr, report, watch, report.seconds_setup};
        const delassus_request request{
            sizeof request,      settings.warm_start ? 1 : 0, settings.tolerance, settings.max_iterations,
            settings.time_limit, &Listener::callback,         &listener};
        watch.start();
        raw_status = self.guarded([&] {
            return self.border().solve(self.solver, &problem.raw(), &request, solution.x.data(), solution.lambda.data(),
                                       &outcome);
        });
        watch.stop();
        if (!listener.failure.empty()) throw Error(listener.failure);
        if (self.thrown.empty()) report.iterations = outcome.iterations;
    }
    report.seconds_solve = watch.seconds();
    report.analyses = outcome.analyses;
    report.factorizations = outcome.factorizations;
    report.claimed_residual = outcome.residual;
    report.status = status_of(raw_status);
    if (outcome.message) report.message = outcome.message;
    if (report.status == Status::Error || report.status == Status::NumericalFailure)
        report.message = fmt::format("{}: {}", info().name, self.last_error(self.solver));

    if (!all_finite(solution.x) || !all_finite(solution.lambda)) {
        report.status = Status::NumericalFailure;
        report.message =
            fmt::format("{} returned values that are not finite; they were replaced by zeros", info().name);
        solution.x.assign(n, 0.0);
        solution.lambda.assign(m, 0.0);
    }
    report.error = meter.measure(solution.x, solution.lambda);
    const double claimed = claim_slack * settings.tolerance;
    const double natural_bound = std::max(claimed, std::min(rounding_slack * report.error.rounding, rounding_limit));
    const double balance_bound = std::max(claimed, balance_floor);
    if (report.status == Status::Solved &&
        !(report.error.natural <= natural_bound && report.error.balance <= balance_bound)) {
        report.status = Status::FalseClaim;
        report.message = fmt::format(
            "{} claimed convergence; the natural error is {:.2e} and the balance error {:.2e}, the "
            "tolerance {:.2e}",
            info().name, report.error.natural, report.error.balance, settings.tolerance);
    }
    if (settings.record_curve)
        report.curve.push_back({report.iterations, report.seconds_setup + report.seconds_solve, report.error.natural});
    return report;
}

}  // namespace delassus
