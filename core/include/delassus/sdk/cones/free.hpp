// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "delassus/sdk/cones/description.hpp"

namespace delassus::sdk {

/// Bilateral rows: Υ = Rᵏ, Υ* = {0}.
struct FreeCone {
    static constexpr ConeDescription description = {
        .kind = DELASSUS_CONE_FREE,
        .name = "free",
        .plural = "free rows",
        .set = "Rᵏ",
        .dual = "{0}",
        .use = "bilateral constraints",
        .allowed_rows = "at least one",
        .is_linear = true,
    };

    static Interval interval(const delassus_cone&, std::int32_t) { return {}; }
    static void project(const delassus_cone&, double*) {}
    static void project_dual(const delassus_cone& cone, double* u) { std::fill_n(u, cone.rows, 0.0); }
    static double gap(const delassus_cone& cone, const double* lambda, const double* u) {
        double sum = 0.0;
        for (int i = 0; i < cone.rows; ++i) sum += lambda[i] * u[i];
        return sum;
    }
};

}  // namespace delassus::sdk
