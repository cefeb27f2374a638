// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/negative_eigenvalues.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

namespace delassus {

// With A = ½(K + Kᵀ) + σ M and any γ, the inertia of [A + γ DᵀD, Dᵀ; D, 0] is that of A on the null space of D and m
// positive and m negative ones, whatever γ is. It is also that of B = A + γ DᵀD and of −D B⁻¹ Dᵀ (Haynsworth, Linear
// Algebra Appl. 1, 1968). So
//
//     negative(A on the null space of D) = negative(B) + positive(D B⁻¹ Dᵀ) − m
//
// By Sylvester's law negative(B) is the number of negative pivots of an LDLᵀ of B; γ makes B regular where D holds what
// K does not. Rows and columns are scaled by the masses.
std::int32_t negative_eigenvalues(const SparseMatrix& K, const SparseMatrix& M, double shift, const SparseMatrix& D) {
    using Sparse = Eigen::SparseMatrix<double>;
    constexpr std::int32_t most_rows = 3000;
    const std::int32_t n = K.rows, m = D.rows;
    if (n == 0) return 0;
    if (m > most_rows) return -1;
    const auto each = [](const SparseMatrix& A, auto&& visit) {
        for (std::int32_t row = 0; row < A.rows; ++row)
            for (auto e = static_cast<std::size_t>(A.row_start[static_cast<std::size_t>(row)]);
                 e < static_cast<std::size_t>(A.row_start[static_cast<std::size_t>(row) + 1]); ++e)
                visit(row, A.column[e], A.value[e]);
    };
    Eigen::VectorXd scale = Eigen::VectorXd::Zero(n), diagonal = Eigen::VectorXd::Zero(n);
    each(M, [&](std::int32_t i, std::int32_t j, double value) {
        if (i == j) scale[i] = 1.0 / std::sqrt(value);
    });
    std::vector<Eigen::Triplet<double>> entries, rows;
    const auto add = [&](std::int32_t i, std::int32_t j, double value) {
        const double scaled = 0.5 * value * scale[i] * scale[j];
        entries.emplace_back(i, j, scaled);
        entries.emplace_back(j, i, scaled);
        if (i == j) diagonal[i] += 2.0 * scaled;
    };
    each(K, add);
    each(M, [&](std::int32_t i, std::int32_t j, double value) { add(i, j, shift * value); });
    Eigen::VectorXd sizes = Eigen::VectorXd::Zero(m), weight = Eigen::VectorXd::Zero(m);
    each(D, [&](std::int32_t j, std::int32_t i, double value) {
        const double square = value * scale[i] * value * scale[i];
        sizes[j] += square;
        weight[j] += square * std::abs(diagonal[i]);
    });
    each(D, [&](std::int32_t j, std::int32_t i, double value) {
        if (sizes[j] > 0.0) rows.emplace_back(j, i, value * scale[i] / std::sqrt(sizes[j]));
    });
    Sparse A(n, n), R(m, n);
    A.setFromTriplets(entries.begin(), entries.end());
    R.setFromTriplets(rows.begin(), rows.end());
    if (m > 0) {
        const double least = std::max(1e-6 * diagonal.cwiseAbs().maxCoeff(), 1e6 * shift);
        for (std::int32_t j = 0; j < m; ++j)
            weight[j] = std::max(sizes[j] > 0.0 ? 3.0 * weight[j] / sizes[j] : 0.0, least);
        A = (A + Sparse(R.transpose() * weight.asDiagonal() * R)).eval();
    }
    const Eigen::SimplicialLDLT<Sparse> factor(A);
    if (factor.info() != Eigen::Success || !factor.vectorD().allFinite()) return -1;
    auto count = static_cast<std::int32_t>((factor.vectorD().array() < 0.0).count());
    if (m == 0) return count;
    const Eigen::MatrixXd columns = Eigen::MatrixXd(R.transpose());
    const Eigen::MatrixXd S = R * factor.solve(columns);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(0.5 * (S + S.transpose()), Eigen::EigenvaluesOnly);
    if (modes.info() != Eigen::Success) return -1;
    count += static_cast<std::int32_t>((modes.eigenvalues().array() > 0.0).count()) - m;
    return count >= 0 ? count : -1;
}

}  // namespace delassus
