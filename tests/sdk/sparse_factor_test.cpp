// SPDX-License-Identifier: BSD-3-Clause
// The multifrontal factorisation against its own equations, by Eigen's kernels and by the system's BLAS.
#include "delassus/sdk/sparse_factor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace delassus::sparse_factor_test {
namespace {

using sdk::SparseColumns;
using sdk::SparseFactor;
using sdk::Vector;
using Entries = std::vector<Eigen::Triplet<double, std::int32_t>>;

/// The lower triangle of a grid's Laplacian, side³ nodes, with random weights: positive definite.
Entries laplacian(int side, std::mt19937_64& random) {
    std::uniform_real_distribution<double> weight(0.5, 2.0);
    Entries entries;
    const auto node = [side](int x, int y, int z) { return (z * side + y) * side + x; };
    const auto tie = [&](int i, int j) {
        const double w = weight(random);
        entries.emplace_back(i, i, w);
        entries.emplace_back(j, j, w);
        entries.emplace_back(j, i, -w);
    };
    for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                entries.emplace_back(node(x, y, z), node(x, y, z), 0.1);
                if (x + 1 < side) tie(node(x, y, z), node(x + 1, y, z));
                if (y + 1 < side) tie(node(x, y, z), node(x, y + 1, z));
                if (z + 1 < side) tie(node(x, y, z), node(x, y, z + 1));
            }
    return entries;
}

SparseColumns matrix_of(int size, const Entries& entries) {
    SparseColumns matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
}

struct Problem {
    SparseColumns matrix;
    Eigen::Index positive;
};

Problem definite(int side) {
    std::mt19937_64 random(7);
    return {matrix_of(side * side * side, laplacian(side, random)), side * side * side};
}

/// [A, Bᵀ; B, −C] with definite A and C: in every order the first pivots are positive, the others negative.
Problem quasi_definite(int side) {
    std::mt19937_64 random(7);
    Entries entries = laplacian(side, random);
    const int nodes = side * side * side;
    std::normal_distribution<double> normal;
    for (const auto& entry : laplacian(side, random))
        entries.emplace_back(nodes + entry.row(), nodes + entry.col(), -entry.value());
    for (int i = 0; i < nodes; ++i) entries.emplace_back(nodes + i, i, normal(random));
    return {matrix_of(2 * nodes, entries), nodes};
}

Vector right_hand_side(Eigen::Index size) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    return Vector::NullaryExpr(size, [&](Eigen::Index) { return normal(random); });
}

Vector solution(SparseFactor& factor, const Problem& problem) {
    factor.analyze(problem.matrix, problem.positive);
    EXPECT_TRUE(factor.factorize(problem.matrix));
    Vector v = right_hand_side(problem.matrix.rows());
    factor.solve(v);
    return v;
}

void expect_solution(const Problem& problem, const Vector& v) {
    const Vector right = right_hand_side(problem.matrix.rows());
    const Vector left = problem.matrix.selfadjointView<Eigen::Lower>() * v;
    EXPECT_LT((left - right).norm(), 1e-12 * right.norm());
}

TEST(SparseFactor, SolvesByEigen) {
    for (const int side : {1, 2, 5, 14}) {
        for (const Problem& problem : {definite(side), quasi_definite(side)}) {
            SparseFactor factor(SparseFactor::Kernels::Eigen);
            expect_solution(problem, solution(factor, problem));
            EXPECT_FALSE(factor.uses_blas());
        }
    }
}

TEST(SparseFactor, SolvesByBlasWhereMuchIsToDo) {
    if (!sdk::Blas::find()) GTEST_SKIP() << "neither OpenBLAS nor BLIS is installed";
    for (const Problem& problem : {definite(18), quasi_definite(12)}) {
        SparseFactor factor, by_eigen(SparseFactor::Kernels::Eigen);
        const Vector v = solution(factor, problem);
        EXPECT_TRUE(factor.uses_blas());
        expect_solution(problem, v);
        EXPECT_LT((v - solution(by_eigen, problem)).norm(), 1e-11 * v.norm());
        EXPECT_LT((factor.diagonal() - by_eigen.diagonal()).norm(), 1e-12 * factor.diagonal().norm());
    }
}

TEST(SparseFactor, LeavesBlasOutOfSmallWork) {
    SparseFactor factor;
    static_cast<void>(solution(factor, definite(6)));
    EXPECT_FALSE(factor.uses_blas());
    EXPECT_EQ(factor.kernels(), "Eigen");
}

TEST(SparseFactor, RepeatsItsBits) {
    for (const Problem& problem : {definite(18), quasi_definite(12)}) {
        SparseFactor one, other;
        const Vector first = solution(one, problem);
        EXPECT_TRUE(first == solution(other, problem));
        EXPECT_TRUE(first == solution(one, problem)) << "what the last factorisation left is used again";
    }
}

TEST(SparseFactor, RefusesPivotsOfTheWrongSign) {
    for (const int side : {3, 18}) {
        Problem problem = definite(side);
        SparseFactor factor;
        factor.analyze(problem.matrix, problem.positive);
        problem.matrix.coeffRef(problem.matrix.rows() / 2, problem.matrix.rows() / 2) = -1.0;
        EXPECT_FALSE(factor.factorize(problem.matrix)) << side;
        problem.matrix.coeffRef(problem.matrix.rows() / 2, problem.matrix.rows() / 2) = NAN;
        EXPECT_FALSE(factor.factorize(problem.matrix)) << side;
    }
}

}  // namespace
}  // namespace delassus::sparse_factor_test
