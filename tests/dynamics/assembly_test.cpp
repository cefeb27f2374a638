// SPDX-License-Identifier: BSD-3-Clause
// Matrices and unilateral rows that are assembled again and again.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "delassus/dynamical_system.hpp"
#include "delassus/error.hpp"

namespace delassus::assembly_test {
namespace {

TEST(MatrixAssembler, FillsAMatrixOfAnyContent) {
    MatrixAssembler assembler;
    SparseMatrix matrix = SparseMatrix::from_triplets(1, 5, {{0, 4, 3.0}});
    for (const double scale : {1.0, 2.0}) {  // a new pattern, then the same one
        assembler.begin(2, 3);
        assembler.add(1, 2, 5.0 * scale);
        assembler.add(0, 1, 1.0 * scale);
        assembler.add(1, 2, -2.0 * scale);
        assembler.finish_into(matrix);
        EXPECT_EQ(matrix.rows, 2);
        EXPECT_EQ(matrix.columns, 3);
        EXPECT_EQ(matrix.row_start, (std::vector<std::int32_t>{0, 1, 2}));
        EXPECT_EQ(matrix.column, (std::vector<std::int32_t>{1, 2}));
        EXPECT_EQ(matrix.value, (std::vector<double>{1.0 * scale, 3.0 * scale}));
    }
    EXPECT_EQ(assembler.patterns(), 1);
}

TEST(MatrixAssembler, AddsProductsOrKeepsThem) {
    const std::array<std::int32_t, 2> columns{0, 2};
    const std::array<double, 2> g{1.0, -3.0};
    for (const bool keeps : {false, true}) {
        MatrixAssembler assembler;
        if (keeps) assembler.keep_products();
        for (const double factor : {2.0, 5.0}) {
            assembler.begin(3, 3);
            assembler.add(1, 1, 1.0);
            assembler.add_product(columns, g, factor);
            const SparseMatrix& matrix = assembler.finish();
            int kept = 0;
            assembler.for_each_product([&](auto places, auto values, double weight) {
                ++kept;
                EXPECT_TRUE(std::ranges::equal(places, columns));
                EXPECT_TRUE(std::ranges::equal(values, g));
                EXPECT_EQ(weight, factor);
            });
            EXPECT_EQ(kept, keeps ? 1 : 0);
            if (keeps) {
                EXPECT_EQ(matrix.value, std::vector<double>{1.0});
            } else {
                EXPECT_EQ(matrix.column, (std::vector<std::int32_t>{0, 2, 1, 0, 2}));
                EXPECT_EQ(matrix.value, (std::vector<double>{factor, -3.0 * factor, 1.0, -3.0 * factor, 9.0 * factor}));
            }
        }
    }
}

TEST(UnilateralRows, SortTheColumnsOfARow) {
    UnilateralRows rows;
    for (int round = 0; round < 2; ++round) {  // the memory of a round serves the next
        rows.clear();
        rows.entries(6, std::vector<double>{1.0, 2.0});
        rows.entries(0, std::vector<double>{3.0, 4.0});
        rows.entry(4, 5.0);
        rows.end_row(0.1, 10.0);
        rows.end_block(Cone::box({-1.0}, {1.0}), 7);
        rows.entry(2, 6.0);
        rows.end_row();
        EXPECT_THROW(rows.end_block(Cone::friction(0.5), 8), InputError);
        rows.end_block(Cone::nonnegative(1), 8, 0.25);
        ASSERT_EQ(rows.column().size(), 6U);
        const std::vector<std::int32_t> column(rows.column().begin(), rows.column().end());
        const std::vector<double> value(rows.value().begin(), rows.value().end());
        EXPECT_EQ(column, (std::vector<std::int32_t>{0, 1, 4, 6, 7, 2}));
        EXPECT_EQ(value, (std::vector<double>{3.0, 4.0, 5.0, 1.0, 2.0, 6.0}));
        EXPECT_EQ(rows.row_start(), (std::vector<std::int32_t>{0, 5, 6}));
        ASSERT_EQ(rows.blocks().size(), 2U);
        EXPECT_EQ(rows.blocks()[0].cone.lo, (std::vector<double>{-1.0}));
        EXPECT_EQ(rows.blocks()[1].cone.kind, ConeKind::Nonnegative);
        EXPECT_TRUE(rows.blocks()[1].cone.lo.empty());
        EXPECT_EQ(rows.blocks()[1].restitution, 0.25);
        const std::vector<double> v = {1.0, 1.0, 1.0, 1.0, 2.0, 1.0, 1.0, 1.0};
        EXPECT_EQ(rows.speed(0, v.data()), 10.0 + 3.0 + 4.0 + 2.0 * 5.0 + 1.0 + 2.0);
    }
}

TEST(UnilateralRows, MoveBelowOtherRowsOrTakeTheirArrays) {
    const std::vector<double> v = {1.0, 2.0, 3.0};
    UnilateralRows rows;
    const auto fill = [&] {
        rows.clear();
        rows.measure_speeds_at(v.data());
        rows.entries(1, std::array{4.0, 5.0});
        rows.end_row(0.0, 10.0);
        rows.end_block(Cone::nonnegative(1), 1);
        rows.entry(0, 6.0);
        rows.end_row();
        rows.end_block(Cone::nonnegative(1), 2);
    };
    fill();
    EXPECT_EQ(rows.blocks()[0].speed, 10.0 + 4.0 * 2.0 + 5.0 * 3.0);
    EXPECT_EQ(rows.blocks()[1].speed, 6.0);
    SparseMatrix D = SparseMatrix::from_triplets(1, 3, {{0, 2, 7.0}});
    rows.move_into(D);
    EXPECT_EQ(D.rows, 3);
    EXPECT_EQ(D.row_start, (std::vector<std::int32_t>{0, 1, 3, 4}));
    EXPECT_EQ(D.column, (std::vector<std::int32_t>{2, 1, 2, 0}));
    EXPECT_EQ(D.value, (std::vector<double>{7.0, 4.0, 5.0, 6.0}));
    for (int round = 0; round < 3; ++round) {  // what the array held before does not matter
        fill();
        D.rows = 0;
        rows.move_into(D);
        EXPECT_EQ(D.rows, 2);
        EXPECT_EQ(D.row_start, (std::vector<std::int32_t>{0, 2, 3}));
        EXPECT_EQ(D.column, (std::vector<std::int32_t>{1, 2, 0}));
        EXPECT_EQ(D.value, (std::vector<double>{4.0, 5.0, 6.0}));
        EXPECT_EQ(rows.blocks().size(), 2U);
    }
}

}  // namespace
}  // namespace delassus::assembly_test
