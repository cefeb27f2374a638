// SPDX-License-Identifier: BSD-3-Clause
#include "problem/infeasibility.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/saddle_point.hpp"

namespace delassus {

namespace {

using sdk::Vector;
using sdk::VectorView;

/// The problem in units of its data.
struct Units {
    explicit Units(const sdk::ProblemView& problem) : R(sdk::magnitude_of_diagonal(problem)), S(problem.m), size(1.0) {
        const std::vector<double> scaling = sdk::block_scaling(problem.cones, sdk::stand_in_diagonal(problem, R));
        Vector r = problem.b;
        if (problem.n > 0) r += problem.D * problem.a.cwiseQuotient(R);
        R = R.cwiseSqrt().cwiseInverse().eval();
        for (std::size_t c = 0; c < problem.cones.size(); ++c)
            S.segment(problem.cones[c].first_row, problem.cones[c].rows).setConstant(scaling[c]);
        if (const double norm = r.cwiseProduct(S).norm(); norm > 0.0) size = norm;
    }
    Vector R, S;
    double size;
};

/// gain / cost, or 0 if the gain ⟨data, direction⟩ is only rounding. length: of the direction.
double bound(const VectorView& data, const Vector& direction, double cost, double length) {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    const double gain = data.dot(direction);
    if (!(gain > 64.0 * epsilon * data.cwiseAbs().dot(direction.cwiseAbs()))) return 0.0;
    return gain / (cost + epsilon * length);
}

// Let d lie in the recession cone of Υ. A solution has ⟨u, d⟩ ≥ 0 with u = D x + E λ + b, hence
//     −bᵀd ≤ xᵀDᵀd + λᵀE d ≤ ‖(R⁻¹x, S⁻¹λ)‖ ‖(R Dᵀd, S E d)‖.
// With Coulomb's law only u_n ≥ 0 holds for a block of friction, so that d has no tangential part there.
double size_by_reactions(const sdk::ProblemView& problem, const Units& units, const Vector& direction) {
    Vector opposite = -direction, minus_d = opposite;  // −d = −λ − P*(−λ) (Moreau)
    for (const auto& cone : problem.cones) {
        auto block = minus_d.segment(cone.first_row, cone.rows);
        sdk::operations_of(cone).project_dual(cone, opposite.data() + cone.first_row);
        block -= opposite.segment(cone.first_row, cone.rows);
        if (problem.coulomb && sdk::operations_of(cone).has_law()) block.tail(cone.rows - 1).setZero();
    }
    double cost = Vector(problem.E * minus_d).cwiseProduct(units.S).norm();
    if (problem.n > 0) cost = std::hypot(cost, Vector(problem.D.transpose() * minus_d).cwiseProduct(units.R).norm());
    return bound(problem.b, minus_d, cost, minus_d.cwiseQuotient(units.S).norm());
}

// Likewise for y with D y in Υ*, where H is singular:
//     aᵀy = xᵀH y − λᵀD y ≤ ‖(R⁻¹x, S⁻¹λ)‖ ‖(R Hᵀy, S (D y − P* D y))‖.
// Where Υ is no cone (a box), ⟨λ, D y⟩ may have any sign, so that P* is zero there.
double size_by_velocities(const sdk::ProblemView& problem, const Units& units, const Vector& y) {
    if (problem.n == 0) return 0.0;
    Vector outside = problem.D * y;
    for (const auto& cone : problem.cones) {
        if (!sdk::operations_of(cone).is_cone) continue;
        Vector inside = outside.segment(cone.first_row, cone.rows);
        sdk::operations_of(cone).project_dual(cone, inside.data());
        outside.segment(cone.first_row, cone.rows) -= inside;
    }
    const double force = Vector(problem.H.transpose() * y).cwiseProduct(units.R).norm();
    return bound(problem.a, y, std::hypot(force, outside.cwiseProduct(units.S).norm()),
                 y.cwiseQuotient(units.R).norm());
}

// A component in range(D) is solver error and spoils the proof; remove it: d̂ ← d̂ − Aᵀ(A Aᵀ + δ)⁻¹A d̂ with d̂ = S⁻¹d,
// A = R DᵀS. Each pass multiplies the component of a singular value σ by δ/(σ² + δ).
Vector without_range(const sdk::ProblemView& problem, const Units& units, const Vector& direction) {
    constexpr int passes = 6;
    if (problem.n == 0) return direction;
    sdk::SparseColumns A = problem.D.transpose();
    A = (units.R.asDiagonal() * A * units.S.asDiagonal()).eval();
    sdk::SparseColumns square = A * sdk::SparseColumns(A.transpose());
    const double delta = 1e-11 * std::max(square.diagonal().maxCoeff(), std::numeric_limits<double>::min());
    sdk::SparseColumns identity(problem.n, problem.n);
    identity.setIdentity();
    square += delta * identity;
    const Eigen::SimplicialLDLT<sdk::SparseColumns> factor(square);
    if (factor.info() != Eigen::Success) return direction;
    Vector scaled = direction.cwiseQuotient(units.S);
    for (int k = 0; k < passes; ++k) scaled -= A.transpose() * factor.solve(A * scaled);
    return scaled.cwiseProduct(units.S);
}

}  // namespace

// The x and λ of an interior-point method diverge along y and d. The residuals of a least-squares answer are proofs:
// −S²u for d, and a + Dᵀλ − H x for y.
double proven_size(const PreparedProblem& prepared, std::span<const double> x_values,
                   std::span<const double> lambda_values) {
    const sdk::ProblemView problem(prepared.raw());
    const Units units(problem);
    const Vector x = VectorView(x_values.data(), problem.n), lambda = VectorView(lambda_values.data(), problem.m);
    Vector u = problem.E * lambda + problem.b, momentum = problem.a;
    if (problem.n > 0) {
        u += problem.D * x;
        momentum += problem.D.transpose() * lambda - problem.H * x;
    }
    const Vector residual = -u.cwiseProduct(units.S.cwiseAbs2());
    const double size =
        std::max({size_by_reactions(problem, units, lambda), size_by_reactions(problem, units, residual),
                  size_by_velocities(problem, units, x), size_by_velocities(problem, units, momentum)}) /
        units.size;
    if (size >= beyond_all_sizes) return size;
    return std::max(size, size_by_reactions(problem, units, without_range(problem, units, residual)) / units.size);
}

}  // namespace delassus
