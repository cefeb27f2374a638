// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/scaled_run.hpp (sdk/compiled_once.hpp).
#pragma once

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/scaled_run.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION Vector ScaledRun::start(const MutableVectorView& lambda) {
    Vector scaled = Vector::Zero(problem_.m);
    if (request_.warm_start() && lambda.allFinite()) scaled = lambda.array() / scaled_.scaling().array();
    scaled_.project(scaled);
    return scaled;
}

DELASSUS_SDK_FUNCTION bool ScaledRun::check(const Vector& lambda, const Vector& velocity) {
    lambda_ = lambda.array() * scaled_.scaling().array();
    return judge(scaled_.natural(lambda, velocity));
}

DELASSUS_SDK_FUNCTION bool ScaledRun::judge(double residual) {
    stale_ = false;
    if (residual <= Monitor::aim * request_.tolerance()) {
        residual = scaled_.measured(problem_, lambda_, x_);
        stale_ = residual > Monitor::aim * request_.tolerance();
    }
    latest_ = residual;
    return monitor_.check(iteration_++, nullptr, lambda_, residual);
}

DELASSUS_SDK_FUNCTION Outcome ScaledRun::finish(MutableVectorView x, MutableVectorView lambda) {
    if (monitor_.best().size() == problem_.m && monitor_.best().allFinite()) {
        lambda = monitor_.best();
    } else {
        lambda.setZero();
    }
    x = scaled_.unscaled().velocity(problem_, lambda);
    return monitor_.outcome();
}

}  // namespace delassus::sdk
