// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "delassus/error.hpp"
#include "delassus/problem.hpp"
#include "problem/symmetry.hpp"
#include "support/problem_equality.hpp"

namespace delassus::tests::sparse_matrix_test {
namespace {

SparseMatrix example() {
    return SparseMatrix::from_triplets(2, 3, {{1, 2, 5.0}, {0, 1, 2.0}, {1, 0, 3.0}, {0, 1, 4.0}});
}

TEST(SparseMatrix, TripletsAreSortedAndAddedUp) {
    const SparseMatrix A = example();
    EXPECT_EQ(A.row_start, (std::vector<std::int32_t>{0, 1, 3}));
    EXPECT_EQ(A.column, (std::vector<std::int32_t>{1, 0, 2}));
    EXPECT_EQ(A.value, (std::vector<double>{6.0, 3.0, 5.0}));
}

TEST(SparseMatrix, TripletsOutsideAreRefused) {
    for (const Triplet t : {Triplet{2, 0, 1.0}, Triplet{-1, 0, 1.0}, Triplet{0, 3, 1.0}, Triplet{0, -1, 1.0}}) {
        EXPECT_THROW(SparseMatrix::from_triplets(2, 3, {t}), InputError);
    }
    EXPECT_THROW(SparseMatrix::zero(-1, 2), InputError);
}

TEST(SparseMatrix, TransposeTwiceIsTheSame) {
    const SparseMatrix A = example();
    const SparseMatrix T = A.transposed();
    EXPECT_EQ(T.rows, 3);
    EXPECT_EQ(T.column, (std::vector<std::int32_t>{1, 0, 1}));
    EXPECT_EQ(T.value, (std::vector<double>{3.0, 6.0, 5.0}));
    expect_same(T.transposed(), A, "A");
}

TEST(SparseMatrix, ProductsAddToTheResult) {
    const SparseMatrix A = example();
    const double x[] = {1.0, 2.0, 3.0};
    double y[] = {10.0, 20.0};
    A.multiply_add(2.0, x, y);
    EXPECT_EQ(y[0], 10.0 + 2.0 * 12.0);
    EXPECT_EQ(y[1], 20.0 + 2.0 * 18.0);
    const double v[] = {1.0, -1.0};
    double z[] = {1.0, 1.0, 1.0};
    A.transpose_multiply_add(-1.0, v, z);
    EXPECT_EQ(z[0], 4.0);
    EXPECT_EQ(z[1], -5.0);
    EXPECT_EQ(z[2], 6.0);
}

TEST(SparseMatrix, AsymmetryIsRelativeToTheLargestEntry) {
    const SparseMatrix A = SparseMatrix::from_triplets(2, 2, {{0, 0, 8.0}, {0, 1, 1.0}, {1, 0, 3.0}});
    const Asymmetry asymmetry = asymmetry_of(A);
    EXPECT_DOUBLE_EQ(asymmetry.relative, 0.25);
    EXPECT_EQ(asymmetry.row + asymmetry.column, 1);
    const SparseMatrix S = symmetric_part(A);
    EXPECT_EQ(S.value, (std::vector<double>{8.0, 2.0, 2.0}));
    EXPECT_EQ(asymmetry_of(S).row, -1);
    // An entry without its mirror counts as facing a zero.
    EXPECT_DOUBLE_EQ(asymmetry_of(SparseMatrix::from_triplets(2, 2, {{1, 0, 3.0}})).relative, 1.0);
}

TEST(Names, LawsAndKinds) {
    EXPECT_EQ(law_of("coulomb"), Law::Coulomb);
    EXPECT_EQ(law_of(name_of(Law::Associated)), Law::Associated);
    EXPECT_EQ(name_of(ConeKind::Nonnegative), "nonnegative");
    expect_sentence(sentence_of<InputError>([] { (void)law_of("columb"); }), "columb|associated|did you mean coulomb");
}

}  // namespace
}  // namespace delassus::tests::sparse_matrix_test
