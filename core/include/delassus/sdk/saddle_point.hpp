// SPDX-License-Identifier: BSD-3-Clause
// The linear special case, for solvers that work on the whole matrix:
//
//     K z = f,   K = [H Dᵀ; D −E],   z = {x; −λ},   f = {a; −b}          (docs/problem.md; free rows only)
//
// Scaling. Masses, inertias and units spread the entries of K over many decades. With a diagonal matrix C the
// symmetric system (C K C)(C⁻¹ z) = C f has entries of order one: C_i = h_i^(−½) for x, where h_i = H_ii (definite H)
// or what balances the rows of H (Ruiz, 2001), and C_k = ν_k^(−½) for λ, where ν_k = Σ_i D_ki² C_i² + E_kk ≈ N_kk. So
// mass ratios leave D and only the coupling of constraints remains. The factors are powers of two: scaling rounds
// nothing.
//
// Residuals are accumulated in long double, so that iterative refinement reaches the accuracy of the stored answer
// (Higham, Accuracy and Stability of Numerical Algorithms, chapter 12).
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/sdk/sparse_lu.hpp"

namespace delassus::sdk {

/// |diag H|, with the mean of the others in place of zeros (1 if all are zero); n. H may be of any structure.
Vector magnitude_of_diagonal(const ProblemView& problem);

/// The diagonal of D diag(h)⁻¹ Dᵀ + E, which stands in for that of N where H⁻¹ does not exist; h: n, positive; m.
Vector stand_in_diagonal(const ProblemView& problem, const Vector& h);

/// The factors C, first n for x, then m for λ.
Vector saddle_point_scaling(const ProblemView& problem);

/// Visits every entry of C K C as visit(row, column, value), both triangles; then the whole diagonal again with
/// the shift: +shift for x, −shift for λ. Places that are visited twice add up. The order and the places depend on
/// the pattern alone.
template <class Visitor>
void visit_saddle_point(const ProblemView& problem, const Vector& C, double shift, Visitor&& visit) {
    const auto n = static_cast<std::int32_t>(problem.n), m = static_cast<std::int32_t>(problem.m);
    for (std::int32_t i = 0; i < n; ++i)
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry) {
            const auto j = static_cast<std::int32_t>(entry.col());
            visit(i, j, C[i] * entry.value() * C[j]);
        }
    for (std::int32_t k = 0; k < m; ++k) {
        for (SparseRowsView::InnerIterator entry(problem.D, k); entry; ++entry) {
            const auto j = static_cast<std::int32_t>(entry.col());
            const double value = C[n + k] * entry.value() * C[j];
            visit(n + k, j, value);
            visit(j, n + k, value);
        }
        for (SparseRowsView::InnerIterator entry(problem.E, k); entry; ++entry) {
            const auto j = static_cast<std::int32_t>(entry.col());
            visit(n + k, n + j, -C[n + k] * entry.value() * C[n + j]);
        }
    }
    for (std::int32_t i = 0; i < n; ++i) visit(i, i, shift);
    for (std::int32_t k = 0; k < m; ++k) visit(n + k, n + k, -shift);
}

/// result ← Kᵀ w, both in the problem's units.
void apply_saddle_point_transposed(const ProblemView& problem, const Vector& w, Vector& result);

/// The errors of (x, λ) by which the host judges a linear problem, and the residual of K z = f.
///
/// As in the host, S and r of the natural error are exact for a definite H; for a semidefinite or indefinite one
/// |diag H|⁻¹ stands in for H⁻¹. For an unsymmetric H, r is exact (LU) and |diag H|⁻¹ is used in S alone, where the
/// host takes N exactly: the two measures then differ by the spread of S over the blocks, and aim() leaves room for it.
class SaddlePointError {
public:
    void analyze(const ProblemView& problem);

    /// Values of H, D or E are new.
    void factorize(const ProblemView& problem);

    /// a or b are new: call it at the start of every solve.
    void begin(const ProblemView& problem);

    /// Both errors of an iterate.
    struct Value {
        double natural = std::numeric_limits<double>::infinity();
        double balance = std::numeric_limits<double>::infinity();
        [[nodiscard]] double worst() const { return std::max(natural, balance); }
    };

    /// Both errors of (x, λ); residual ← f − K {x; −λ} (n + m, the problem's units) if it is not null.
    /// Infinite errors if something is not finite.
    [[nodiscard]] Value measure(const ProblemView& problem, const Eigen::Ref<const Vector>& x,
                                const Eigen::Ref<const Vector>& lambda, Vector* residual = nullptr);

    /// Whether the host will call this solved.
    [[nodiscard]] bool meets(const Value& value, double tolerance) const {
        return value.natural <= aim() * tolerance && value.balance <= aim() * std::max(tolerance, 1e-12);
    }
    [[nodiscard]] double aim() const { return unsymmetric_ ? 0.1 : 0.99; }

private:
    bool definite_ = false, unsymmetric_ = false, lu_done_ = false;
    DelassusOperator N_;
    SparseLu lu_;
    Vector magnitude_, diagonal_, u_;
    NaturalResidual natural_;
    std::vector<long double> forces_;
};

}  // namespace delassus::sdk

#ifndef DELASSUS_SDK_COMPILED
#include "delassus/sdk/saddle_point_bodies.hpp"
#endif
