// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "delassus/plugin.h"

namespace delassus::sdk {

/// Frictionless contact and joint stops: λ ≥ 0, u ≥ 0, row by row.
struct NonnegativeCone {
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
