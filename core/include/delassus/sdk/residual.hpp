// SPDX-License-Identifier: BSD-3-Clause
// The natural error (docs/errors.md): ‖S⁻¹(λ − P_Υ(λ − S²u))‖₂ / ‖S r‖₂.
//
// S holds one scalar for each block c, s_c = (tr N_cc / rows)^(−½), so that cones stay cones and S⁻¹λ and S u share a
// unit (√energy). λ − P_Υ(λ − S²u) is zero exactly at a solution, for any positive scaling that is constant on blocks.
// The divisor belongs to the problem: r = D H⁻¹ a + b are the velocities that the reactions have to correct. If it is
// zero the error is absolute. With the exact Coulomb law u carries the De Saxcé term.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/problem_view.hpp"

namespace delassus::sdk {

/// s_c for every block, from the diagonal of N. A block without mobility (zero trace) takes the mean trace of the
/// others.
void block_scaling(const ConeRange& cones, const Vector& diagonal, std::vector<double>& scaling);
std::vector<double> block_scaling(const ConeRange& cones, const Vector& diagonal);

/// The divisor of the natural error, from ‖S r‖²: ‖S r‖, 1 if that is zero, NaN if it is not finite.
inline double reference_of(double square) {
    if (!std::isfinite(square)) return std::numeric_limits<double>::quiet_NaN();
    return square > 0.0 ? std::sqrt(square) : 1.0;
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
    void assign(const ProblemView& problem, const Vector& diagonal, const Vector& r);

    /// s_c, one a block.
    [[nodiscard]] const std::vector<double>& scaling() const { return scaling_; }
    /// ‖S r‖₂, or 1 if that is zero. NaN, and all errors with it, where double precision does not hold N, the squares
    /// of S, or ‖S r‖².
    [[nodiscard]] double reference() const { return reference_; }
    /// Whether the De Saxcé term is added to u.
    [[nodiscard]] bool coulomb() const { return coulomb_; }

    /// The natural error of λ with the constraint velocities u = D x + E λ + b; both m, both without De Saxcé term.
    template <class Lambda, class Velocity>
    [[nodiscard]] double natural(const Lambda& lambda, const Velocity& u) const {
        return natural(lambda.data(), u.data());
    }
    [[nodiscard]] double natural(const double* lambda, const double* u) const;

    /// One block's share ‖s_c⁻¹(λ_c − P(λ_c − s_c² u_c))‖², not yet divided by the reference.
    [[nodiscard]] double squared_block(std::size_t c, const double* lambda, const double* u) const;

private:
    std::vector<delassus_cone> cones_;
    bool coulomb_ = false;
    std::vector<double> scaling_;
    double reference_ = 1.0;
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/residual_bodies.hpp"
#endif
