// SPDX-License-Identifier: BSD-3-Clause
// One solve by a method that works on a ScaledProblem: starting point, stop, claim, result.
#pragma once

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
    [[nodiscard]] Vector start(const MutableVectorView& lambda);

    /// Judges the iterate λ̂ with its û; true: stop now. Each call after the first counts as an iteration. A claim of
    /// convergence rests on û computed anew; where it fails, stale() tells the caller to renew its û.
    [[nodiscard]] bool check(const Vector& lambda, const Vector& velocity);

    /// The same for a caller that has put the iterate's λ = P λ̂ into unscaled() and knows its natural error.
    [[nodiscard]] bool judge(double residual);
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
    [[nodiscard]] Outcome finish(MutableVectorView x, MutableVectorView lambda);

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

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/scaled_run_bodies.hpp"
#endif
