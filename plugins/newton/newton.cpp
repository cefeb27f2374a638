// SPDX-License-Identifier: BSD-3-Clause
#include "newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus::newton {

namespace {

/// The balance error to reach, as a share of the tolerance: the last steps converge quadratically.
constexpr double aim = 0.3;
/// No balance is asked for below this: it is rounding.
constexpr double rounding = 1e-14;
/// The line search ends where the slope has fallen to this share.
constexpr double enough = 0.05;
constexpr int most_trials = 30;

}  // namespace

VelocityNewton::VelocityNewton(const sdk::OptionValues& options)
    : stall_iterations_(options.integer("stall_iterations")) {}

std::string VelocityNewton::refusal(const sdk::ProblemView& problem) {
    const char* reason = unfit_compliance(problem);
    return reason ? reason : "";
}

void VelocityNewton::analyze(const sdk::ProblemView& problem) {
    reactions_.load(problem);
    matrix_.analyze(problem, reactions_.pieces());
    for (Linearisation* linearisation : {&at_, &trial_}) {
        linearisation->lambda.resize(static_cast<std::size_t>(problem.m));
        linearisation->state.resize(reactions_.pieces().size());
        linearisation->W.resize(reactions_.pieces().size());
    }
}

void VelocityNewton::factorize(const sdk::ProblemView& problem) {
    matrix_.load(problem);
    has_factor_ = false;
}

void VelocityNewton::start_at(const sdk::ProblemView& problem, const sdk::MutableVectorView& x) {
    w_ = problem.b;
    w_.noalias() += problem.D * x;
    momentum_.noalias() = problem.H * x;
    reactions_.evaluate(w_, at_);
}

double VelocityNewton::gradient(const sdk::ProblemView& problem) {
    const Eigen::Map<const sdk::Vector> lambda(at_.lambda.data(), problem.m);
    step_.setZero(problem.n);  // Dᵀλ
    step_.noalias() += problem.D.transpose() * lambda;
    gradient_ = momentum_ - problem.a - step_;
    const double scale = std::max({momentum_.norm(), step_.norm(), problem.a.norm()});
    return scale > 0.0 ? gradient_.norm() / scale : 0.0;
}

// A factor serves as long as no row changes its state and nothing slides: W is the same.
bool VelocityNewton::factorize_at_iterate(const sdk::ProblemView& problem) {
    const bool slides = std::find(at_.state.begin(), at_.state.end(), Piece::State::Sliding) != at_.state.end();
    if (has_factor_ && !slides && factored_ == at_.state) return true;
    ++factorizations_;
    factored_ = at_.state;
    has_factor_ = matrix_.factorize(problem, at_);
    return has_factor_;
}

/// φ'(γ), φ(γ) = f(x + γ d), and the reactions there.
double VelocityNewton::slope(double length) {
    trial_w_ = w_ + length * rates_;
    reactions_.evaluate(trial_w_, trial_);
    const Eigen::Map<const sdk::Vector> lambda(trial_.lambda.data(), w_.size());
    return along_ + length * stiffness_ - rates_.dot(lambda);
}

/// φ'' where slope() was taken last.
double VelocityNewton::curvature() const {
    double sum = stiffness_;
    const auto& pieces = reactions_.pieces();
    for (std::size_t k = 0; k < pieces.size(); ++k) {
        const double* rate = rates_.data() + pieces[k].first;
        const auto& W = trial_.W[k];
        if (pieces[k].rows == 1) {
            sum += W[0] * rate[0] * rate[0];
            continue;
        }
        for (std::int32_t i = 0; i < pieces[k].rows; ++i)
            for (std::int32_t j = 0; j < pieces[k].rows; ++j)
                sum += rate[i] * W[static_cast<std::size_t>(3 * i + j)] * rate[j];
    }
    return sum;
}

// The minimum of the convex φ, whose slope is piecewise smooth: Newton's method within a bracket. At its end trial_
// holds what acts there.
double VelocityNewton::search(const sdk::ProblemView& problem) {
    rates_.noalias() = problem.D * step_;
    change_.noalias() = problem.H * step_;
    stiffness_ = step_.dot(change_);
    along_ = (momentum_ - problem.a).dot(step_);
    const double first = gradient_.dot(step_);
    double low = 0.0, high = std::numeric_limits<double>::infinity(), length = 1.0;
    for (int trial = 1;; ++trial) {
        const double slope_here = slope(length);
        if (std::abs(slope_here) <= -enough * first || trial == most_trials) return length;
        (slope_here > 0.0 ? high : low) = length;
        const double next = length - slope_here / curvature();
        length = next > low && next < high ? next : std::isinf(high) ? 2.0 * length : 0.5 * (low + high);
    }
}

sdk::Outcome VelocityNewton::solve(const sdk::ProblemView& problem, const sdk::Request& request,
                                   sdk::MutableVectorView x, sdk::MutableVectorView lambda) {
    reactions_.load(problem);  // bounds may be others
    start_at(problem, x);
    sdk::Outcome outcome;
    const double goal = std::max(aim * request.tolerance(), rounding);
    double least = std::numeric_limits<double>::infinity();
    std::int64_t best = 0;
    const auto end = [&](delassus_status status, const char* message = "") {
        outcome.status = status;
        outcome.message = message;
        std::copy(at_.lambda.begin(), at_.lambda.end(), lambda.data());
        return outcome;
    };
    for (std::int64_t iteration = 0;; ++iteration) {
        outcome.iterations = iteration;
        const double error = gradient(problem);
        if (!std::isfinite(error)) return end(DELASSUS_NUMERICAL_FAILURE, "the iterates stopped being finite");
        if (error < least) {
            least = error;
            best = iteration;
        }
        // With x the natural error would be 0 from the start: all of the error is in the balance.
        if (const auto answer = request.progress(iteration, nullptr, at_.lambda.data()); answer != DELASSUS_CONTINUE)
            return end(sdk::status_of(answer));
        if (error <= goal) return end(DELASSUS_SOLVED);
        if (iteration >= request.max_iterations()) return end(DELASSUS_ITERATION_LIMIT);
        if (stall_iterations_ > 0 && iteration - best >= stall_iterations_)
            return end(DELASSUS_STALLED, "the error no longer falls");
        if (!factorize_at_iterate(problem))
            return end(DELASSUS_NUMERICAL_FAILURE, "the matrix of a Newton step is not positive definite");
        step_ = -gradient_;
        matrix_.solve(step_);
        const double length = search(problem);
        x += length * step_;
        momentum_ += length * change_;
        w_ += length * rates_;
        std::swap(at_, trial_);
    }
}

}  // namespace delassus::newton
