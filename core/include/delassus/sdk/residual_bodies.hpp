// SPDX-License-Identifier: BSD-3-Clause
// The functions of sdk/residual.hpp (sdk/compiled_once.hpp).
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "delassus/sdk/compiled_once.hpp"
#include "delassus/sdk/residual.hpp"

namespace delassus::sdk {

DELASSUS_SDK_FUNCTION void block_scaling(const ConeRange& cones, const Vector& diagonal, std::vector<double>& scaling) {
    scaling.resize(cones.size());
    double sum = 0.0;
    std::size_t positive = 0;
    for (std::size_t c = 0; c < cones.size(); ++c) {
        scaling[c] = diagonal.segment(cones[c].first_row, cones[c].rows).sum() / cones[c].rows;
        if (scaling[c] > 0.0) {
            sum += scaling[c];
            ++positive;
        }
    }
    const double fallback = positive > 0 ? sum / static_cast<double>(positive) : 1.0;
    for (double& s : scaling) s = 1.0 / std::sqrt(s > 0.0 ? s : fallback);
}

DELASSUS_SDK_FUNCTION std::vector<double> block_scaling(const ConeRange& cones, const Vector& diagonal) {
    std::vector<double> scaling;
    block_scaling(cones, diagonal, scaling);
    return scaling;
}

DELASSUS_SDK_FUNCTION void NaturalResidual::assign(const ProblemView& problem, const Vector& diagonal,
                                                   const Vector& r) {
    cones_.assign(problem.cones.begin(), problem.cones.end());
    coulomb_ = problem.coulomb;
    block_scaling(problem.cones, diagonal, scaling_);
    double sum = 0.0;
    bool held = std::isfinite(diagonal.sum());
    for (std::size_t c = 0; c < cones_.size(); ++c) {
        const double square = scaling_[c] * scaling_[c];
        held = held && square > 0.0 && std::isfinite(square);
        sum += square * r.segment(cones_[c].first_row, cones_[c].rows).squaredNorm();
    }
    reference_ = reference_of(held ? sum : std::numeric_limits<double>::quiet_NaN());
}

DELASSUS_SDK_FUNCTION double NaturalResidual::natural(const double* lambda, const double* u) const {
    double sum = 0.0;
    for (std::size_t c = 0; c < cones_.size(); ++c)
        sum += squared_block(c, lambda + cones_[c].first_row, u + cones_[c].first_row);
    return std::sqrt(sum) / reference_;
}

DELASSUS_SDK_FUNCTION double NaturalResidual::squared_block(std::size_t c, const double* lambda,
                                                            const double* u) const {
    const delassus_cone& cone = cones_[c];
    const double s = scaling_[c];
    double sum = 0.0;
    if (cone.kind == DELASSUS_CONE_FRICTION && cone.rows == 3) {
        const double mu = friction_coefficient(cone), square = s * s;
        double trial[3] = {lambda[0] - square * u[0], lambda[1] - square * u[1], lambda[2] - square * u[2]};
        if (coulomb_) trial[0] -= square * FrictionCone::de_saxce(cone, u);
        FrictionCone::project_spatial(mu, trial);
        for (int i = 0; i < 3; ++i) sum += (lambda[i] - trial[i]) * (lambda[i] - trial[i]);
        return sum / square;
    }
    if (operations_of(cone).is_linear) {
        for (int i = 0; i < cone.rows; ++i) sum += u[i] * u[i];
        return s * s * sum;
    }
    std::array<double, 16> small;
    std::vector<double> large;
    double* trial = small.data();
    if (static_cast<std::size_t>(cone.rows) > small.size()) {
        large.resize(static_cast<std::size_t>(cone.rows));
        trial = large.data();
    }
    for (int i = 0; i < cone.rows; ++i) trial[i] = lambda[i] - s * s * u[i];
    if (coulomb_) trial[0] -= s * s * de_saxce(cone, u);
    project(cone, trial);
    for (int i = 0; i < cone.rows; ++i) sum += (lambda[i] - trial[i]) * (lambda[i] - trial[i]);
    return sum / (s * s);
}

}  // namespace delassus::sdk
