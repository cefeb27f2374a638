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

#include <Eigen/SparseLU>
#include <cmath>
#include <limits>
#include <vector>

#include "delassus/sdk/delassus_operator.hpp"
#include "delassus/sdk/residual.hpp"

namespace delassus::sdk {

/// |diag H|, with the mean of the others in place of zeros (1 if all are zero); n. H may be of any structure.
inline Vector magnitude_of_diagonal(const ProblemView& problem) {
    Vector diagonal = Vector::Zero(problem.n);
    for (Eigen::Index i = 0; i < problem.n; ++i)
        for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
            if (entry.col() == i) diagonal[i] = std::abs(entry.value());
    const auto positive = (diagonal.array() > 0.0).count();
    const double mean = positive > 0 ? diagonal.sum() / static_cast<double>(positive) : 1.0;
    for (auto& value : diagonal)
        if (!(value > 0.0)) value = mean;
    return diagonal;
}

/// The diagonal of D diag(h)⁻¹ Dᵀ + E, which stands in for that of N where H⁻¹ does not exist; h: n, positive; m.
inline Vector stand_in_diagonal(const ProblemView& problem, const Vector& h) {
    Vector diagonal = Vector::Zero(problem.m);
    for (Eigen::Index i = 0; i < problem.m; ++i) {
        for (SparseRowsView::InnerIterator entry(problem.D, i); entry; ++entry)
            diagonal[i] += entry.value() * entry.value() / h[entry.col()];
        for (SparseRowsView::InnerIterator entry(problem.E, i); entry; ++entry)
            if (entry.col() == i) diagonal[i] += entry.value();
    }
    return diagonal;
}

/// The factors C, first n for x, then m for λ.
inline Vector saddle_point_scaling(const ProblemView& problem) {
    const auto power_of_two = [](double square) {  // the nearest to square^(−½)
        return square > 0.0 ? std::exp2(std::round(-0.5 * std::log2(square))) : 1.0;
    };
    Vector C = Vector::Ones(problem.n + problem.m);
    if (problem.needs_any(DELASSUS_CAN_H_INDEFINITE | DELASSUS_CAN_H_UNSYMMETRIC)) {
        for (int round = 0; round < 6; ++round) {
            Vector largest = Vector::Zero(problem.n);
            for (Eigen::Index i = 0; i < problem.n; ++i)
                for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry) {
                    const double value = std::abs(entry.value()) * C[i] * C[entry.col()];
                    largest[i] = std::max(largest[i], value);
                    largest[entry.col()] = std::max(largest[entry.col()], value);
                }
            for (Eigen::Index i = 0; i < problem.n; ++i) C[i] *= power_of_two(largest[i]);
        }
    } else {
        const Vector h = magnitude_of_diagonal(problem);
        for (Eigen::Index i = 0; i < problem.n; ++i) C[i] = power_of_two(h[i]);
    }
    for (Eigen::Index k = 0; k < problem.m; ++k) {
        double nu = 0.0;
        for (SparseRowsView::InnerIterator entry(problem.D, k); entry; ++entry)
            nu += entry.value() * entry.value() * C[entry.col()] * C[entry.col()];
        for (SparseRowsView::InnerIterator entry(problem.E, k); entry; ++entry)
            if (entry.col() == k) nu += std::abs(entry.value());
        C[problem.n + k] = power_of_two(nu);
    }
    return C;
}

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
inline void apply_saddle_point_transposed(const ProblemView& problem, const Vector& w, Vector& result) {
    result.resize(problem.n + problem.m);
    result.head(problem.n) = problem.H.transpose() * w.head(problem.n) + problem.D.transpose() * w.tail(problem.m);
    result.tail(problem.m) = problem.D * w.head(problem.n);
    if (problem.E.nonZeros() > 0) result.tail(problem.m) -= problem.E.transpose() * w.tail(problem.m);
}

/// The errors of (x, λ) by which the host judges a linear problem, and the residual of K z = f.
///
/// As in the host, S and r of the natural error are exact for a definite H; for a semidefinite or indefinite one
/// |diag H|⁻¹ stands in for H⁻¹. For an unsymmetric H, r is exact (LU) and |diag H|⁻¹ is used in S alone, where the
/// host takes N exactly: the two measures then differ by the spread of S over the blocks, and aim() leaves room for it.
class SaddlePointError {
public:
    void analyze(const ProblemView& problem) {
        definite_ = problem.n > 0 &&
                    problem.needs_any(DELASSUS_CAN_H_DIAGONAL | DELASSUS_CAN_H_BLOCKS | DELASSUS_CAN_H_DEFINITE);
        unsymmetric_ = problem.needs_any(DELASSUS_CAN_H_UNSYMMETRIC);
        if (definite_ && problem.m > 0) N_.analyze(problem);
    }

