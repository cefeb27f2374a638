// SPDX-License-Identifier: BSD-3-Clause
// One solve by a method that works on a ScaledProblem: starting point, stop, claim, result.
#pragma once

#include <cmath>
#include <string>
#include <utility>

#include "delassus/sdk/monitor.hpp"
#include "delassus/sdk/scaled_problem.hpp"

namespace delassus::sdk {

/// One solve by a method that works on a ScaledProblem.
class ScaledRun {
public:
    /// scaled must be loaded with problem; all must outlive the run. stall_window: as of Monitor.
    ScaledRun(const ProblemView& problem, const ScaledProblem& scaled, const Request& request,
              std::int64_t stall_window)
        : problem_(problem), scaled_(scaled), request_(request), monitor_(request, stall_window) {}

    /// The projected starting point: the given reactions (m, the problem's units) or zero.
    [[nodiscard]] Vector start(const MutableVectorView& lambda) {
        Vector scaled = Vector::Zero(problem_.m);
        if (request_.warm_start() && lambda.allFinite()) scaled = lambda.array() / scaled_.scaling().array();
        scaled_.project(scaled);
        return scaled;
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
        return monitor_.check(iteration_++, nullptr, lambda_, residual);
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
    /// The natural error of the latest iterate.
    [[nodiscard]] double residual() const { return latest_; }
    [[nodiscard]] std::int64_t iteration() const { return iteration_; }

    /// Leaves the best iterate in x (n) and lambda (m), and says how the solve ended.
    [[nodiscard]] Outcome finish(MutableVectorView x, MutableVectorView lambda) {
        if (monitor_.best().size() == problem_.m && monitor_.best().allFinite()) {
            lambda = monitor_.best();
        } else {
            lambda.setZero();
        }
        x = scaled_.unscaled().velocity(problem_, lambda);
        return monitor_.outcome();
    }

private:
    const ProblemView& problem_;
    const ScaledProblem& scaled_;
    const Request& request_;
    Monitor monitor_;
    Vector lambda_, x_;
    double latest_ = 0.0;
    std::int64_t iteration_ = 0;
    bool stale_ = false;
};

}  // namespace delassus::sdk
