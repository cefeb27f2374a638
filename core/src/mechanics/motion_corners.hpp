// SPDX-License-Identifier: BSD-3-Clause
// When the motions of a system have corners.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "delassus/multibody.hpp"

namespace delassus::mechanics {

class MotionCorners {
public:
    /// Motions without functions are left out.
    void add(const Motion& motion);
    void add(std::span<const Motion> motions) {
        for (const Motion& motion : motions) add(motion);
    }
    /// The first after t, s; infinity if there is none.
    [[nodiscard]] double after(double t) const { return all_.after(t); }
    /// The first after t at which a value, a rate or an acceleration jumps, s; infinity if there is none.
    [[nodiscard]] double jump_after(double t) const { return jumps_.after(t); }
    /// A step from t on that resolves every Motion::oscillation_period and Motion::ramp_duration, s; infinity if there
    /// are none.
    [[nodiscard]] double longest_step(double t) const;
    /// Whether there is a motion of which nothing is known.
    [[nodiscard]] bool unknown() const { return unknown_; }
    /// Whether something changes with time.
    [[nodiscard]] bool varies() const { return varies_; }

private:
    struct Repeated {
        std::vector<double> times;  ///< ascending, within a period
        double period = 0.0;
    };
    struct Times {
        std::vector<double> once;  // ascending
        std::vector<Repeated> repeated;

        void add(std::vector<double> times, double period);
        [[nodiscard]] double after(double t) const;
    };
    struct Ramp {
        double begin, end;
    };
    Times all_, jumps_;
    std::vector<Ramp> ramps_;
    double shortest_oscillation_ = std::numeric_limits<double>::infinity();
    bool unknown_ = false, varies_ = false;
};

}  // namespace delassus::mechanics
