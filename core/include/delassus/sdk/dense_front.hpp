// SPDX-License-Identifier: BSD-3-Clause
// The dense work on one front of a sparse factorisation, by BLAS where that is faster.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "delassus/sdk/blas.hpp"

namespace delassus::sdk {

/// Factors the first columns of a dense symmetric matrix [A11; A21 A22], of which lower triangles are read and written:
///
///     A11 = L11 S L11ᵀ,  L21 = A21 L11⁻ᵀ S,  A22 ← A22 − L21 S L21ᵀ,   S = diag(±1)
///
/// Columns are halved until few are left, so that nearly all work is in products of matrices.
///
/// An unsymmetric matrix [A11 A12; A21 A22] is factored in the same way, its rows to the right transposed so that they
/// lie as its columns do: A11 = L11 V11ᵀ, L21 = A21 V11⁻ᵀ, V21 = A12ᵀ L11⁻ᵀ, A22 ← A22 − L21 V21ᵀ, with lower triangles
/// L11 and V11 whose diagonals share each pivot as roots of one size.
class DenseFront {
public:
    using Matrix = Eigen::MatrixXd;
    using Block = Eigen::Map<Matrix, 0, Eigen::OuterStride<>>;

    /// blas: null for Eigen alone.
    explicit DenseFront(const Blas* blas = nullptr) : blas_(blas) {}

    [[nodiscard]] const Blas* blas() const { return blas_; }

    /// panel: [A11; A21], height × k, becomes [L11; L21]. sign: k. update: A22. What is above the diagonals is
    /// meaningless afterwards. False if a pivot has the wrong sign or is not finite.
    [[nodiscard]] bool factor(Block panel, const double* sign, Block update) {
        if (!factor_columns(panel, sign)) return false;
        const Eigen::Index k = panel.cols();
        if (update.rows() > 0) subtract_lower(part(panel, k, 0, update.rows(), k), sign, update);
        return true;
    }

    /// lower: [A11; A21], height × k, becomes [L11; L21]; upper: [A11ᵀ; A12ᵀ] becomes [V11; V21]. Lower triangles of
    /// the squares on top are read; what is above them is meaningless afterwards. update: A22, all of it. The order of
    /// pivots is fixed: one below `smallest` times the largest entry beside it in its square is replaced by that bound.
    /// Returns how many were; −1 if entries are not finite or a row and column are zero.
    [[nodiscard]] int factor(Block lower, Block upper, double smallest, Block update) {
        const int replaced = factor_columns(lower, upper, smallest);
        const Eigen::Index k = lower.cols(), rest = update.rows();
        if (replaced >= 0 && rest > 0)
            add_product(-1.0, part(lower, k, 0, rest, k), part(upper, k, 0, rest, k), update);
        return replaced;
    }

private:
    static constexpr Eigen::Index fewest_columns = 48;  // that are halved
    static constexpr double least_work = 2e4;           // multiplications that are worth a call of BLAS

    [[nodiscard]] bool by_blas(Eigen::Index rows, Eigen::Index columns, Eigen::Index depth) const {
        return blas_ &&
               static_cast<double>(rows) * static_cast<double>(columns) * static_cast<double>(depth) >= least_work;
    }

    static Block part(Block matrix, Eigen::Index row, Eigen::Index column, Eigen::Index rows, Eigen::Index columns) {
        return {matrix.data() + row + column * matrix.outerStride(), rows, columns,
                Eigen::OuterStride<>(matrix.outerStride())};
    }

    static bool all_equal(const double* sign, Eigen::Index count) {
        return std::all_of(sign, sign + count, [sign](double s) { return s == *sign; });
    }

    bool factor_columns(Block panel, const double* sign) {
        const Eigen::Index k = panel.cols(), height = panel.rows();
        if (k <= fewest_columns) return factor_few(panel, sign);
        const Eigen::Index first = (k / 2 + 7) / 8 * 8, second = k - first;
        if (!factor_columns(part(panel, 0, 0, height, first), sign)) return false;
        Block beside = part(panel, first, 0, second, first), below = part(panel, k, 0, height - k, first);
        subtract_lower(beside, sign, part(panel, first, first, second, second));
        subtract_product(below, sign, beside, part(panel, k, first, height - k, second));
        return factor_columns(part(panel, first, first, height - first, second), sign + first);
    }

    bool factor_few(Block panel, const double* sign) {
        const Eigen::Index k = panel.cols(), rest = panel.rows() - k;
        Block top = part(panel, 0, 0, k, k), bottom = part(panel, k, 0, rest, k);
        if (k == 1) {
            const double pivot = *sign * top(0, 0);
            if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
            top(0, 0) = std::sqrt(pivot);
            bottom *= *sign / std::sqrt(pivot);
            return true;
        }
        if (*sign > 0.0 && all_equal(sign, k)) {
            Eigen::LLT<Eigen::Ref<Matrix, 0, Eigen::OuterStride<>>> factor(top);
            if (factor.info() != Eigen::Success || !std::isfinite(top.diagonal().sum())) return false;
            solve_right(top, bottom);
            return true;
        }
        for (Eigen::Index c = 0; c < k; ++c) {
            const double pivot = sign[c] * top(c, c);
            if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
            top.col(c).tail(k - c) *= sign[c] / std::sqrt(pivot);
            for (Eigen::Index j = c + 1; j < k; ++j)
                top.col(j).tail(k - j) -= sign[c] * top(j, c) * top.col(c).tail(k - j);
        }
        solve_right(top, bottom);
        for (Eigen::Index c = 0; c < k; ++c)
            if (sign[c] < 0.0) bottom.col(c) *= -1.0;
        return true;
    }

