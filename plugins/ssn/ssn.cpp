// SPDX-License-Identifier: BSD-3-Clause
// The order of the phases: proximal subproblems and Newton's method on one law, and the way from the associated law to
// exact Coulomb.
#include "ssn.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus::ssn {

namespace {

constexpr double first_tau = 0.1;
constexpr double newton_threshold = 1e-2;  // error below which Newton's method is tried without a centre
constexpr std::int64_t patience = 40;      // solves in which the error must fall by half, or another way is tried
constexpr double path_goal = 1e-7;         // error of the points on the way between the laws
constexpr double first_stride = 0.1;       // in θ
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
    scaled_.load(problem);
    map_.load(scaled_);
    map_.set_law(problem.coulomb ? 1.0 : 0.0);
    const double size = scaled_.r().norm();
    reference_ = size > 0.0 ? size : 1.0;
    sdk::ScaledRun run(problem, scaled_, request,
                       0);  // the stall is found here: the way between the laws looks like one
    move_to(run.start(lambda));
    const bool stopped = run.check(lambda_, velocity_);
    if (!stopped) iterate(run);
    return run.finish(x, lambda);
}

// Returns where the run asks to stop, or stalls it.
void SemismoothNewton::iterate(sdk::ScaledRun& run) {
    tau_ = std::min(first_tau, error());
    if (map_.law() > 0.0 && follow_law_) {
        if (solve_law(run, 0.0, std::min(patience, stall_iterations_)) == Result::Stopped) return;
        if (!at_rounding()) {
            const Vector direct = lambda_;
            const double before = error();
            if (follow_law(run) == Result::Stopped) return;
            map_.set_law(1.0);
            if (error() > before) move_to(direct);
            tau_ = std::min(first_tau, error());
        }
    }
    if (solve_law(run, 0.0, stall_iterations_) == Result::Stopped) return;
    run.stall(at_rounding() ? "rounding ends the gain" : "the error no longer falls");
}

// θ grows from 0 to 1 in steps that solve_law follows, each from the extrapolation of the last two points.
SemismoothNewton::Result SemismoothNewton::follow_law(sdk::ScaledRun& run) {
    map_.set_law(0.0);
    tau_ = first_tau;
    if (const Result result = solve_law(run, path_goal, 5 * patience); result != Result::Reached) return result;
    double theta = 0.0, stride = first_stride, last_stride = 0.0;
    Vector here = lambda_, before = lambda_;
    while (theta < 1.0) {
        const double next = std::min(1.0, theta + stride);
        map_.set_law(next);
        if (last_stride > 0.0) move_to(here + ((next - theta) / last_stride) * (here - before));
        const std::int64_t since = run.iteration();
        tau_ = std::min(first_tau, 1e-3 * error());
        const Result result = solve_law(run, path_goal, patience / 2);
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

// Proximal subproblems, and Newton's method on the problem itself where it looks near. patience: solves in which the
// error must fall by half.
SemismoothNewton::Result SemismoothNewton::solve_law(sdk::ScaledRun& run, double goal, std::int64_t patience) {
    double threshold = newton_threshold;
    double milestone = error();
    std::int64_t since = run.iteration();
    shrinkage_ = 10.0;
    previous_tau_ = 0.0;
    while (error() > goal) {
        if (error() <= threshold) {
            if (const Result result = newton(run, goal); result != Result::Failed) return result;
            if (at_rounding()) return Result::Failed;
            threshold = 0.3 * error();
        }
        if (proximal_step(run) == Result::Stopped) return Result::Stopped;
        if (const double now = error(); now <= 0.5 * milestone) {
            milestone = now;
            since = run.iteration();
        } else if (run.iteration() - since > patience) {
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
