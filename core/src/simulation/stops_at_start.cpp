// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/stops_at_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "simulation/extent.hpp"

namespace delassus {

std::string beyond_stops(const MultibodySystem& system, const State& bodies) {
    constexpr double rounding = 1e-3;
    Extent extent;
    extent.widen({0.0, 0.0, 0.0});
    for (BodyIndex body = 0; body < system.body_count(); ++body) extent.widen(system.pose(bodies, body).position);
    double worst = 1.0;
    std::string sentence;
    for (std::int32_t index = 0; index < system.joint_count(); ++index) {
        const JointParameters& joint = system.joint(index);
        if (std::isnan(joint.lower) && std::isnan(joint.upper)) continue;
        const double value = system.joint_coordinate(bodies, index)[0];
        const double beyond = std::fmax(joint.lower - value, value - joint.upper);
        const bool slides = joint.kind == JointKind::Prismatic;
        const double share = beyond / (rounding * (slides ? extent.half_diagonal() : 1.0));
        if (!(share > worst)) continue;
        worst = share;
        sentence = fmt::format(
            "the joint \"{}\" starts at {:.4g} {}, beyond its stop at {:.4g}, to which it is pushed back slowly; give "
            "it a \"start\" within its stops",
            joint.name, value, slides ? "m" : "rad", value < joint.lower ? joint.lower : joint.upper);
    }
    return sentence;
}

}  // namespace delassus
