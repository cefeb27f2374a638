// SPDX-License-Identifier: BSD-3-Clause
#include "solver/stages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "solver/judgement.hpp"

namespace delassus {

DecreaseWatch::DecreaseWatch(double tolerance, std::int64_t max_iterations)
    : tolerance_(tolerance), max_iterations_(max_iterations) {}

bool DecreaseWatch::hopeless(std::int64_t iteration, double natural) {
    if (!std::isfinite(natural)) return false;
    next_ = 2 * iteration;
    const double now = std::log(std::max(natural, std::numeric_limits<double>::min()));
    const bool fails =
        measured_ >= 2 && natural > tolerance_ && !in_reach(iteration, natural, before_ - last_, last_ - now);
    failed_ = fails ? failed_ + 1 : 0;
    before_ = std::exchange(last_, now);
    ++measured_;
    return failed_ >= 2;
}

bool DecreaseWatch::in_reach(std::int64_t iteration, double natural, double first, double second) const {
    if (!(second > 0.0)) return false;
    const double growth = first > 0.0 ? std::clamp(second / first, 1.0, 2.0) : 1.0;
    const double limit = static_cast<double>(max_iterations_);
    double rest = std::log(natural / tolerance_), fall = growth * second;
    for (double k = static_cast<double>(iteration); k <= limit; k *= 2.0) {
        if (rest <= fall) return k * std::exp2(rest / fall) <= limit;
        rest -= fall;
        fall *= growth;
    }
    return false;
}

StageRunner::StageRunner(const PreparedProblem& problem, Solution& solution, const SolveSettings& settings,
                         SolveReport& report)
    : problem_(problem), best_(solution), settings_(settings), report_(report), started_(settings.warm_start) {}

const Errors& StageRunner::measured_error() {
    if (!error_) error_ = problem_.meter().measure(best_.x, best_.lambda);
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
        problem_.meter().velocity_of(best_.lambda, x);
        worst_ = problem_.meter().natural(x.data(), best_.lambda.data());
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

const PreparedProblem& StageRunner::problem_of(const Stage& stage) {
    const Law law = stage.law.value_or(problem_.problem().law);
    if (law == problem_.problem().law) return problem_;
    if (!other_) other_ = problem_.with_law(law);
    return *other_;
}

bool StageRunner::run(Solver& solver, const Stage& stage) {
    if (stage.patient && !of_attempt_ && worst_ <= settings_.usable) {
        report_.near_goal = true;
        return true;
    }
    const PreparedProblem& problem = problem_of(stage);
    const bool other = &problem != &problem_;
    const bool warm = started_ && !of_attempt_ && (solver.info().capabilities & DELASSUS_CAN_WARM_START) != 0;
    const double tolerance = stage.tolerance > 0.0 ? stage.tolerance : settings_.tolerance;
    DecreaseWatch watch(tolerance, stage.max_iterations);
    const SolveSettings settings = settings_of(stage, watch, warm, problem);
    Solution solution = warm ? best_ : Solution{};
    const SolveReport result = solver.solve(problem, solution, settings);

    const Errors error = other ? problem_.meter().measure(solution.x, solution.lambda) : result.error;
    // Where momenta cancel, rounding alone may leave a large balance error, which is excused where all else is solved.
    const bool solved = result.status == Status::Solved && tolerance == settings_.tolerance && !other;
    // A stage with the other law provides a start for the next one, whatever its error under the problem's own law.
    if (started_ && std::isnan(worst_)) worst_ = worst_of(measured_error());
    if (!started_ || of_attempt_ || worst_of(error) < worst_ || other || solved) {
        of_attempt_ = stage.attempt && (!started_ || of_attempt_);
        best_ = std::move(solution);
        error_ = error;
        worst_ = worst_of(error);
        started_ = true;
    }
    add({result.solver, result.options, problem.problem().law, stage.reason, tolerance, result.status, result.message,
         result.iterations, result.seconds_setup + result.seconds_solve, error.natural},
        result);
    if (result.status == Status::Cancelled || (result.status == Status::Infeasible && !other)) return true;
    if (solved || worst_of(error) <= settings_.tolerance) {
        report_.status = Status::Solved;
        return true;
    }
    if (!stage.to_goal && worst_ <= settings_.needed) {
        report_.near_goal = true;
        return true;
    }
    if (report_.iterations >= settings_.max_iterations) {
        report_.status = Status::IterationLimit;
        return true;
    }
    if (report_.seconds_setup + report_.seconds_solve >= settings_.time_limit) {
        report_.status = Status::TimeLimit;
        return true;
    }
    if (report_.status == Status::Solved) report_.status = Status::Stalled;  // it reached only the goal of this stage
    return false;
}

SolveSettings StageRunner::settings_of(const Stage& stage, DecreaseWatch& watch, bool warm,
                                       const PreparedProblem& problem) const {
    SolveSettings settings = settings_;
    if (stage.tolerance > 0.0) settings.tolerance = std::max(stage.tolerance, settings_.tolerance);
    settings.tolerance *= stage.sharper;
    settings.max_iterations = std::min(stage.max_iterations, settings_.max_iterations - report_.iterations);
    const double seconds_before = report_.seconds_setup + report_.seconds_solve;
    settings.time_limit = settings_.time_limit - seconds_before;
    settings.warm_start = warm;
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
    if (stage.watched)
        settings.give_up = [&watch, &problem](std::int64_t iteration, const double* x, const double* lambda) {
            return watch.due(iteration) && watch.hopeless(iteration, problem.meter().natural(x, lambda));
        };
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
    report_.stages.push_back(stage);
}

std::string StageRunner::sentence() const {
    std::string text;
    for (const auto& stage : report_.stages) {
        if (!text.empty()) text += ", ";
        text += fmt::format("{} ({}{} iterations, {:.1e}{})", stage.solver,
                            stage.law == problem_.problem().law ? "" : fmt::format("{}, ", name_of(stage.law)),
                            stage.iterations, stage.natural,
                            stage.status == Status::Solved ? "" : fmt::format(", {}", name_of(stage.status)));
    }
    return text;
}

}  // namespace delassus
