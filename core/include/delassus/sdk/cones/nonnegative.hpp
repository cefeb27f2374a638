// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "delassus/sdk/cones/description.hpp"

namespace delassus::sdk {

/// Frictionless contact and joint stops: λ ≥ 0, u ≥ 0, row by row.
struct NonnegativeCone {
    static constexpr ConeDescription description = {
        .kind = DELASSUS_CONE_NONNEGATIVE,
        .name = "nonnegative",
        .plural = "nonnegative rows",
        .set = "λ ≥ 0",
        .dual = "u ≥ 0",
        .use = "frictionless contact, stops",
        .allowed_rows = "at least one",
    };

    static Interval interval(const delassus_cone&, std::int32_t) { return {.lo = 0.0}; }
    static void project(const delassus_cone& cone, double* lambda) {
        for (int i = 0; i < cone.rows; ++i) lambda[i] = std::max(0.0, lambda[i]);
    }
    static void project_dual(const delassus_cone& cone, double* u) { project(cone, u); }
    static double gap(const delassus_cone& cone, const double* lambda, const double* u) {
        double sum = 0.0;
        for (int i = 0; i < cone.rows; ++i) sum += lambda[i] * u[i];
        return sum;
    }
};

}  // namespace delassus::sdk
