// SPDX-License-Identifier: BSD-3-Clause
// The error measures as sums over cones, for whoever has the cones: all of a problem, or those of one process.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "delassus/errors.hpp"
#include "delassus/sdk/cones.hpp"

namespace delassus {

/// The measures of Errors as sums over the cones: of squares, except for the gap.
struct ConeSums {
    double natural = 0.0, cone = 0.0, dual = 0.0, gap = 0.0, siconos = 0.0;
    double velocity = 0.0;  ///< ‖u‖²
    double rounding = 0.0;

    void operator+=(const ConeSums& other) {
        natural += other.natural;
        cone += other.cone;
        dual += other.dual;
        gap += other.gap;
        siconos += other.siconos;
        velocity += other.velocity;
        rounding += other.rounding;
    }
};

/// Projections through the table of cones, and those that fill most problems without it.
struct AnyCone {
    const sdk::ConeOperations& operations;
    [[nodiscard]] static std::int32_t rows(const delassus_cone& cone) { return cone.rows; }
    [[nodiscard]] bool is_linear() const { return operations.is_linear; }
    void project(const delassus_cone& cone, double* lambda) const { operations.project(cone, lambda); }
    void project_dual(const delassus_cone& cone, double* u) const { operations.project_dual(cone, u); }
    [[nodiscard]] double gap(const delassus_cone& cone, const double* lambda, const double* u) const {
        return operations.gap(cone, lambda, u);
    }
};
/// Friction with three rows, without branches.
struct SpatialFriction : sdk::FrictionCone {
    explicit SpatialFriction(const delassus_cone& cone) : mu(sdk::friction_coefficient(cone)) {}
    const double mu;  // a copy, since the compiler must assume that projections overwrite the cone

    [[nodiscard]] static constexpr std::int32_t rows(const delassus_cone&) { return 3; }
    [[nodiscard]] static constexpr bool is_linear() { return false; }

    void project(const delassus_cone&, double* lambda) const { project_spatial(mu, lambda); }
    void project_dual(const delassus_cone&, double* u) const {
        FrictionCone::project_dual(mu, 3, std::sqrt(u[1] * u[1] + u[2] * u[2]), u);
    }
};

/// λ, u: of the cone's rows, u with the De Saxcé term where the law asks for it. s: the scale of the block. trial:
/// memory for as many.
template <class Projections>
void add_cone(const Projections& on, const delassus_cone& cone, double s, const double* lambda, const double* u,
              double* trial, ConeSums& sums) {
    const std::int32_t rows = on.rows(cone);
    const double square = s * s;
    const auto squared_distance = [&](const double* from) {
        double sum = 0.0;
        for (std::int32_t i = 0; i < rows; ++i) sum += (from[i] - trial[i]) * (from[i] - trial[i]);
        return sum;
    };
    double squared_velocity = 0.0;
    for (std::int32_t i = 0; i < rows; ++i) squared_velocity += u[i] * u[i];
    sums.velocity += squared_velocity;
    if (on.is_linear()) {  // λ cancels; leaving it out avoids its rounding
        sums.natural += square * squared_velocity;
    } else {
        for (std::int32_t i = 0; i < rows; ++i) trial[i] = lambda[i] - square * u[i];
        on.project(cone, trial);
        sums.natural += squared_distance(lambda) / square;
    }
    for (std::int32_t i = 0; i < rows; ++i) trial[i] = lambda[i];
    on.project(cone, trial);
    sums.cone += squared_distance(lambda) / square;
    for (std::int32_t i = 0; i < rows; ++i) trial[i] = lambda[i] - u[i];
    on.project(cone, trial);
    sums.siconos += squared_distance(lambda);
    for (std::int32_t i = 0; i < rows; ++i) trial[i] = u[i];
    on.project_dual(cone, trial);
    sums.dual += squared_distance(u) * square;
    sums.gap += on.gap(cone, lambda, u);
}

/// Adds what one block contributes. s: its scale. λ, u, magnitude: of its rows; u = D x + E λ + b, which gets the De
/// Saxcé term under the Coulomb law, and the sums of the magnitudes of its terms. trial: memory for as many.
inline void add_block(const delassus_cone& cone, double s, bool coulomb, const double* lambda, double* u,
                      const double* magnitude, double* trial, ConeSums& sums) {
    for (std::int32_t i = 0; i < cone.rows; ++i) {
        const double scaled = s * magnitude[i] + std::abs(lambda[i]) / s;
        sums.rounding += scaled * scaled;
    }
    if (coulomb) u[0] += sdk::de_saxce(cone, u);
    if (cone.kind == DELASSUS_CONE_FRICTION && cone.rows == 3) {
        std::array<double, 3> of_three;
        add_cone(SpatialFriction(cone), cone, s, lambda, u, of_three.data(), sums);
    } else {
        add_cone(AnyCone{sdk::operations_of(cone)}, cone, s, lambda, u, trial, sums);
    }
}

inline double ratio(double numerator, double denominator) {
    return denominator > 0.0 ? numerator / denominator : numerator;
}

/// The measures from their sums. reference: ‖S r‖, or 1 if that is zero; the norms: ‖r‖ and ‖λ‖.
inline Errors errors_of(const ConeSums& sums, double reference, double r_norm, double lambda_norm, double balance) {
    Errors errors;
    errors.natural = std::sqrt(sums.natural) / reference;
    errors.balance = balance;
    errors.cone = std::sqrt(sums.cone) / reference;
    errors.dual = std::sqrt(sums.dual) / reference;
    errors.gap = std::abs(sums.gap) / (reference * reference);
    errors.siconos = ratio(std::sqrt(sums.siconos), std::max({r_norm, lambda_norm, std::sqrt(sums.velocity)}));
    errors.rounding = 0.5 * std::numeric_limits<double>::epsilon() * std::sqrt(sums.rounding) / reference;
    return errors;
}

}  // namespace delassus
