// SPDX-License-Identifier: BSD-3-Clause
#include "row_scaling.hpp"

#include <cmath>

#include "delassus/sdk/saddle_point.hpp"

namespace delassus::admm {

namespace {

const double equation_factor = std::sqrt(1000.0);

}  // namespace

void RowScaling::analyze(const sdk::ProblemView& problem) {
    definite_ = !problem.needs_any(DELASSUS_CAN_H_SEMIDEFINITE);
    if (definite_) N_.analyze(problem);
}

void RowScaling::factorize(const sdk::ProblemView& problem) {
    if (definite_) {
        N_.factorize(problem);
        diagonal_ = N_.diagonal();
    } else {
        stand_in_ = sdk::magnitude_of_diagonal(problem);
        diagonal_ = sdk::stand_in_diagonal(problem, stand_in_);
    }
    const std::vector<double> block = sdk::block_scaling(problem.cones, diagonal_);
    scale_.resize(problem.m);
    for (std::size_t c = 0; c < problem.cones.size(); ++c) {
        const delassus_cone& cone = problem.cones[c];
        const bool whole = !sdk::is_separable(cone);
        for (std::int32_t i = cone.first_row; i < cone.first_row + cone.rows; ++i)
            scale_[i] = whole || !(diagonal_[i] > 0.0) ? block[c] : 1.0 / std::sqrt(diagonal_[i]);
        if (sdk::operations_of(cone).is_linear) scale_.segment(cone.first_row, cone.rows) *= equation_factor;
    }
}

sdk::Vector RowScaling::free_velocity(const sdk::ProblemView& problem) const {
    if (definite_) return N_.free_velocity(problem);
    sdk::Vector r = problem.b;
    r.noalias() += problem.D * problem.a.cwiseQuotient(stand_in_).eval();
    return r;
}

}  // namespace delassus::admm
