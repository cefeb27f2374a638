// SPDX-License-Identifier: BSD-3-Clause
#include "interior_point.hpp"

namespace delassus::ipm {

namespace {

// With exact Coulomb, the error from which on semismooth Newton is the better way to end than hops.
constexpr double error_for_ssn = 1e-5;

KktSettings settings_from(const sdk::OptionValues& options) {
    const std::string form = options.choice("form");
    return {form == "normal"      ? Form::Normal
            : form == "augmented" ? Form::Augmented
                                  : Form::Automatic,
            options.real("regularization"), static_cast<int>(options.integer("refinements"))};
}

}  // namespace

InteriorPoint::InteriorPoint(const sdk::OptionValues& options)
    : Iteration(options, Equations(settings_from(options))),
      shift_first_(options.choice("path") == "shift"),
      most_hops_(options.integer("hops")) {}

// With exact Coulomb a good iterate may lie far from the path: the given one is judged only.
sdk::Outcome InteriorPoint::solve(const sdk::ProblemView& problem, const sdk::Request& request,
                                  sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    if (!problem.coulomb) return Iteration::solve(problem, request, x, lambda);
    return solve_by(
        [this](sdk::Monitor& monitor, Beginning beginning) {
            if (beginning != Beginning::Resumed) start_path();
            iterate(monitor, beginning == Beginning::Resumed);
        },
        problem, request, x, lambda);
}

void InteriorPoint::start_path() {
    start_cold();
    if (shift_first_) cones_.take_shift_path();
    slow_iterations_ = 0;
    halved_error_ = path_error_ = lowest_tau_ = infinity;
    centre_next_ = hops_ = 0;
    jam_ = 0.0;
    rise_ = 1.0;
    hop_.reset();
}

// judged: the iterate was judged by the loop that stopped.
void InteriorPoint::iterate(sdk::Monitor& monitor, bool judged) {
    is_stopped_ = false;
    const auto judge_iterate = [&] {
        const bool stop = judge_step(monitor);
        path_error_ = std::min(path_error_, error_);
        return stop;
    };
    if (hop_) {
        if (!end_hop(judge_iterate)) return;
        judged = false;
    }
    for (;; judged = false) {
        if (!judged) {
            find_residuals();
            if (!step()) return stall_outside(monitor);
            if (judge_iterate()) return;
        }
        if (is_jammed()) {
            if (path_error_ < error_for_ssn || !hop_on(judge_iterate)) {
                if (!is_stopped_) stall(monitor, "the path to the solution ends: steps inside the cones stay short");
                return;
            }
        } else if (is_stuck(monitor.best_residual()) || is_slow()) {
            return stall_idle(monitor);
        }
    }
}

// Near the end the error halves in a step or two, unless short steps or rounding hold it.
bool InteriorPoint::is_slow() {
    ++slow_iterations_;
    if (path_error_ < 0.5 * halved_error_) {
        halved_error_ = path_error_;
        slow_iterations_ = 0;
    }
    return path_error_ < error_for_ssn && stall_iterations_ > 0 && slow_iterations_ >= stall_iterations_;
}

}  // namespace delassus::ipm
