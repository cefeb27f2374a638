// SPDX-License-Identifier: BSD-3-Clause
// The bookkeeping that iterative solvers share: the stop, progress, the best iterate, stall detection.
#pragma once

#include <limits>
#include <string>

#include "delassus/sdk/solver.hpp"

namespace delassus::sdk {

/// Watches one solve. Call check() once an iteration with the natural error of the iterate; stop when it says so, then
/// return outcome() after copying best() where the solver keeps it.
class Monitor {
public:
    /// stall_window: iterations without an improvement of the best residual by one part in a hundred that count as a
    /// stall; 0 = never.
    Monitor(const Request& request, std::int64_t stall_window) : request_(request), stall_window_(stall_window) {}

    /// True: stop now. x may be null. Iteration 0 is the starting point.
    [[nodiscard]] bool check(std::int64_t iteration, const double* x, const Vector& lambda, double residual);

    /// Of a solve that goes on (Request::resume): the best iterate (m) until now, and its residual. Call it in place of
    /// the check() of iteration 0.
    void go_on(const Vector& best, double residual) {
        best_ = best;
        outcome_.residual = milestone_ = residual;
    }

    /// The iterate with the smallest residual that check() has seen, and the first of them until one has a residual
    /// that is finite; m. Empty before the first check().
    [[nodiscard]] const Vector& best() const { return best_; }
    [[nodiscard]] double best_residual() const { return outcome_.residual; }
    [[nodiscard]] Outcome& outcome() { return outcome_; }

    /// Solvers aim a little below the tolerance, so that rounding in the host's own measurement does not turn a true
    /// claim into a false one.
    static constexpr double aim = 0.99;

private:
    bool finish(delassus_status status) {
        outcome_.status = status;
        return true;
    }

    const Request& request_;
    std::int64_t stall_window_;
    double milestone_ = std::numeric_limits<double>::infinity();
    std::int64_t milestone_iteration_ = 0;
    Vector best_;
    Outcome outcome_;
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/monitor_bodies.hpp"
#endif
