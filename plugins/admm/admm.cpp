// SPDX-License-Identifier: BSD-3-Clause
#include "admm.hpp"

#include <cmath>

namespace delassus::admm {

struct Admm::Run {
    const sdk::ProblemView& problem;
    const sdk::Request& request;
    Measure measure;
    sdk::Monitor monitor;
    std::int64_t iteration = 0;
};

Admm::Admm(const sdk::OptionValues& options)
    : initial_penalty_(options.real("rho")),
      over_relaxation_(options.real("over_relaxation")),
      adaptive_(options.boolean("adaptive_rho")),
      memory_(static_cast<int>(options.integer("memory"))),
      stall_iterations_(options.integer("stall_iterations")),
      resolvent_(options.choice("form") == "primal" ? Resolvent::Form::Primal
                 : options.choice("form") == "dual" ? Resolvent::Form::Dual
                                                    : Resolvent::Form::Automatic) {
    const std::string acceleration = options.choice("acceleration");
    acceleration_ = acceleration == "none"       ? Acceleration::None
                    : acceleration == "nesterov" ? Acceleration::Nesterov
                                                 : Acceleration::Anderson;
}

void Admm::analyze(const sdk::ProblemView& problem) {
    scaling_.analyze(problem);
    resolvent_.analyze();
}

void Admm::factorize(const sdk::ProblemView& problem) {
    scaling_.factorize(problem);
    resolvent_.load_matrices(problem, scaling_);
    resolvent_.set_penalty(initial_penalty_);
}

sdk::Outcome Admm::solve(const sdk::ProblemView& problem, const sdk::Request& request, sdk::MutableVectorView x,
                         sdk::MutableVectorView lambda) {
    // Not the penalty that the last solve ended with: a run that goes on from a checkpoint has to take the same path.
    resolvent_.set_penalty(initial_penalty_);
    const sdk::Vector r = scaling_.free_velocity(problem);
    law_.load(problem, scaling_.scale());
    resolvent_.load(problem, r);
    Run run{problem, request, Measure(problem, scaling_, r), sdk::Monitor(request, stall_iterations_)};
    start(run, request.warm_start() && x.allFinite() && lambda.allFinite(), x, lambda);
    if (!run.monitor.check(0, scaling_.definite() ? nullptr : x_.data(), reactions_, run.measure.claim(reactions_, x_)))
        iterate(run);
    lambda = run.monitor.best();
    x = scaling_.definite() ? scaling_.N().velocity(problem, lambda) : best_x_;
    return run.monitor.outcome();
}

// The given reactions, or none, put onto Υ; the state ŷ that a solution with these λ̂ and û would have.
void Admm::start(Run& run, bool warm, const sdk::MutableVectorView& x, const sdk::MutableVectorView& lambda) {
    const auto n = run.problem.n, m = run.problem.m;
    for (sdk::Vector* v : {&z_, &w_, &mu_, &u_, &step_, &plain_, &last_}) v->resize(m);
    x_ = sdk::Vector::Zero(n);
    lambda_ = sdk::Vector::Zero(m);
    if (warm) {
        x_ = x;
        lambda_ = lambda.cwiseQuotient(scaling_.scale());
        law_.apply(lambda_, lambda_);
    }
    reactions_ = lambda_.cwiseProduct(scaling_.scale());
    if (scaling_.definite()) x_ = scaling_.N().velocity(run.problem, reactions_);
    best_x_ = x_;
    y_ = lambda_ - resolvent_.penalty() * scaling_.scale().cwiseProduct(run.measure.velocity(reactions_, x_));
}

void Admm::iterate(Run& run) {
    anderson_.reset(run.problem.m, memory_);
    penalty_rule_.reset(run.problem.m);
    forget();
    bool extrapolated = false;
    double accepted = 0.0;  // ‖step‖ of the latest point that was not rejected
    while (true) {
        ++run.iteration;
        law_.apply(y_, lambda_);
        w_ = 2.0 * lambda_ - y_;
        resolvent_.apply(w_, mu_, u_);
        if (judge(run)) return;

        // ‖μ − λ‖ is the combined residual of Goldstein et al. (2014); under a convex law a plain step never grows it.
        step_ = over_relaxation_ * (mu_ - lambda_);
        const double length = step_.norm();
        if (extrapolated && !(length <= accepted)) {
            y_ = plain_;
            forget();
            extrapolated = false;
            continue;
        }
        accepted = length;
        plain_ = y_ + step_;
        extrapolated = !(adaptive_ && change_penalty(run)) && extrapolate();
    }
}

// μ̂ and û obey the equations of motion exactly, so that their natural error costs no product with N; a claim rests on
// velocities computed anew. True: stop.
bool Admm::judge(Run& run) {
    reactions_ = mu_.cwiseProduct(scaling_.scale());
    velocities_ = u_.cwiseQuotient(scaling_.scale());
    if (!scaling_.definite()) x_ = resolvent_.x();
    double error = run.measure.natural(reactions_, velocities_);
    if (error <= sdk::Monitor::aim * run.request.tolerance()) error = run.measure.claim(reactions_, x_);
    if (!scaling_.definite() && error < run.monitor.best_residual()) best_x_ = x_;
    return run.monitor.check(run.iteration, scaling_.definite() ? nullptr : x_.data(), reactions_, error);
}

// Asks the rule; on a change ŷ moves so that λ̂ and ẑ of the point after the step stay.
bool Admm::change_penalty(const Run& run) {
    const double before = resolvent_.penalty();
    z_ = (lambda_ - y_) / before;
    const double after = penalty_rule_.next(lambda_, z_, run.monitor.best_residual(), run.iteration, before);
    if (after == before) return false;
    resolvent_.set_penalty(after);
    law_.apply(plain_, lambda_);
    y_ = lambda_ + (after / before) * (plain_ - lambda_);
    forget();
    return true;
}

// ŷ ← the next point. True: it is extrapolated, and has to prove itself.
bool Admm::extrapolate() {
    switch (acceleration_) {
        case Acceleration::None:
            break;
        case Acceleration::Anderson:
            anderson_.push(step_, plain_);
            if (anderson_.extrapolate(y_)) return true;
            break;
        case Acceleration::Nesterov: {
            const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * theta_ * theta_));
            const double momentum = has_last_ ? (theta_ - 1.0) / next : 0.0;
            y_ = plain_ + momentum * (plain_ - last_);
            last_ = plain_;
            has_last_ = true;
            theta_ = next;
            return momentum > 0.0;
        }
    }
    y_ = plain_;
    return false;
}

void Admm::forget() {
    anderson_.clear();
    theta_ = 1.0;
    has_last_ = false;
    last_.setZero();
}

}  // namespace delassus::admm
