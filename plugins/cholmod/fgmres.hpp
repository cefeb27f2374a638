// SPDX-License-Identifier: BSD-3-Clause
// Flexible GMRES (Saad 1993) on the scaled saddle-point system, with the shifted factor as its preconditioner.
#pragma once

#include <cmath>
#include <vector>

#include "shifted_factor.hpp"

namespace delassus_cholmod {

/// Approximates the solution of A v = right, A = [H̃ −D̃ᵀ; D̃ Ẽ], with the smallest residual over the span of the
/// preconditioned Krylov vectors. Plain proximal iterations shrink an eigenvector of N with the eigenvalue σ by
/// δ/(δ + σ) a step, which is slow for the few σ ≪ δ of a chain with a heavy end; the Krylov space deals with each such
/// vector in one step. A is singular where rows are redundant; for a consistent system that does no harm.
/// before_step() is asked before each step and ends the iteration by returning false. steps: how many were made.
template <class BeforeStep>
[[nodiscard]] Pair fgmres(const ShiftedFactor& factor, const Pair& right, double reduction, int max_steps,
                          BeforeStep&& before_step, int& steps) {
    Pair correction(right.x.size(), right.lambda.size());
    steps = 0;
    const double start = right.norm();
    if (!(start > 0.0)) return correction;
    std::vector<Pair> basis{right}, preconditioned;
    basis[0].scale(1.0 / start);
    Eigen::MatrixXd hessenberg = Eigen::MatrixXd::Zero(max_steps + 1, max_steps);
    Vector transformed = Vector::Zero(max_steps + 1);
    std::vector<double> cosine, sine;
    transformed[0] = start;
    while (steps < max_steps && before_step()) {
        const int k = steps;
        preconditioned.push_back(factor.solve(basis.back()));
        Pair next = multiply(factor.system(), preconditioned.back());
        // A has the size 1. A direction that it shrinks to rounding level lies in its null space: nothing is gained
        // there.
        const double rounding = 4e-15 * preconditioned.back().norm();
        // Modified Gram–Schmidt, twice, for orthogonality to rounding.
        for (int pass = 0; pass < 2; ++pass)
            for (int i = 0; i <= k; ++i) {
                const double projection = basis[static_cast<std::size_t>(i)].dot(next);
                hessenberg(i, k) += projection;
                next.add(-projection, basis[static_cast<std::size_t>(i)]);
            }
        const double length = next.norm();
        if (!std::isfinite(length)) {
            preconditioned.pop_back();
            break;
        }
        for (int i = 0; i < k; ++i) {
            const double upper = hessenberg(i, k), lower = hessenberg(i + 1, k);
            hessenberg(i, k) = cosine[static_cast<std::size_t>(i)] * upper + sine[static_cast<std::size_t>(i)] * lower;
            hessenberg(i + 1, k) =
                -sine[static_cast<std::size_t>(i)] * upper + cosine[static_cast<std::size_t>(i)] * lower;
        }
        const double radius = std::hypot(hessenberg(k, k), length);
        if (!(radius > rounding)) {
            preconditioned.pop_back();
            break;
        }
        cosine.push_back(hessenberg(k, k) / radius);
        sine.push_back(length / radius);
        hessenberg(k, k) = radius;
        transformed[k + 1] = -sine.back() * transformed[k];
        transformed[k] *= cosine.back();
        ++steps;
        if (std::abs(transformed[k + 1]) <= reduction * start || !(length > rounding)) break;
        next.scale(1.0 / length);
        basis.push_back(std::move(next));
    }
    const auto size = static_cast<Eigen::Index>(preconditioned.size());
    const Vector weights =
        hessenberg.topLeftCorner(size, size).triangularView<Eigen::Upper>().solve(transformed.head(size));
    for (Eigen::Index i = 0; i < size; ++i) correction.add(weights[i], preconditioned[static_cast<std::size_t>(i)]);
    return correction;
}

}  // namespace delassus_cholmod
