// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/limited_servo.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/impact.hpp"

namespace delassus {

namespace {

/// 1/(1 − exp(−z)) − 1/z, for z ≥ 0.
double share_of_decay(double z) {
    constexpr double small = 1e-3;
    return z < small ? 0.5 + z / 12.0 : -1.0 / std::expm1(-z) - 1.0 / z;
}

}  // namespace

LimitedServo::LimitedServo(const Row& at_theta, const Row& at_end, double theta, double h, double mobility)
    : theta_(theta),
      h_(h),
      stiffness_(theta < 1.0 ? (1.0 / at_end.compliance - 1.0 / at_theta.compliance) / ((1.0 - theta) * h) : 0.0),
      damping_(1.0 / at_theta.compliance - theta * h * stiffness_),
      pull_at_theta_(at_theta.rate / at_theta.compliance),
      pull_at_end_(at_end.rate / at_end.compliance),
      share_(std::max(theta, share_of_decay(h * std::max(damping_, 0.0) * mobility))) {}

double LimitedServo::pull(double share) const {
    const double part = theta_ < 1.0 ? (share - theta_) / (1.0 - theta_) : 0.0;
    return pull_at_theta_ + part * (pull_at_end_ - pull_at_theta_);
}

double LimitedServo::compliance(double struck) const {
    if (!(struck < h_)) return 1.0 / (gain(share_ * h_) * share_ * h_);
    const double rest = rest_after(struck, h_);
    return 1.0 / (gain(0.5 * rest) * rest);
}

double LimitedServo::rate(double struck, double speed) const {
    if (!(struck < h_)) return ((1.0 - share_) * speed + pull(share_) / gain(share_ * h_)) / share_;
    const double rest = rest_after(struck, h_);
    return (stiffness_ * struck * speed + pull(1.0 - 0.5 * rest / h_)) / gain(0.5 * rest);
}

}  // namespace delassus
