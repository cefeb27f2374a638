// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "delassus/sdk/cones/description.hpp"

namespace delassus::sdk {

/// ‖λ‖ ≤ r, and ⟨u, y − λ⟩ ≥ 0 for all y in the ball: u = 0 inside, and against λ on the sphere. Friction of constant
/// threshold in two directions. Only in builds with DELASSUS_TEST_CONE: it shows what a new kind takes.
struct BallCone {
    static constexpr ConeDescription description = {
        .kind = 4,
        .name = "ball",
        .plural = "balls",
        .set = "‖λ‖ ≤ r",
        .dual = "the variational inequality of the ball",
        .use = "friction of constant threshold in a plane",
        .allowed_rows = "2 to 6",
        .least_rows = 2,
        .most_rows = largest_block_rows,
        .usual_rows = 2,
        .parameter_count = 1,
        .parameters = {{.key = "radius", .name = "radius", .example = 1.5, .is_reaction = true}},
        .is_cone = false,
    };

    static double norm(const delassus_cone& cone, const double* v) {
        double square = 0.0;
        for (int i = 0; i < cone.rows; ++i) square += v[i] * v[i];
        return std::sqrt(square);
    }
    static void project(const delassus_cone& cone, double* lambda) {
        const double radius = cone.parameters[0], length = norm(cone, lambda);
        if (length <= radius) return;
        for (int i = 0; i < cone.rows; ++i) lambda[i] *= radius / length;
    }
    /// A bounded set recedes in no direction, so that u may be anything.
    static void project_dual(const delassus_cone&, double*) {}
    /// ⟨u, λ⟩ − min over y in the ball of ⟨u, y⟩.
    static double gap(const delassus_cone& cone, const double* lambda, const double* u) {
        double sum = cone.parameters[0] * norm(cone, u);
        for (int i = 0; i < cone.rows; ++i) sum += u[i] * lambda[i];
        return sum;
    }
};

}  // namespace delassus::sdk
