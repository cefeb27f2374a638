// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "delassus/sdk/cones/description.hpp"

namespace delassus::sdk {

/// Motors with limits, friction of constant threshold: lo ≤ λ ≤ hi, and ⟨u, y − λ⟩ ≥ 0 for all y in the box, that is,
/// u = 0 inside, u ≥ 0 at lo, u ≤ 0 at hi.
struct BoxCone {
    static constexpr ConeDescription description = {
        .kind = DELASSUS_CONE_BOX,
        .name = "box",
        .plural = "box rows",
        .set = "lo ≤ λ ≤ hi, infinite bounds allowed",
        .dual = "the variational inequality of the box",
        .use = "motors with limits, friction of constant threshold",
        .allowed_rows = "at least one",
        .has_bounds = true,
        .is_cone = false,
    };

    static Interval interval(const delassus_cone& cone, std::int32_t row) { return {cone.lo[row], cone.hi[row]}; }
    static void project(const delassus_cone& cone, double* lambda) {
        for (int i = 0; i < cone.rows; ++i) lambda[i] = std::min(cone.hi[i], std::max(cone.lo[i], lambda[i]));
    }

    /// A box has no dual cone; what every solution's u obeys is the dual of its recession cone: u ≥ 0 where only hi is
    /// infinite, u ≤ 0 where only lo is, u = 0 where both are, and nothing where both are finite.
    static void project_dual(const delassus_cone& cone, double* u) {
        for (int i = 0; i < cone.rows; ++i) {
            if (std::isinf(cone.hi[i])) u[i] = std::max(0.0, u[i]);
            if (std::isinf(cone.lo[i])) u[i] = std::min(0.0, u[i]);
        }
    }

    /// The variational inequality's gap ⟨u, λ⟩ − min over y in the box of ⟨u, y⟩, at infinite bounds only the part that
    /// project_dual does not already judge.
    static double gap(const delassus_cone& cone, const double* lambda, const double* u) {
        double sum = 0.0;
        for (int i = 0; i < cone.rows; ++i) {
            const double bound = u[i] > 0.0 ? cone.lo[i] : cone.hi[i];
            if (std::isfinite(bound)) sum += u[i] * (lambda[i] - bound);
        }
        return sum;
    }
};

}  // namespace delassus::sdk