    int factor_columns(Block lower, Block upper, double smallest) {
        const Eigen::Index k = lower.cols(), height = lower.rows();
        if (k <= fewest_columns) return factor_few(lower, upper, smallest);
        const Eigen::Index first = (k / 2 + 7) / 8 * 8, second = k - first, rest = height - first;
        const int replaced =
            factor_columns(part(lower, 0, 0, height, first), part(upper, 0, 0, height, first), smallest);
        if (replaced < 0) return replaced;
        const Block below = part(lower, first, 0, rest, first), beside = part(upper, first, 0, rest, first);
        const Block below_lower = part(lower, first, first, rest, second);
        const Block below_upper = part(upper, first, first, rest, second);
        add_product(-1.0, below, part(beside, 0, 0, second, first), below_lower);
        add_product(-1.0, beside, part(below, 0, 0, second, first), below_upper);
        const int more = factor_columns(below_lower, below_upper, smallest);
        return more < 0 ? more : replaced + more;
    }

    int factor_few(Block lower, Block upper, double smallest) {
        const Eigen::Index k = lower.cols(), rest = lower.rows() - k;
        Block L = part(lower, 0, 0, k, k), V = part(upper, 0, 0, k, k);
        int replaced = 0;
        for (Eigen::Index c = 0; c < k; ++c) {
            const Eigen::Index left = k - c - 1;
            auto column = L.col(c).tail(left), row = V.col(c).tail(left);
            double pivot = L(c, c);
            double largest = std::abs(pivot);
            if (left > 0) largest = std::max({largest, column.cwiseAbs().maxCoeff(), row.cwiseAbs().maxCoeff()});
            if (!(largest > 0.0) || !std::isfinite(pivot)) return -1;
            if (std::abs(pivot) < smallest * largest) {
                pivot = std::copysign(smallest * largest, pivot);
                ++replaced;
            }
            const double root = std::sqrt(std::abs(pivot));
            L(c, c) = pivot / root;
            V(c, c) = root;
            column /= root;
            row /= L(c, c);
            for (Eigen::Index j = c + 1; j < k; ++j) {
                L.col(j).tail(k - j) -= V(j, c) * L.col(c).tail(k - j);
                V.col(j).tail(k - j) -= L(j, c) * V.col(c).tail(k - j);
            }
        }
        if (rest > 0) {
            solve_right(V, part(lower, k, 0, rest, k));
            solve_right(L, part(upper, k, 0, rest, k));
        }
        return replaced;
    }

    void solve_right(Block L, Block B) const {
        if (B.rows() == 0) return;
        if (by_blas(B.rows(), L.rows(), L.rows())) {
            blas_->solve_right(static_cast<int>(B.rows()), static_cast<int>(L.rows()), L.data(), stride(L), B.data(),
                               stride(B));
        } else {
            L.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(B);
        }
    }

    // C ← C − A S Bᵀ
    void subtract_product(Block A, const double* sign, Block B, Block C) {
        if (C.size() == 0) return;
        if (!all_equal(sign, A.cols())) {
            scaled_.noalias() = A * Eigen::Map<const Eigen::VectorXd>(sign, A.cols()).asDiagonal();
            add_product(-1.0, {scaled_.data(), A.rows(), A.cols(), Eigen::OuterStride<>(A.rows())}, B, C);
        } else {
            add_product(-*sign, A, B, C);
        }
    }

    // The lower triangle of C ← C − A S Aᵀ; what is above it is spoiled where signs are mixed.
    void subtract_lower(Block A, const double* sign, Block C) {
        constexpr Eigen::Index strip = 96;
        const Eigen::Index size = C.rows(), depth = A.cols();
        if (all_equal(sign, depth)) {
            if (by_blas(size, size, depth)) {
                blas_->add_square(static_cast<int>(size), static_cast<int>(depth), -*sign, A.data(), stride(A),
                                  C.data(), stride(C));
            } else {
                C.selfadjointView<Eigen::Lower>().rankUpdate(A, -*sign);
            }
            return;
        }
        for (Eigen::Index j = 0; j < size; j += strip) {
            const Eigen::Index width = std::min(strip, size - j);
            subtract_product(part(A, j, 0, size - j, depth), sign, part(A, j, 0, width, depth),
                             part(C, j, j, size - j, width));
        }
    }

    void add_product(double alpha, Block A, Block B, Block C) const {
        if (by_blas(C.rows(), C.cols(), A.cols())) {
            blas_->add_product(static_cast<int>(C.rows()), static_cast<int>(C.cols()), static_cast<int>(A.cols()),
                               alpha, A.data(), stride(A), B.data(), stride(B), C.data(), stride(C));
        } else {
            C.noalias() += alpha * A * B.transpose();
        }
    }

    static int stride(const Block& matrix) { return static_cast<int>(matrix.outerStride()); }

    const Blas* blas_;
    Matrix scaled_;
};

}  // namespace delassus::sdk
