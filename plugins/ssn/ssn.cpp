// SPDX-License-Identifier: BSD-3-Clause
// The order of the phases: proximal subproblems and Newton's method on one law, and the way from the associated law to
// exact Coulomb.
#include "ssn.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus::ssn {

using Patience = SemismoothNewton::Patience;

namespace {

constexpr double first_tau = 0.1;
constexpr double newton_threshold = 1e-2;   // error below which Newton's method is tried without a centre
constexpr std::int64_t direct_solves = 40;  // in which the error under the Coulomb law must halve; else path
constexpr double last_gain = 0.9;           // to which the error must fall in stall_iterations
constexpr Patience associated_patience{200, 0.5};
constexpr Patience path_patience{20, 0.5};
constexpr double path_goal = 1e-7;    // largest error of the points on the way between the laws
constexpr double first_stride = 0.1;  // in θ
constexpr double shortest_stride = 2e-3;

Form form_from(const std::string& choice) {
    return choice == "rows" ? Form::Rows : choice == "velocities" ? Form::Velocities : Form::Automatic;
}

}  // namespace

SemismoothNewton::SemismoothNewton(const sdk::OptionValues& options)
    : system_(form_from(options.choice("form"))),
      stall_iterations_(options.integer("stall_iterations")),
      follow_law_(options.boolean("follow_law")) {
    if (stall_iterations_ == 0) stall_iterations_ = std::numeric_limits<std::int64_t>::max();
}

void SemismoothNewton::analyze(const sdk::ProblemView& problem) {
    scaled_.analyze(problem);
    pattern_is_new_ = true;
}

void SemismoothNewton::factorize(const sdk::ProblemView& problem) {
    scaled_.factorize(problem);
    system_.factorize(problem, scaled_, pattern_is_new_);
    pattern_is_new_ = false;
}

std::int64_t SemismoothNewton::analyses() const {
    return scaled_.unscaled().inverse().analyses() + system_.analyses();
}

std::int64_t SemismoothNewton::factorizations() const {
    return scaled_.unscaled().inverse().factorizations() + system_.factorizations();
}

sdk::Outcome SemismoothNewton::solve(const sdk::ProblemView& problem, const sdk::Request& request,
                                     sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    // iterate() finds a stall itself: the monitor would take the path between the laws for one.
    sdk::ScaledRun run(problem, scaled_, request, 0);
    if (request.resume() && !between_laws_) {
        run.go_on(lambda, best_error_);
        iterate(run, true);
    } else {
        scaled_.load(problem);
        map_.load(scaled_);
        map_.set_law(problem.coulomb ? 1.0 : 0.0);
        const double size = scaled_.r().norm();
        reference_ = size > 0.0 ? size : 1.0;
        between_laws_ = false;
        move_to(run.start(lambda));
        if (!run.check(lambda_, velocity_)) iterate(run, false);
    }
    best_error_ = run.best_residual();
    return run.finish(x, lambda);
}

// Returns where the run asks to stop, or stalls it.
void SemismoothNewton::iterate(sdk::ScaledRun& run, bool resumed) {
    const Patience last{stall_iterations_, last_gain};
    const bool may_follow = map_.law() > 0.0 && follow_law_;
    const Patience direct{std::min(direct_solves, stall_iterations_), 0.5};
    if (!resumed) begin_law(std::min(first_tau, error()));
    if (solve_law(run, 0.0, may_follow ? direct : last) == Result::Stopped) return;
    while (may_follow && !at_rounding()) {
        const Vector before = lambda_;
        const double error_before = error();
        between_laws_ = true;
        if (follow_law(run, std::min(path_goal, 0.01 * error_before)) == Result::Stopped) return;
        between_laws_ = false;
        map_.set_law(1.0);
        if (!(error() <= error_before)) move_to(before);
        begin_law(std::min(first_tau, error()));
        if (solve_law(run, 0.0, last) == Result::Stopped) return;
        if (!(error() <= 0.5 * error_before)) break;
    }
    run.stall(at_rounding() ? "rounding ends the gain" : "the error no longer falls");
}

// From the associated law's solution θ grows to 1 in steps that solve_law follows to an error of `goal`, each from the
// extrapolation of the last two points.
SemismoothNewton::Result SemismoothNewton::follow_law(sdk::ScaledRun& run, double goal) {
    map_.set_law(0.0);
    begin_law(first_tau);
    if (const Result result = solve_law(run, goal, associated_patience); result != Result::Reached) return result;
    double theta = 0.0, stride = first_stride, last_stride = 0.0;
    Vector here = lambda_, before = lambda_;
    while (theta < 1.0) {
        const double next = std::min(1.0, theta + stride);
        map_.set_law(next);
        if (last_stride > 0.0) move_to(here + ((next - theta) / last_stride) * (here - before));
        const std::int64_t since = run.iteration();
        begin_law(std::min(first_tau, 1e-3 * error()));
        const Result result = solve_law(run, goal, path_patience);
        if (result == Result::Stopped) return result;
        if (result == Result::Reached) {
            before = here;
            here = lambda_;
            last_stride = next - theta;
            theta = next;
            if (run.iteration() - since <= 6) stride *= 2.0;
        } else {
            move_to(here);
            stride *= 0.25;
            if (stride < shortest_stride) return result;
        }
    }
    return Result::Reached;
}

// To solve under the law of the map, from the iterate.
void SemismoothNewton::begin_law(double tau) {
    tau_ = tau;
    shrinkage_ = 10.0;
    previous_tau_ = 0.0;
    threshold_ = newton_threshold;
    milestone_ = error();
    waited_ = 0;
}

// Proximal subproblems, and Newton's method on the problem itself where it looks near.
SemismoothNewton::Result SemismoothNewton::solve_law(sdk::ScaledRun& run, double goal, Patience patience) {
    while (error() > goal) {
        if (!std::isfinite(error())) return Result::Failed;
        const std::int64_t before = run.iteration();
        if (error() <= threshold_) {
            if (const Result result = newton(run, goal); result != Result::Failed) return result;
            if (at_rounding()) return Result::Failed;
            threshold_ = 0.3 * error();
        }
        if (proximal_step(run) == Result::Stopped) return Result::Stopped;
        waited_ += run.iteration() - before;
        if (const double now = error(); now <= patience.gain * milestone_) {
            milestone_ = now;
            waited_ = 0;
        } else if (waited_ > patience.solves) {
            return Result::Failed;
        }
    }
    return Result::Reached;
}

// u is the sum of products with rounding ε each: below this its error is noise.
bool SemismoothNewton::at_rounding() {
    const double size = lambda_.norm() + scaled_.r().norm();
    return error() <= 4.0 * std::numeric_limits<double>::epsilon() * size / reference_;
}

}  // namespace delassus::ssn
