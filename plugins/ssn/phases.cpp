// SPDX-License-Identifier: BSD-3-Clause
// Newton's method, a proximal subproblem, and their line searches.
#include <algorithm>
#include <cmath>
#include <limits>

#include "ssn.hpp"

namespace delassus::ssn {

namespace {

constexpr double smallest_tau = 1e-13;
constexpr double largest_tau = 1e3;
constexpr int most_solves = 25;        // of a subproblem
constexpr int watch = 6;               // solves without a better iterate after which a Coulomb subproblem ends
constexpr double allowed_growth = 10;  // of its merit over its best so far
constexpr int failures_allowed = 2;    // Newton steps in a row that do not halve the error

}  // namespace

double SemismoothNewton::merit(const Vector& lambda, const Vector& u, const Proximal& proximal) {
    map_.evaluate(lambda, u, proximal, F_);
    return F_.norm() / reference_;
}

void SemismoothNewton::move_to(const Vector& lambda) {
    lambda_ = lambda;
    scaled_.gradient(lambda_, velocity_);
}

bool SemismoothNewton::direction(const Proximal& proximal) {
    map_.linearise(lambda_, velocity_, proximal, F_, normal_, local_);
    return system_.solve(scaled_, map_, proximal.tau, normal_, local_, step_, product_);
}

// The first of t = 1, 1/2, … ≥ shortest with a merit of at most `enough`, or the best of them; value ← its merit.
double SemismoothNewton::merit_search(const Proximal& proximal, double enough, double shortest, double& value) {
    double length = 0.0;
    value = std::numeric_limits<double>::infinity();
    for (double t = 1.0; t >= shortest && value > enough; t *= 0.5) {
        trial_ = lambda_ + t * step_;
        trial_velocity_ = velocity_ + t * product_;
        const double here = merit(trial_, trial_velocity_, proximal);
        if (here < value) {
            value = here;
            length = t;
        }
    }
    return length;
}

// The zero of φ'(t) = (N δ)ᵀ(λ + tδ − Π(c − σ u(λ + tδ))) in (0, 1], to a tenth of φ'(0), by bracketed secants; φ is
// convex. 1 if φ' at 1 is small enough, or if rounding hides the descent.
double SemismoothNewton::convex_search(const Proximal& proximal) {
    const auto slope = [&](double t) {
        trial_ = lambda_ + t * step_;
        trial_velocity_ = velocity_ + t * product_;
        map_.evaluate(trial_, trial_velocity_, proximal, F_);
        return product_.dot(F_);
    };
    const double start = slope(0.0);
    if (!(start < 0.0)) return 1.0;
    double low = 0.0, high = 1.0, at_low = start, at_high = slope(1.0);
    if (at_high <= -0.3 * start) return 1.0;
    double t = 1.0;
    for (int k = 0; k < 20; ++k) {
        t = low + (high - low) * std::clamp(-at_low / (at_high - at_low), 0.1, 0.9);
        const double value = slope(t);
        if (std::abs(value) <= -0.1 * start) break;
        (value < 0.0 ? low : high) = t;
        (value < 0.0 ? at_low : at_high) = value;
    }
    return t;
}

// c = λ: τ acts on the matrix only, and falls with the error.
SemismoothNewton::Result SemismoothNewton::newton(sdk::ScaledRun& run, double goal) {
    constexpr int rounding_steps = 300;
    double f = error(), best = f, cap = tau_;
    int failures = 0, without_gain = 0;
    while (f > goal) {
        const Proximal here{std::max(smallest_tau, std::min(cap, f)), 1.0, nullptr};
        double value = f, length = 0.0;
        if (direction(here)) length = merit_search({}, 0.5 * f, 0.1, value);
        if (length > 0.0 && value < f) {
            move_to(lambda_ + length * step_);
            if (run.check(lambda_, velocity_)) return Result::Stopped;
        } else if (run.count()) {
            return Result::Stopped;
        }
        failures = value <= 0.5 * f ? 0 : failures + 1;
        f = error();
        // At rounding level the search may find a fall that the same point, taken anew, does not have.
        if (f <= 0.5 * best) {
            best = f;
            without_gain = 0;
        } else if (++without_gain > rounding_steps) {
            return Result::Failed;
        }
        if (failures > failures_allowed) return Result::Failed;
        if (length == 1.0) cap *= 0.2;
    }
    return Result::Reached;
}

// One subproblem with centre c = Π(λ) and weight τ, to a tenth of the error at c; chooses the τ of the next.
SemismoothNewton::Result SemismoothNewton::proximal_step(sdk::ScaledRun& run) {
    const bool convex = map_.law() == 0.0;
    centre_ = lambda_;
    scaled_.project(centre_);
    move_to(centre_);
    const Proximal measure{tau_, 1.0, &centre_};
    const Proximal subproblem{tau_, convex ? 1.0 / tau_ : 1.0, &centre_};
    const double goal = 0.1 * error();
    if (!convex) start_subproblem(measure);
    double best = merit(lambda_, velocity_, measure);
    int best_at = 0, k = 0;
    bool failed = false;
    kept_ = lambda_;
    for (; k < most_solves && best > goal && !failed; ++k) {
        if (!direction(subproblem)) {
            failed = true;
            if (run.count()) return Result::Stopped;
            break;
        }
        double value = 0.0;
        const double length =
            convex ? convex_search(subproblem) : merit_search(subproblem, allowed_growth * best, 0.05, value);
        move_to(lambda_ + length * step_);
        const bool stopped = run.check(lambda_, velocity_);
        value = merit(lambda_, velocity_, measure);
        if (value < best) {
            best = value;
            best_at = k;
            kept_ = lambda_;
        }
        if (stopped) {
            move_to(kept_);
            return Result::Stopped;
        }
        failed = !convex && (k - best_at >= watch || value > 100.0 * best);
    }
    if (!convex) move_to(kept_);
    previous_ = centre_;
    previous_tau_ = failed ? 0.0 : tau_;
    choose_next_weight(failed, k);
    return Result::Reached;
}

// The solutions of the subproblems follow dλ/ds = −(velocities that are still wrong), s = Σ 1/τ: the last step,
// stretched to the new τ, predicts the next one. It is used if it is better than the centre.
void SemismoothNewton::start_subproblem(const Proximal& measure) {
    if (!(previous_tau_ > 0.0)) return;
    const double at_centre = merit(lambda_, velocity_, measure);
    trial_ = centre_ + (previous_tau_ / measure.tau) * (centre_ - previous_);
    scaled_.project(trial_);
    scaled_.gradient(trial_, trial_velocity_);
    if (merit(trial_, trial_velocity_, measure) >= at_centre) return;
    lambda_ = trial_;
    velocity_ = trial_velocity_;
}

void SemismoothNewton::choose_next_weight(bool failed, int solves) {
    if (failed) {
        tau_ *= 4.0;
        shrinkage_ = std::max(1.3, std::sqrt(shrinkage_));
    } else if (solves <= 6) {
        tau_ /= shrinkage_;
        shrinkage_ = std::min(10.0, 1.3 * shrinkage_);
    } else {
        tau_ *= solves > 15 ? 2.0 : 0.5;
    }
    tau_ = std::clamp(tau_, smallest_tau, largest_tau);
}

}  // namespace delassus::ssn
