// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/motion_corners.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace delassus::mechanics {

namespace {

/// The corners at which the value, the rate or the acceleration jumps: on both sides of the others they differ by next
/// to nothing.
std::vector<double> jumps_of(const Motion& motion) {
    constexpr double near = 1e-6, share = 1e-3;
    const std::vector<double>& corners = motion.corners;
    std::vector<bool> jumps(corners.size(), false);
    for (const auto* function : {&motion.value, &motion.rate, &motion.acceleration}) {
        if (!*function) continue;
        std::vector<double> change(corners.size());
        double scale = 0.0;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            double spacing = motion.period > 0.0 ? motion.period : 1.0;
            if (i > 0) spacing = std::min(spacing, corners[i] - corners[i - 1]);
            if (i + 1 < corners.size()) spacing = std::min(spacing, corners[i + 1] - corners[i]);
            const double before = (*function)(corners[i] - near * spacing),
                         after = (*function)(corners[i] + near * spacing);
            change[i] = std::abs(after - before);
            scale = std::max({scale, std::abs(before), std::abs(after)});
            for (const double share_of_piece : {0.25, 0.5, 0.75})
                scale = std::max(scale, std::abs((*function)(corners[i] + share_of_piece * spacing)));
        }
        for (std::size_t i = 0; i < corners.size(); ++i) jumps[i] = jumps[i] || change[i] > share * scale;
    }
    std::vector<double> times;
    for (std::size_t i = 0; i < corners.size(); ++i)
        if (jumps[i]) times.push_back(corners[i]);
    return times;
}

}  // namespace

void MotionCorners::Times::add(std::vector<double> times, double period) {
    if (times.empty()) return;
    if (period > 0.0) {
        repeated.push_back({std::move(times), period});
        return;
    }
    const auto middle = static_cast<std::ptrdiff_t>(once.size());
    once.insert(once.end(), times.begin(), times.end());
    std::inplace_merge(once.begin(), once.begin() + middle, once.end());
    once.erase(std::unique(once.begin(), once.end()), once.end());
}

void MotionCorners::add(const Motion& motion) {
    if (!motion.value) return;
    if (!motion.foreseeable) unknown_ = true;
    if (!motion.is_constant) varies_ = true;
    if (motion.oscillation_period > 0.0)
        shortest_oscillation_ = std::min(shortest_oscillation_, motion.oscillation_period);
    if (motion.ramp_duration > 0.0) ramps_.push_back({motion.corners[0], motion.corners[0] + motion.ramp_duration});
    all_.add(motion.corners, motion.period);
    jumps_.add(jumps_of(motion), motion.period);
}

// A ramp that is shorter than some steps begins with one.
double MotionCorners::longest_step(double t) const {
    constexpr double share_of_oscillation = 0.25, share_of_ramp = 0.125;
    double longest = share_of_oscillation * shortest_oscillation_;
    for (const auto& [begin, end] : ramps_)
        if (t < end) longest = std::min(longest, std::max(begin - t, share_of_ramp * (end - begin)));
    return longest;
}

double MotionCorners::Times::after(double t) const {
    double soonest = std::numeric_limits<double>::infinity();
    if (const auto next = std::upper_bound(once.begin(), once.end(), t); next != once.end()) soonest = *next;
    for (const Repeated& one : repeated) {
        // From the period before the one of t on: rounding may put a corner on either side.
        const double periods = std::floor((t - one.times.front()) / one.period);
        for (double k = periods - 1.0; k <= periods + 1.0; k += 1.0)
            for (const double time : one.times)
                if (const double corner = time + k * one.period; corner > t) soonest = std::min(soonest, corner);
    }
    return soonest;
}

}  // namespace delassus::mechanics
