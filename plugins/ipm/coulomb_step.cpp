// SPDX-License-Identifier: BSD-3-Clause
// The iteration for exact Coulomb. The equations with z ∘ s = τ e and z₀ v = τ are no optimality system, so nothing
// measures progress but themselves: the path to τ = 0 may fold. Steps are therefore cautious, and where they stay short
// the method ends.
#include <algorithm>
#include <cmath>

#include "interior_point.hpp"

namespace delassus::ipm {

namespace {

constexpr double least_reduction = 1e-4;   // of τ
constexpr double fair_prediction = 0.3;    // length from which second-order terms help
constexpr double careful_reduction = 0.3;  // of τ without them
constexpr double neighbourhood = 1e-3;     // smallest product, in units of their mean
constexpr double short_step = 0.2;
constexpr double jammed = 4.0;             // short steps more than half the others
constexpr double equations_for_jam = 0.3;  // rest of the equations from which short steps count

}  // namespace

void InteriorPoint::aim(double tau, bool second_order) {
    cones_.target(tau, second_order, target_);
    find_direction(Equations::tightest_residual);
}

// After a short step the next ones aim at the present products first.
bool InteriorPoint::step() {
    cones_.scale(theta_);
    system_.factorize(cones_, theta_);
    cones_.rows_to_basis(g_);
    const double tau = cones_.mean_product();
    if (!(tau > 0.0)) {
        cones_.target_zero(target_);
        find_direction(Equations::tightest_residual);
        return move(std::min(1.0, step_fraction_ * cones_.longest_step()));
    }
    const double smallest = cones_.smallest_product(0.0) / tau;
    if (centre_next_ > 0) {
        aim(centre_next_ > 1 ? tau : 0.8 * tau, false);
    } else {
        cones_.target_zero(target_);
        find_direction(Equations::predictor_residual);
        const double predicted = std::min(1.0, cones_.longest_step()), rest = 1.0 - predicted;
        const double reduction = std::max(predicted < 0.9 ? rest * rest * rest : rest * rest, least_reduction);
        aim(reduction * tau, predicted > fair_prediction);
        if (const double length = allowed_length(); predicted > fair_prediction && length < fair_prediction) {
            aim(std::max(reduction, careful_reduction) * tau, false);
            if (allowed_length() < length) {
                cones_.target_zero(target_);
                find_direction(Equations::predictor_residual);
                aim(reduction * tau, true);
            }
        }
    }
    double length = allowed_length();
    const double enough = std::min(neighbourhood, 0.5 * smallest);
    for (int k = 0; k < 12 && cones_.smallest_product(length) < enough * cones_.mean_product(length); ++k)
        length *= 0.8;
    jam_ = length < short_step ? jam_ + 1.0 : std::max(jam_ - 0.5, 0.0);
    centre_next_ = length < short_step ? std::min(centre_next_ + 1, 3) : std::max(centre_next_ - 1, 0);
    return move(length);
}

bool InteriorPoint::is_jammed() const {
    return jam_ >= jammed && system_.norm(f_, g_) < equations_for_jam;
}

}  // namespace delassus::ipm
