// SPDX-License-Identifier: BSD-3-Clause
// The natural error (docs/errors.md): ‖S⁻¹(λ − P_Υ(λ − S²u))‖₂ / ‖S r‖₂.
//
// S holds one scalar for each block c, s_c = (tr N_cc / rows)^(−½), so that cones stay cones and S⁻¹λ and S u share a
// unit (√energy). λ − P_Υ(λ − S²u) is zero exactly at a solution, for any positive scaling that is constant on blocks.
// The divisor belongs to the problem: r = D H⁻¹ a + b are the velocities that the reactions have to correct. If it is
// zero the error is absolute. With the exact Coulomb law u carries the De Saxcé term.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// s_c for every block, from the diagonal of N. A block without mobility (zero trace) takes the mean trace of the
/// others.
inline void block_scaling(const ConeRange& cones, const Vector& diagonal, std::vector<double>& scaling) {
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
inline std::vector<double> block_scaling(const ConeRange& cones, const Vector& diagonal) {
    std::vector<double> scaling;
    block_scaling(cones, diagonal, scaling);
    return scaling;
}

/// The natural error and its parts for one problem.
class NaturalResidual {
public:
    NaturalResidual() = default;

    /// diagonal: of N, m. r: m.
    NaturalResidual(const ProblemView& problem, const Vector& diagonal, const Vector& r) {
        assign(problem, diagonal, r);
    }

    /// Replaces the former problem; allocates nothing if its sizes were the same.
    void assign(const ProblemView& problem, const Vector& diagonal, const Vector& r) {
        cones_.assign(problem.cones.begin(), problem.cones.end());
        coulomb_ = problem.coulomb;
        block_scaling(problem.cones, diagonal, scaling_);
        double sum = 0.0;
        for (std::size_t c = 0; c < cones_.size(); ++c)
            sum += scaling_[c] * scaling_[c] * r.segment(cones_[c].first_row, cones_[c].rows).squaredNorm();
        reference_ = sum > 0.0 ? std::sqrt(sum) : 1.0;
    }

    /// s_c, one a block.
    [[nodiscard]] const std::vector<double>& scaling() const { return scaling_; }
    /// ‖S r‖₂, or 1 if that is zero.
    [[nodiscard]] double reference() const { return reference_; }
    /// Whether the De Saxcé term is added to u.
    [[nodiscard]] bool coulomb() const { return coulomb_; }

    /// The natural error of λ with the constraint velocities u = D x + E λ + b; both m, both without De Saxcé term.
    template <class Lambda, class Velocity>
    [[nodiscard]] double natural(const Lambda& lambda, const Velocity& u) const {
        double sum = 0.0;
        for (std::size_t c = 0; c < cones_.size(); ++c)
            sum += squared_block(c, lambda.data() + cones_[c].first_row, u.data() + cones_[c].first_row);
        return std::sqrt(sum) / reference_;
    }

    /// One block's share ‖s_c⁻¹(λ_c − P(λ_c − s_c² u_c))‖², not yet divided by the reference.
    [[nodiscard]] double squared_block(std::size_t c, const double* lambda, const double* u) const {
        const delassus_cone& cone = cones_[c];
        const double s = scaling_[c];
        double sum = 0.0;
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

private:
    std::vector<delassus_cone> cones_;
    bool coulomb_ = false;
    std::vector<double> scaling_;
    double reference_ = 1.0;
};

}  // namespace delassus::sdk
