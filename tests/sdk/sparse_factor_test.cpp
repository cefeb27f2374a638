// SPDX-License-Identifier: BSD-3-Clause
// The multifrontal factorisation against its own equations, by Eigen's kernels and by the system's BLAS.
#include "delassus/sdk/sparse_factor.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

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

/// A matrix of symmetric pattern by its lower triangle and the mirrored values beside it.
struct Unsymmetric {
    SparseColumns lower;
    std::vector<double> upper;

    [[nodiscard]] SparseColumns whole() const {
        Entries entries;
        for (int j = 0; j < lower.cols(); ++j)
            for (int k = lower.outerIndexPtr()[j]; k < lower.outerIndexPtr()[j + 1]; ++k) {
                const std::int32_t i = lower.innerIndexPtr()[k];
                entries.emplace_back(i, j, lower.valuePtr()[k]);
                if (i != j) entries.emplace_back(j, i, upper[static_cast<std::size_t>(k)]);
            }
        return matrix_of(static_cast<int>(lower.rows()), entries);
    }
};

/// The problem's matrix with random values of their own in both triangles; diagonals keep their signs.
Unsymmetric unsymmetric(const Problem& problem) {
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    Unsymmetric result{problem.matrix, std::vector<double>(static_cast<std::size_t>(problem.matrix.nonZeros()))};
    for (int j = 0; j < result.lower.cols(); ++j)
        for (int k = result.lower.outerIndexPtr()[j]; k < result.lower.outerIndexPtr()[j + 1]; ++k) {
            double& value = result.lower.valuePtr()[k];
            const bool diagonal = result.lower.innerIndexPtr()[k] == j;
            if (!diagonal) value *= 1.0 + 0.5 * normal(random);
            result.upper[static_cast<std::size_t>(k)] = diagonal ? value : value + 0.3 * normal(random);
        }
    return result;
}

Vector solution(SparseFactor& factor, const Unsymmetric& problem) {
    factor.analyze(problem.lower, problem.lower.rows());
    EXPECT_TRUE(factor.factorize(problem.lower, problem.upper));
    Vector v = right_hand_side(problem.lower.rows());
    factor.solve(v);
    return v;
}

TEST(SparseFactor, SolvesUnsymmetricMatricesAsDenseLuDoes) {
    for (const int side : {1, 2, 5, 8}) {
        for (const Problem& problem : {definite(side), quasi_definite(side)}) {
            SparseFactor factor(SparseFactor::Kernels::Eigen);
            const Unsymmetric matrix = unsymmetric(problem);
            const Eigen::MatrixXd dense(matrix.whole());
            const Vector expected = dense.partialPivLu().solve(right_hand_side(dense.rows()));
            EXPECT_LT((solution(factor, matrix) - expected).norm(), 1e-10 * expected.norm()) << side;
            EXPECT_EQ(factor.replaced_pivots(), 0);
        }
    }
}

TEST(SparseFactor, SolvesLargeUnsymmetricMatricesByBlas) {
    if (!sdk::Blas::find()) GTEST_SKIP() << "neither OpenBLAS nor BLIS is installed";
    for (const Problem& problem : {definite(18), quasi_definite(12)}) {
        SparseFactor factor, by_eigen(SparseFactor::Kernels::Eigen);
        const Unsymmetric matrix = unsymmetric(problem);
        const Vector v = solution(factor, matrix);
        EXPECT_TRUE(factor.uses_blas());
        const Vector right = right_hand_side(v.size());
        EXPECT_LT((matrix.whole() * v - right).norm(), 1e-9 * right.norm());
        EXPECT_LT((v - solution(by_eigen, matrix)).norm(), 1e-9 * v.norm());
        EXPECT_TRUE(v == solution(factor, matrix)) << "what the last factorisation left is used again";
        expect_solution(problem, solution(factor, problem));
    }
}

TEST(SparseFactor, GivesASymmetricMatrixTheSameSolutionByLu) {
    const Problem problem = quasi_definite(6);
    const std::vector<double> upper(problem.matrix.valuePtr(), problem.matrix.valuePtr() + problem.matrix.nonZeros());
    SparseFactor factor;
    const Vector expected = solution(factor, problem);
    EXPECT_LT((solution(factor, Unsymmetric{problem.matrix, upper}) - expected).norm(), 1e-11 * expected.norm());
}

TEST(SparseFactor, ReplacesTinyPivotsOfAnUnsymmetricMatrix) {
    const SparseColumns lower = matrix_of(2, {{0, 0, 1e-30}, {1, 0, 2.0}, {1, 1, 1.0}});
    SparseFactor factor;
    factor.analyze(lower, 2);
    ASSERT_TRUE(factor.factorize(lower, std::vector<double>{1e-30, -1.0, 1.0}));
    EXPECT_EQ(factor.replaced_pivots(), 1);
    Vector v(2);  // [0, −1; 2, 1] v = (3, 5)
    v << 3.0, 5.0;
    factor.solve(v);
    EXPECT_NEAR(v[0], 4.0, 0.1);
    EXPECT_NEAR(v[1], -3.0, 0.1);
}

TEST(SparseFactor, RefusesUnsymmetricMatricesWithoutPivots) {
    SparseColumns lower = matrix_of(2, {{0, 0, 0.0}, {1, 0, 0.0}, {1, 1, 1.0}});
    SparseFactor factor;
    factor.analyze(lower, 2);
    EXPECT_FALSE(factor.factorize(lower, std::vector<double>{0.0, 0.0, 1.0}));
    EXPECT_FALSE(factor.factorize(lower, std::vector<double>{NAN, NAN, 1.0}));
    lower.valuePtr()[0] = NAN;
    EXPECT_FALSE(factor.factorize(lower, std::vector<double>{NAN, 0.0, 1.0}));
}

}  // namespace
}  // namespace delassus::sparse_factor_test
