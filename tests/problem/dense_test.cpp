// SPDX-License-Identifier: BSD-3-Clause
// Factors of small dense matrices, those without rows or columns included.
#include "support/pivoted_qr.hpp"

#include <gtest/gtest.h>

#include "delassus/sdk/dense_algebra.hpp"

namespace delassus::tests::dense_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(Dense, FactorsMatricesWithoutRowsOrColumns) {
    for (const auto& [rows, columns] : {std::pair{0, 0}, {0, 3}, {3, 0}}) {
        const PivotedQr qr(MatrixXd(rows, columns));
        EXPECT_EQ(qr.order().size(), static_cast<std::size_t>(columns));
        EXPECT_EQ(qr.pivots().size(), 0);
        EXPECT_EQ(qr.rank(1e-10), 0);
        EXPECT_TRUE(qr.Q().isIdentity());
        EXPECT_EQ(qr.Q().rows(), rows);
        const VectorXd x = least_solution(MatrixXd(rows, columns), VectorXd::Ones(rows), 1e-10);
        EXPECT_TRUE(x == VectorXd::Zero(columns));
    }
    EXPECT_EQ(largest_entry(VectorXd()), 0.0);
    EXPECT_TRUE(sdk::SymmetricEigen(MatrixXd(0, 0)).found());
    EXPECT_EQ(sdk::SymmetricEigen(MatrixXd(0, 0)).with(VectorXd()).size(), 0);
    MatrixXd none(0, 0);
    EXPECT_TRUE(sdk::invert_definite(none));
}

TEST(Dense, FindsTheRankAndWhatIsNormal) {
    MatrixXd A(4, 3);
    A << 1, 2, 0, 0, 0, 3, 1, 2, 0, 0, 0, -3;
    const PivotedQr qr(A);
    EXPECT_EQ(qr.rank(1e-10), 2);
    EXPECT_EQ(qr.order()[0], 2U);
    EXPECT_EQ(qr.order()[1], 1U);
    EXPECT_LT((qr.Q().rightCols(2).transpose() * A).norm(), 1e-14);
    EXPECT_LT((qr.Q(2) - qr.Q().leftCols(2)).norm(), 1e-14);
    EXPECT_EQ(PivotedQr(MatrixXd::Zero(3, 2)).rank(1e-10), 0);
    EXPECT_EQ(largest_entry(A), 3.0);
}

}  // namespace
}  // namespace delassus::tests::dense_test
