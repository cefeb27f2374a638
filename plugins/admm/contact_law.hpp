// SPDX-License-Identifier: BSD-3-Clause
// The law of each block of rows as a map y ↦ λ: the pair (λ, z) with λ − ρ z = y that obeys it, z being the velocity.
//
// Associated law, and all kinds but friction: λ ∈ Υ ⊥ z ∈ Υ* is  −z ∈ N_Υ(λ), so that λ = (1 + N_Υ)⁻¹ y = P_Υ(y), the
// Euclidean projection, for every ρ > 0.
//
// Exact Coulomb law: z_n ≥ 0 ⊥ λ_n ≥ 0, and −z_t is normal to the disc of radius μ λ_n at λ_t (Moreau, Jean). With
// λ_n − ρ z_n = y_n the first gives λ_n = max(0, y_n), and with this radius the second λ_t = P_disc(y_t). The pair is
// unique and explicit; no De Saxcé term has to be guessed. (The map is not a projection: it expands lengths by up to
// √(1 + μ²), and so the convergence theory of the splitting ends here.)
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::admm {

class ContactLaw {
public:
    /// Takes kinds, μ, bounds and the law. scale: m, λ = scale · λ̂; one value for a block that is not separable.
    void load(const sdk::ProblemView& problem, const sdk::Vector& scale) {
        coulomb_ = problem.coulomb;
        blocks_.clear();
        lower_.clear();
        upper_.clear();
        intervals_.clear();
        for (const delassus_cone& cone : problem.cones) {
            if (!sdk::is_separable(cone)) {
                blocks_.push_back(cone);
            } else if (!sdk::operations_of(cone).is_linear) {
                add_intervals(cone, scale);
            }
        }
    }

    /// λ̂ ← the reactions that belong to ŷ; both m, and ŷ may be λ̂. Rows of free cones are copied.
    void apply(const sdk::Vector& y, sdk::Vector& lambda) const {
        if (&lambda != &y) lambda = y;
        for (const delassus_cone& cone : blocks_) {
            double* v = lambda.data() + cone.first_row;
            if (coulomb_ && cone.kind == DELASSUS_CONE_FRICTION) {
                apply_coulomb(cone, v);
            } else {
                sdk::project(cone, v);
            }
        }
        for (std::size_t k = 0; k < intervals_.size(); ++k) {
            double& v = lambda[intervals_[k]];
            v = std::min(upper_[k], std::max(lower_[k], v));
        }
    }

private:
    void add_intervals(const delassus_cone& cone, const sdk::Vector& scale) {
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const auto [lo, hi] = sdk::operations_of(cone).interval(cone, i);
            intervals_.push_back(cone.first_row + i);
            lower_.push_back(lo / scale[cone.first_row + i]);
            upper_.push_back(hi / scale[cone.first_row + i]);
        }
    }

    static void apply_coulomb(const delassus_cone& cone, double* v) {
        if (!(v[0] > 0.0)) {
            std::fill_n(v, cone.rows, 0.0);
            return;
        }
        const double radius = sdk::friction_coefficient(cone) * v[0];
        const double length = sdk::FrictionCone::tangent_norm(cone, v);
        if (length <= radius) return;
        for (std::int32_t i = 1; i < cone.rows; ++i) v[i] *= radius / length;
    }

    bool coulomb_ = false;
    std::vector<delassus_cone> blocks_;
    std::vector<std::int32_t> intervals_;  // rows, with lower_ and upper_
    std::vector<double> lower_, upper_;
};

}  // namespace delassus::admm
