// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "delassus/sdk/cones/description.hpp"

namespace delassus::sdk {

/// μ of a friction cone, which is its first parameter.
inline double friction_coefficient(const delassus_cone& cone) {
    return cone.parameters[0];
}

/// The friction cone ‖λ_t‖ ≤ μ λ_n, its dual μ‖u_t‖ ≤ u_n; normal first, one or two tangents.
struct FrictionCone {
    /// The error measures are relative to velocities, and the exact law adds μ‖u_t‖ to u_n: an error ε of the natural
    /// map leaves one of μ ε in u_n (docs/errors.md, "Large friction").
    static constexpr double largest_coefficient = 1e4;

    static constexpr ConeDescription description = {
        .kind = DELASSUS_CONE_FRICTION,
        .name = "friction",
        .plural = "friction cones",
        .set = "‖λ_t‖ ≤ μ λ_n, normal first",
        .dual = "μ‖u_t‖ ≤ u_n",
        .use = "contact with friction",
        .allowed_rows = "3, or 2 in the plane",
        .least_rows = 2,
        .most_rows = 3,
        .usual_rows = 3,
        .parameter_count = 1,
        .parameters = {{.key = "mu",
                        .name = "friction coefficient",
                        .example = 0.5,
                        .most = largest_coefficient,
                        .why_most = "beyond that, errors within any tolerance hide the velocity along the normal"}},
    };

    static double tangent_norm(int rows, const double* v) {
        return rows == 3 ? std::sqrt(v[1] * v[1] + v[2] * v[2]) : std::abs(v[1]);
    }
    static double tangent_norm(const delassus_cone& cone, const double* v) { return tangent_norm(cone.rows, v); }

    /// Euclidean projection onto {‖v_t‖ ≤ slope · v_n}. With t = ‖v_t‖:
    ///   in the polar cone (slope t ≤ −v_n): 0; first, as with slope 0 and t = 0 a v_n < 0 would count as inside;
    ///   inside (t ≤ slope v_n): v;
    ///   else the nearest point of the generator (1, slope v_t/t): v_n' = (v_n + slope t)/(1 + slope²), v_t' = slope
    ///   v_n' v_t/t.
    static void project_with_slope(double slope, int rows, double* v) {
        const double t = tangent_norm(rows, v);
        if (slope * t <= -v[0]) {
            std::fill_n(v, rows, 0.0);
            return;
        }
        if (t <= slope * v[0]) return;
        v[0] = (v[0] + slope * t) / (1.0 + slope * slope);
        const double factor = slope * v[0] / t;
        for (int i = 1; i < rows; ++i) v[i] *= factor;
    }

    /// As project_with_slope with three rows, without branches. Near the solution of a pile the processor cannot
    /// predict which branch a contact takes, and a wrong prediction costs more than the whole projection.
    static void project_spatial(double slope, double* v) {
        const double t = std::sqrt(v[1] * v[1] + v[2] * v[2]);
        const bool inside = t <= slope * v[0], polar = slope * t <= -v[0];
        const double normal = (v[0] + slope * t) / (1.0 + slope * slope);
        const double factor = slope * normal / t;  // not finite for t = 0 alone, which is inside or polar
        v[0] = polar ? 0.0 : inside ? v[0] : normal;
        const double kept = polar ? 0.0 : inside ? 1.0 : factor;
        v[1] *= kept;
        v[2] *= kept;
    }

    static void project(const delassus_cone& cone, double* lambda) {
        project_with_slope(friction_coefficient(cone), cone.rows, lambda);
    }

    /// Onto {μ‖u_t‖ ≤ u_n}, which for μ = 0 is the half space u_n ≥ 0. With t = ‖u_t‖, outside it and its polar cone {t
    /// ≤ −μ u_n}, the nearest point is on the generator (μ, u_t/t): t' = (t + μ u_n)/(1 + μ²), u_n' = μ t'.
    static void project_dual(const delassus_cone& cone, double* u) {
        project_dual(friction_coefficient(cone), cone.rows, tangent_norm(cone, u), u);
    }
    /// The same, without branches, as project_spatial; t: ‖u_t‖.
    static void project_dual(double mu, int rows, double t, double* u) {
        const bool inside = mu * t <= u[0];
        const double tangent = std::max(0.0, (t + mu * u[0]) / (1.0 + mu * mu));
        const double factor = inside ? 1.0 : t > 0.0 ? tangent / t : 0.0;
        u[0] = inside ? u[0] : mu * tangent;
        for (int i = 1; i < rows; ++i) u[i] *= factor;
    }

    static double gap(const delassus_cone& cone, const double* lambda, const double* u) {
        double sum = 0.0;
        for (int i = 0; i < cone.rows; ++i) sum += lambda[i] * u[i];
        return sum;
    }

    /// The De Saxcé term of the exact Coulomb law (seed, eq. 72): u_n grows by μ‖u_t‖.
    static double de_saxce(const delassus_cone& cone, const double* u) {
        return friction_coefficient(cone) * tangent_norm(cone, u);
    }
};

}  // namespace delassus::sdk
