// SPDX-License-Identifier: BSD-3-Clause
#include "solver/stages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "solver/judgement.hpp"

namespace delassus {

Forecast::Forecast(double tolerance, std::int64_t iterations)
    : tolerance_(tolerance), iterations_(iterations), next_(iterations) {
    const std::int64_t earliest = std::clamp<std::int64_t>(iterations / 4, 16, 32);
    while (next_ / 2 >= earliest) next_ /= 2;
}

Forecast::Verdict Forecast::judge(std::int64_t iteration, double natural) {
    const bool over = iteration >= iterations_;
    if (!std::isfinite(natural)) return over ? Verdict::Exhausted : Verdict::GoOn;
    next_ = over ? std::numeric_limits<std::int64_t>::max() : iterations_;
    while (!over && next_ / 2 > iteration) next_ /= 2;
    const double now = std::log(std::max(natural, std::numeric_limits<double>::min()));
    const bool known = measured_ >= 2;
    const auto reaches = [&](double turns) {
        return natural <= tolerance_ || (known && in_reach(turns, iteration, natural, before_ - last_, last_ - now));
    };
    const bool reached = reaches(2.0);
    hopes_ = over && reaches(1.0 + 2.0 * 2.0);
    failed_ = known && !reached ? failed_ + 1 : 0;
    before_ = std::exchange(last_, now);
    ++measured_;
    if (over) return reached ? Verdict::GoOn : Verdict::Exhausted;
    return failed_ >= 2 ? Verdict::Pass : Verdict::GoOn;
}

bool Forecast::in_reach(double turns, std::int64_t iteration, double natural, double first, double second) const {
    if (!(second > 0.0)) return false;
    const double growth = first > 0.0 ? std::clamp(second / first, 1.0, 2.0) : 1.0;
    const double limit = turns * static_cast<double>(iterations_);
    double rest = std::log(natural / tolerance_), fall = growth * second;
    for (double k = static_cast<double>(iteration); k <= limit; k *= 2.0) {
        if (rest <= fall) return k * std::exp2(rest / fall) <= limit;
        rest -= fall;
        fall *= growth;
    }
    return false;
}

namespace {

/// What one stage does not tell, the sum does not know.
void add_cost(SolveCost& total, const SolveCost& stage) {
    total.setup += stage.setup;
    total.solve += stage.solve;
    for (std::size_t k = 0; k < total.phases.size(); ++k) total.phases[k] += stage.phases[k];
    total.bytes_sent = total.bytes_sent < 0 || stage.bytes_sent < 0 ? -1 : total.bytes_sent + stage.bytes_sent;
}

}  // namespace

StageRunner::StageRunner(const Prepared& problem, Solution& solution, const SolveSettings& settings,
                         SolveReport& report)
    : problem_(problem), best_(solution), settings_(settings), report_(report), started_(settings.warm_start) {}

const Errors& StageRunner::measured_error() {
    if (!error_) error_ = problem_.measure(best_.x, best_.lambda);
    return *error_;
}

bool StageRunner::solved_at_start() {
    if (!started_) return false;
    const Structure structure = problem_.structure();
    if (structure == Structure::Diagonal || structure == Structure::Blocks) {
        // Reactions of the step before balance the velocities of that step. Those that they balance now leave the
        // natural error alone, which rules most starts out for less than all errors cost. Near the answer the better of
        // the two counts: at rest either alone lets rounding grow from step to step.
        constexpr double near = 100.0;
        std::vector<double> x;
        problem_.velocity_of(best_.lambda, x);
        worst_ = problem_.natural(x.data(), best_.lambda.data());
        const bool given = worst_ <= near * settings_.tolerance && worst_of(measured_error()) <= worst_;
        if (!given) {
            best_.x = std::move(x);
            error_.reset();
            if (!(worst_ <= settings_.tolerance)) return false;
        }
    }
    worst_ = worst_of(measured_error());
    if (worst_ > settings_.tolerance) return false;
    report_.status = Status::Solved;
    return true;
}

double StageRunner::worst() {
    if (started_ && std::isnan(worst_)) worst_ = worst_of(measured_error());
    return started_ ? worst_ : std::numeric_limits<double>::infinity();
}

const Prepared* StageRunner::problem_of(std::optional<Law> law) {
    if (!law || *law == problem_.law()) return &problem_;
    if (!other_) other_ = problem_.under(*law);
    return other_.get();
}

TurnResult StageRunner::run(Solver& solver, const Stage& stage) {
    Solution iterate = best_;
    return run(solver, stage, iterate, started_);
}

TurnResult StageRunner::run(Solver& solver, const Stage& stage, Solution& iterate, bool is_start) {
    const Prepared& problem = *problem_of(stage.law);
    const bool other_law = &problem != &problem_;
    const bool warm = is_start && (solver.info().capabilities & DELASSUS_CAN_WARM_START) != 0;
    const double tolerance = std::max(stage.tolerance, settings_.tolerance);
    Forecast forecast(tolerance, stage.iterations);
    Forecast::Verdict verdict = Forecast::Verdict::GoOn;
    const SolveReport result = solver.solve(problem, iterate, settings_of(stage, problem, warm, forecast, verdict));

    const Errors error = other_law ? problem_.measure(iterate.x, iterate.lambda) : result.error;
    // Where momenta cancel, rounding alone may leave a large balance error, which is excused where all else is solved.
    const bool solved = result.status == Status::Solved && tolerance == settings_.tolerance && !other_law;
    if (!started_ || worst_of(error) < worst() || solved) {
        best_ = iterate;
        error_ = error;
        worst_ = worst_of(error);
        started_ = true;
    }
    const Status status = verdict == Forecast::Verdict::Exhausted ? Status::IterationLimit : result.status;
    add({result.solver, result.options, problem.law(), stage.reason, tolerance, status, result.message,
         result.iterations, result.seconds_setup + result.seconds_solve, error.natural},
        result);
    return {end_of(status, verdict, other_law, solved, worst_of(error)), worst_of(error), result.iterations,
            forecast.hopes()};
}

TurnEnd StageRunner::end_of(Status status, Forecast::Verdict verdict, bool other_law, bool solved, double error) {
    if (status == Status::Cancelled || (status == Status::Infeasible && !other_law)) return TurnEnd::Done;
    if (solved || error <= settings_.tolerance) {
        report_.status = Status::Solved;
        return TurnEnd::Done;
    }
    if (report_.iterations >= settings_.max_iterations) {
        report_.status = Status::IterationLimit;
        return TurnEnd::Done;
    }
    if (report_.seconds_setup + report_.seconds_solve >= settings_.time_limit) {
        report_.status = Status::TimeLimit;
        return TurnEnd::Done;
    }
    if (report_.status == Status::Solved) report_.status = Status::Stalled;  // it reached only the goal of this stage
    if (status == Status::IterationLimit) return TurnEnd::Exhausted;
    if (status == Status::Error) return TurnEnd::Retired;
    return verdict == Forecast::Verdict::Pass ? TurnEnd::Passed : TurnEnd::Ended;
}

SolveSettings StageRunner::settings_of(const Stage& stage, const Prepared& problem, bool warm, Forecast& forecast,
                                       Forecast::Verdict& verdict) const {
    SolveSettings settings = settings_;
    settings.tolerance = stage.tighter * std::max(stage.tolerance, settings_.tolerance);
    settings.max_iterations = settings_.max_iterations - report_.iterations;
    const double seconds_before = report_.seconds_setup + report_.seconds_solve;
    settings.time_limit = settings_.time_limit - seconds_before;
    settings.warm_start = warm;
    settings.resume = warm && stage.resume;
    const auto shifted = [iterations = report_.iterations, seconds_before](CurveSample sample) {
        sample.iteration += iterations;
        sample.seconds += seconds_before;
        return sample;
    };
    if (settings_.on_progress)
        settings.on_progress = [this, shifted](const CurveSample& sample) { settings_.on_progress(shifted(sample)); };
    // The curve shows errors under the problem's own law. A stage with the other law adds its end only.
    if (&problem != &problem_) settings.record_curve = false;
    if (settings_.on_sample)
        settings.on_sample = [this, shifted](const CurveSample& sample) { settings_.on_sample(shifted(sample)); };
    if (stage.iterations > 0) {
        const std::int64_t twice =
            stage.iterations > settings.max_iterations / 2 ? stage.iterations : 2 * stage.iterations;
        settings.max_iterations = std::min(settings.max_iterations, twice);
        settings.give_up = [&, may_pass = stage.may_pass](std::int64_t iteration, const double* x,
                                                          const double* lambda) {
            if (verdict != Forecast::Verdict::GoOn) return true;
            if (forecast.due(iteration)) {
                verdict = forecast.judge(iteration, problem.natural(x, lambda));
                if (verdict == Forecast::Verdict::Pass && !may_pass) verdict = Forecast::Verdict::GoOn;
            }
            return verdict != Forecast::Verdict::GoOn;
        };
    }
    return settings;
}

void StageRunner::add(const StageReport& stage, const SolveReport& result) {
    for (CurveSample sample : result.curve) {
        sample.iteration += report_.iterations;
        sample.seconds += report_.seconds_setup + report_.seconds_solve;
        report_.curve.push_back(sample);
    }
    if (settings_.record_curve && result.curve.empty())
        report_.curve.push_back({report_.iterations + stage.iterations,
                                 report_.seconds_setup + report_.seconds_solve + stage.seconds, stage.natural});
    report_.status = result.status;
    report_.iterations += result.iterations;
    report_.seconds_setup += result.seconds_setup;
    report_.seconds_solve += result.seconds_solve;
    report_.claimed_residual = result.claimed_residual;
    report_.stages.empty() ? void(report_.cost = result.cost) : add_cost(report_.cost, result.cost);
    report_.stages.push_back(stage);
}

std::string StageRunner::sentence() const {
    std::string text;
    for (const auto& stage : report_.stages) {
        if (!text.empty()) text += ", ";
        text += fmt::format("{} ({}{} iterations, {:.1e}{})", stage.solver,
                            stage.law == problem_.law() ? "" : fmt::format("{}, ", name_of(stage.law)),
                            stage.iterations, stage.natural,
                            stage.status == Status::Solved ? "" : fmt::format(", {}", name_of(stage.status)));
    }
    return text;
}

}  // namespace delassus
