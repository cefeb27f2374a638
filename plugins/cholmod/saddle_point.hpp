// SPDX-License-Identifier: BSD-3-Clause
// The linear problem in variables without units, and its residual in extended precision.
#pragma once

#include "cholesky.hpp"

namespace delassus_cholmod {

/// A vector of the saddle-point system: n entries of x, m of λ (or of their right-hand sides).
struct Pair {
    Vector x, lambda;

    Pair() = default;
    Pair(Eigen::Index n, Eigen::Index m) : x(Vector::Zero(n)), lambda(Vector::Zero(m)) {}
    [[nodiscard]] double dot(const Pair& other) const { return x.dot(other.x) + lambda.dot(other.lambda); }
    [[nodiscard]] double norm() const { return std::sqrt(x.squaredNorm() + lambda.squaredNorm()); }
    void add(double factor, const Pair& other) {
        x += factor * other.x;
        lambda += factor * other.lambda;
    }
    void scale(double factor) {
        x *= factor;
        lambda *= factor;
    }
};

/// H̃ = R H R, D̃ = S D R, Ẽ = S E S with x = R x̃, λ = S λ̃, where R ≈ diag(H)^−½ and S ≈ diag(N)^−½ row by row. Both are
/// powers of two, so scaling adds no rounding error. λ̃ and the scaled residuals share the unit √energy.
struct ScaledSystem {
    SparseColumns H;  ///< n × n, both triangles
    SparseRows D;     ///< m × n
    SparseColumns E;  ///< m × m, both triangles
    Vector R, S;      ///< n, m
};

/// The nearest power of two to value^(−½); value > 0.
[[nodiscard]] double inverse_root_power_of_two(double value);

/// (H̃ x̃ − D̃ᵀ λ̃, D̃ x̃ + Ẽ λ̃).
[[nodiscard]] Pair multiply(const ScaledSystem& system, const Pair& v);

/// What is left of the equations, (a − H x + Dᵀ λ, −b − D x − E λ), in the problem's units. Sums are formed in long
/// double: on x86 11 bits more, so that cancelling terms leave a residual with correct digits, which is what iterative
/// refinement gains its accuracy from (Higham, Accuracy and Stability, ch. 12).
[[nodiscard]] Pair residual(const delassus::sdk::ProblemView& problem, const Vector& x, const Vector& lambda);

/// ‖residual‖ / max(‖Hx‖, ‖Dᵀλ‖, ‖a‖), absolute if those are zero; residual: the first part of the above, n.
[[nodiscard]] double balance(const delassus::sdk::ProblemView& problem, const Vector& x, const Vector& lambda,
                             const Vector& residual);

}  // namespace delassus_cholmod