    /// Values of H, D or E are new.
    void factorize(const ProblemView& problem) {
        if (problem.m == 0) return;
        if (definite_) {
            N_.factorize(problem);
            diagonal_ = N_.diagonal();
            return;
        }
        magnitude_ = magnitude_of_diagonal(problem);
        diagonal_.setZero(problem.m);
        for (Eigen::Index k = 0; k < problem.m; ++k) {
            for (SparseRowsView::InnerIterator entry(problem.D, k); entry; ++entry)
                diagonal_[k] += entry.value() * entry.value() / magnitude_[entry.col()];
            for (SparseRowsView::InnerIterator entry(problem.E, k); entry; ++entry)
                if (entry.col() == k) diagonal_[k] += entry.value();
        }
        if (unsymmetric_) {
            const SparseColumns H = problem.H;
            lu_.compute(H);
            lu_done_ = lu_.info() == Eigen::Success;
        }
    }

    /// a or b are new: call it at the start of every solve.
    void begin(const ProblemView& problem) {
        if (problem.m == 0) return;
        Vector r = problem.b;
        if (definite_) {
            r = N_.free_velocity(problem);
        } else if (problem.n > 0) {
            Vector v;
            if (unsymmetric_ && lu_done_) v = lu_.solve(Vector(problem.a));
            if (v.size() == 0 || !v.allFinite()) v = problem.a.cwiseQuotient(magnitude_);
            r += problem.D * v;
        }
        natural_ = NaturalResidual(problem, diagonal_, r);
    }

    /// Both errors of an iterate.
    struct Value {
        double natural = std::numeric_limits<double>::infinity();
        double balance = std::numeric_limits<double>::infinity();
        [[nodiscard]] double worst() const { return std::max(natural, balance); }
    };

    /// Both errors of (x, λ); residual ← f − K {x; −λ} (n + m, the problem's units) if it is not null.
    /// Infinite errors if something is not finite.
    template <class X, class Lambda>
    [[nodiscard]] Value measure(const ProblemView& problem, const X& x, const Lambda& lambda,
                                Vector* residual = nullptr) {
        const Eigen::Index n = problem.n, m = problem.m;
        forces_.assign(static_cast<std::size_t>(n), 0.0L);
        u_.resize(m);
        for (Eigen::Index k = 0; k < m; ++k) {
            long double sum = problem.b[k];
            for (SparseRowsView::InnerIterator entry(problem.D, k); entry; ++entry) {
                const long double value = entry.value();
                sum += value * x[entry.col()];
                forces_[static_cast<std::size_t>(entry.col())] += value * lambda[k];
            }
            for (SparseRowsView::InnerIterator entry(problem.E, k); entry; ++entry)
                sum += static_cast<long double>(entry.value()) * lambda[entry.col()];
            u_[k] = static_cast<double>(sum);
        }
        if (residual) residual->resize(n + m);
        long double rest = 0.0L, inertia = 0.0L, forces = 0.0L;
        for (Eigen::Index i = 0; i < n; ++i) {
            long double sum = 0.0L;
            for (SparseRowsView::InnerIterator entry(problem.H, i); entry; ++entry)
                sum += static_cast<long double>(entry.value()) * x[entry.col()];
            const long double force = forces_[static_cast<std::size_t>(i)];
            const long double gap = problem.a[i] + force - sum;
            rest += gap * gap;
            inertia += sum * sum;
            forces += force * force;
            if (residual) (*residual)[i] = static_cast<double>(gap);
        }
        if (residual) residual->tail(m) = -u_;
        const auto scale = std::sqrt(std::max(
            {static_cast<double>(inertia), static_cast<double>(forces), static_cast<double>(problem.a.squaredNorm())}));
        Value value;
        const double balance = std::sqrt(static_cast<double>(rest));
        value.balance = scale > 0.0 ? balance / scale : balance;
        value.natural = m > 0 ? natural_.natural(lambda, u_) : 0.0;
        if (!std::isfinite(value.balance) || !std::isfinite(value.natural)) return {};
        return value;
    }

    /// Whether the host will call this solved.
    [[nodiscard]] bool meets(const Value& value, double tolerance) const {
        return value.natural <= aim() * tolerance && value.balance <= aim() * std::max(tolerance, 1e-12);
    }
    [[nodiscard]] double aim() const { return unsymmetric_ ? 0.1 : 0.99; }

private:
    bool definite_ = false, unsymmetric_ = false, lu_done_ = false;
    DelassusOperator N_;
    Eigen::SparseLU<SparseColumns> lu_;
    Vector magnitude_, diagonal_, u_;
    NaturalResidual natural_;
    std::vector<long double> forces_;
};

}  // namespace delassus::sdk
