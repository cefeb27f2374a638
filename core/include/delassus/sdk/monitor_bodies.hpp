// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/monitor.hpp (sdk/compiled_once.hpp).
#pragma once

#include <cmath>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/monitor.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION bool Monitor::check(std::int64_t iteration, const double* x, const Vector& lambda,
                                          double residual) {
    outcome_.iterations = iteration;
    if (residual < outcome_.residual || std::isnan(outcome_.residual)) {
        outcome_.residual = residual;
        best_ = lambda;
    }
    if (!std::isfinite(residual)) {
        outcome_.message = "the iterates stopped being finite";
        return finish(DELASSUS_NUMERICAL_FAILURE);
    }
    if (residual < 0.99 * milestone_) {
        milestone_ = residual;
        milestone_iteration_ = iteration;
    }
    if (const auto answer = request_.progress(iteration, x, lambda.data()); answer != DELASSUS_CONTINUE)
        return finish(status_of(answer));
    if (residual <= aim * request_.tolerance()) return finish(DELASSUS_SOLVED);
    if (iteration >= request_.max_iterations()) return finish(DELASSUS_ITERATION_LIMIT);
    if (stall_window_ > 0 && iteration - milestone_iteration_ > stall_window_) {
        outcome_.message = "no progress for " + std::to_string(stall_window_) + " iterations";
        return finish(DELASSUS_STALLED);
    }
    return false;
}

}  // namespace delassus::sdk
