// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/motion_corners.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace delassus::mechanics {

void MotionCorners::add(const Motion& motion) {
    if (!motion.value) return;
    if (!motion.foreseeable) unknown_ = true;
    if (motion.corners.empty()) return;
    if (motion.period > 0.0) {
        repeated_.push_back({motion.corners, motion.period});
        return;
    }
    const auto middle = static_cast<std::ptrdiff_t>(once_.size());
    once_.insert(once_.end(), motion.corners.begin(), motion.corners.end());
    std::inplace_merge(once_.begin(), once_.begin() + middle, once_.end());
    once_.erase(std::unique(once_.begin(), once_.end()), once_.end());
}

double MotionCorners::after(double t) const {
    double soonest = std::numeric_limits<double>::infinity();
    if (const auto next = std::upper_bound(once_.begin(), once_.end(), t); next != once_.end()) soonest = *next;
    for (const Repeated& one : repeated_) {
        // From the period before the one of t on: rounding may put a corner on either side.
        const double periods = std::floor((t - one.times.front()) / one.period);
        for (double k = periods - 1.0; k <= periods + 1.0; k += 1.0)
            for (const double time : one.times)
                if (const double corner = time + k * one.period; corner > t) soonest = std::min(soonest, corner);
    }
    return soonest;
}

}  // namespace delassus::mechanics
