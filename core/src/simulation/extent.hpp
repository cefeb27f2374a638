// SPDX-License-Identifier: BSD-3-Clause
// The extent of places and of bodies (internal).
#pragma once

#include <algorithm>
#include <cmath>

#include "delassus/multibody.hpp"

namespace delassus {

/// The box about places, along the axes of the world, m.
class Extent {
public:
    void widen(const Vector3& place) {
        for (std::size_t i = 0; i < 3; ++i) {
            low_[i] = std::min(low_[i], place[i]);
            high_[i] = std::max(high_[i], place[i]);
        }
    }
    /// 0 where there is no place.
    [[nodiscard]] double half_diagonal() const {
        if (!(low_[0] <= high_[0])) return 0.0;
        return 0.5 * std::hypot(high_[0] - low_[0], high_[1] - low_[1], high_[2] - low_[2]);
    }

private:
    Vector3 low_ = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high_ = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
};

/// The largest radius of gyration about an axis of its frame, m. The body has mass.
[[nodiscard]] inline double radius_of_gyration(const BodyParameters& body) {
    return std::sqrt(std::max({body.inertia.xx, body.inertia.yy, body.inertia.zz}) / body.mass);
}

}  // namespace delassus
