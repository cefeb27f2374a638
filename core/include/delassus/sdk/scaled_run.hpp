// SPDX-License-Identifier: BSD-3-Clause
// One solve by a method that works on a ScaledProblem, or on a part of one: starting point, stop, claim, result.
#pragma once

#include <string>
#include <utility>

#include "delassus/sdk/monitor.hpp"
#include "delassus/sdk/scaled_problem.hpp"

namespace delassus::sdk {

/// One solve by a method that works on a Scaled, which is a ScaledProblem or has its operations for the rows that one
/// process holds. All numbers that decide are then the same in all processes.
template <class Scaled>
class ScaledRunOf {
public:
    using View = typename Scaled::View;

    /// scaled must be loaded with problem; all must outlive the run. stall_window: as of Monitor.
    ScaledRunOf(const View& problem, const Scaled& scaled, const Request& request, std::int64_t stall_window)
        : problem_(problem), scaled_(scaled), request_(request), monitor_(request, stall_window) {}

    /// The projected starting point: the given reactions (m, the problem's units) or zero.
    [[nodiscard]] Vector start(const MutableVectorView& lambda) const {
        Vector scaled = Vector::Zero(problem_.m);
        if (request_.warm_start() && scaled_.everywhere(lambda.allFinite()))
            scaled = lambda.array() / scaled_.scaling().array();
        scaled_.project(scaled);
        return scaled;
    }

    /// Of a solve that goes on (Request::resume): what the last run left in lambda (m), and its best residual. Call it
    /// in place of the first check().
    void go_on(const MutableVectorView& lambda, double residual) {
        lambda_ = lambda;
        latest_ = residual;
        monitor_.go_on(lambda_, residual);
        iteration_ = 1;
    }

    /// Judges the iterate λ̂ with its û; true: stop now. Each call after the first counts as an iteration. A claim of
    /// convergence rests on û computed anew; where it fails, stale() tells the caller to renew its û.
    [[nodiscard]] bool check(const Vector& lambda, const Vector& velocity) {
        lambda_ = lambda.array() * scaled_.scaling().array();
        return judge(scaled_.natural(lambda, velocity));
    }

    /// The same for a caller that has put the iterate's λ = P λ̂ into unscaled() and knows its natural error.
    [[nodiscard]] bool judge(double residual) {
        stale_ = false;
        if (residual <= Monitor::aim * request_.tolerance()) {
            residual = scaled_.measured(problem_, lambda_, x_);
            stale_ = residual > Monitor::aim * request_.tolerance();
        }
        latest_ = residual;
        if (monitor_.check(iteration_++, nullptr, lambda_, residual)) return true;
        scaled_.next_iteration();
        return false;
    }
    [[nodiscard]] Vector& unscaled() { return lambda_; }

    /// Counts a product with N that made no new iterate; true: stop now.
    [[nodiscard]] bool count() { return monitor_.check(iteration_++, nullptr, lambda_, latest_); }

    /// Ends the run as stalled, with the reason why the method finds no better iterate.
    void stall(std::string reason) {
        monitor_.outcome().status = DELASSUS_STALLED;
        monitor_.outcome().message = std::move(reason);
    }

    [[nodiscard]] bool stale() const { return stale_; }
    /// The smallest natural error of all iterates.
    [[nodiscard]] double best_residual() const { return monitor_.best_residual(); }
    /// The natural error of the latest iterate.
    [[nodiscard]] double residual() const { return latest_; }
    [[nodiscard]] std::int64_t iteration() const { return iteration_; }

    /// Leaves the best iterate in x (n) and lambda (m), and says how the solve ended.
    [[nodiscard]] Outcome finish(MutableVectorView x, MutableVectorView lambda) {
        scaled_.end_iterations();
        const Vector& best = monitor_.best();
        if (scaled_.everywhere(best.size() == problem_.m && best.allFinite())) {
            lambda = best;
        } else {
            lambda.setZero();
        }
        x = scaled_.velocity(problem_, lambda);
        return monitor_.outcome();
    }

private:
    const View& problem_;
    const Scaled& scaled_;
    const Request& request_;
    Monitor monitor_;
    Vector lambda_, x_;
    double latest_ = 0.0;
    std::int64_t iteration_ = 0;
    bool stale_ = false;
};

using ScaledRun = ScaledRunOf<ScaledProblem>;

}  // namespace delassus::sdk
