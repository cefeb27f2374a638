// SPDX-License-Identifier: BSD-3-Clause
// When the motions of a system have corners.
#pragma once

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
    [[nodiscard]] double after(double t) const;
    /// Whether there is a motion of which nothing is known.
    [[nodiscard]] bool unknown() const { return unknown_; }

private:
    struct Repeated {
        std::vector<double> times;  ///< ascending, within a period
        double period = 0.0;
    };
    std::vector<double> once_;  // ascending
    std::vector<Repeated> repeated_;
    bool unknown_ = false;
};

}  // namespace delassus::mechanics
