// SPDX-License-Identifier: BSD-3-Clause
// Linear problems (free rows) by structure, and a dense reference for them.
#pragma once

#include <Eigen/Dense>
#include <Eigen/LU>
#include <vector>

#include "delassus/problem.hpp"
#include "support/dense.hpp"

namespace delassus::tests {

/// x of the problem, by a dense factorisation with complete pivoting of [H Dᵀ; D −E]; right also where rows are
/// redundant, as long as they are consistent.
inline Eigen::VectorXd reference_velocity(const Problem& problem) {
    const Eigen::Index n = problem.n(), m = problem.m();
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n + m, n + m);
    const Eigen::MatrixXd D = dense(problem.D, m, n);
    K.topLeftCorner(n, n) = dense(problem.H, n, n);
    K.topRightCorner(n, m) = D.transpose();
    K.bottomLeftCorner(m, n) = D;
    K.bottomRightCorner(m, m) = -dense(problem.E, m, m);
    Eigen::VectorXd f(n + m);
    for (Eigen::Index i = 0; i < n; ++i) f[i] = problem.a[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k < m; ++k) f[n + k] = -problem.b[static_cast<std::size_t>(k)];
    return Eigen::VectorXd(K.fullPivLu().solve(f)).head(n);
}

/// n masses in a row between springs of the given stiffness (the ends are free), some of them held by rows: each of
/// `held` moves at speed 0.1 (k + 1). mass: on the diagonal; 0 and springs give a singular H. skew: an unsymmetric
/// part.
inline Problem spring_row(std::int32_t n, double mass, double stiffness, double skew,
                          const std::vector<std::int32_t>& held) {
    Problem problem;
    problem.name = "spring row";
    std::vector<Triplet> H, D;
    for (std::int32_t i = 0; i < n; ++i) H.push_back({i, i, mass});
    for (std::int32_t i = 0; i + 1 < n; ++i) {
        H.insert(H.end(), {{i, i, stiffness}, {i + 1, i + 1, stiffness}});
        H.insert(H.end(), {{i, i + 1, -stiffness + skew}, {i + 1, i, -stiffness - skew}});
    }
    const auto m = static_cast<std::int32_t>(held.size());
    for (std::int32_t k = 0; k < m; ++k) {
        D.push_back({k, held[static_cast<std::size_t>(k)], 1.0});
        problem.b.push_back(-0.1 * (k + 1));
        problem.cones.push_back(Cone::free(1));
    }
    for (std::int32_t i = 0; i < n; ++i) problem.a.push_back(1.0 + 0.3 * i);
    problem.H = SparseMatrix::from_triplets(n, n, std::move(H));
    problem.D = SparseMatrix::from_triplets(m, n, std::move(D));
    return problem;
}

/// The problem with its last row written once more; the copy asks for a velocity that is off by `contradiction`.
inline Problem with_row_repeated(Problem problem, double contradiction = 0.0) {
    const SparseMatrix& D = problem.D;
    std::vector<Triplet> triplets;
    for (std::int32_t k = 0; k < D.rows; ++k)
        for (auto p = D.row_start[static_cast<std::size_t>(k)]; p < D.row_start[static_cast<std::size_t>(k) + 1]; ++p) {
            const auto column = D.column[static_cast<std::size_t>(p)];
            const auto value = D.value[static_cast<std::size_t>(p)];
            triplets.push_back({k, column, value});
            if (k == D.rows - 1) triplets.push_back({D.rows, column, value});
        }
    problem.D = SparseMatrix::from_triplets(D.rows + 1, D.columns, std::move(triplets));
    problem.b.push_back(problem.b.back() + contradiction);
    problem.cones.push_back(Cone::free(1));
    return problem;
}

}  // namespace delassus::tests
