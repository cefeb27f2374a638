// SPDX-License-Identifier: BSD-3-Clause
// Products by groups of rows: against dense ones, with the instructions of this machine against those of every machine,
// and by several threads against one.
#include "delassus/sdk/block_rows.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "delassus/sdk/column_shares.hpp"
#include "delassus/thread_team.hpp"

namespace delassus::sdk::block_rows_test {
namespace {

/// Groups of 1 to 6 rows, each of which touches some runs of columns.
struct RandomRows {
    Eigen::MatrixXd dense;
    SparseRows matrix;
    std::vector<RowGroup> groups;
    Vector left, right;

    RandomRows(unsigned seed, int columns, int run, int group_count) {
        std::mt19937 random(seed);
        const auto draw = [&] { return std::normal_distribution<double>()(random); };
        std::int32_t rows = 0;
        for (int k = 0; k < group_count; ++k) {
            groups.push_back({rows, 1 + static_cast<std::int32_t>(random() % 6)});
            rows += groups.back().rows;
        }
        dense.setZero(rows, columns);
        for (const RowGroup& group : groups)
            for (int part = 0; part < 3; ++part) {
                const int first = static_cast<int>(random() % static_cast<unsigned>(columns)) / run * run;
                for (int i = 0; i < group.rows; ++i)
                    for (int j = first; j < std::min(columns, first + run); ++j)
                        if (random() % 5 != 0) dense(group.first + i, j) = draw();
            }
        left = Vector::NullaryExpr(rows, draw);
        right = Vector::NullaryExpr(columns, draw);
        matrix = dense.sparseView();
        dense = left.asDiagonal() * dense * right.asDiagonal();
    }
    [[nodiscard]] BlockRows rows() const { return {matrix, groups, left.data(), right.data()}; }
};

Vector padded(const Vector& v) {
    Vector result = Vector::Zero(v.size() + chunk_padding);
    result.head(v.size()) = v;
    return result;
}

class Runs : public testing::TestWithParam<int> {};

TEST_P(Runs, MultiplyAsADenseMatrix) {
    for (unsigned seed = 1; seed < 20; ++seed) {
        const RandomRows random(seed, 7 + static_cast<int>(seed) * 5, GetParam(), 40);
        const BlockRows rows = random.rows();
        const Vector v = Vector::Random(random.dense.cols()), w = Vector::Random(random.dense.rows());
        Vector result = w;
        rows.multiply_add(padded(v).data(), result.data());
        EXPECT_LE((result - w - random.dense * v).norm(), 1e-13 * (1.0 + random.dense.norm() * v.norm()));
        Vector transposed = padded(v);
        rows.transpose_multiply_add(w.data(), transposed.data());
        EXPECT_LE((transposed.head(v.size()) - v - random.dense.transpose() * w).norm(),
                  1e-13 * (1.0 + random.dense.norm() * w.norm()));
        EXPECT_EQ(transposed.tail(chunk_padding), Vector::Zero(chunk_padding));
    }
}

TEST_P(Runs, GiveTheBitsOfEveryMachine) {
    const RandomRows random(3, 60, GetParam(), 60);
    const BlockRows rows = random.rows();
    const Vector v = padded(Vector::Random(60)), w = Vector::Random(random.dense.rows());
    Vector here = Vector::Zero(w.size()), transposed_here = padded(Vector::Zero(60));
    rows.multiply_add(v.data(), here.data());
    rows.transpose_multiply_add(w.data(), transposed_here.data());
    Vector plain = Vector::Zero(w.size()), transposed = padded(Vector::Zero(60));
    const auto go = [&]<int Width>() {
        for (const auto& group : rows.groups())
            with_rows(group.rows, [&]<int Rows>() {
                multiply_group<Rows, Width>(rows.values(group), rows.starts(group), group.chunks, v.data(),
                                            plain.data() + group.first, plain.data() + group.first);
                transpose_multiply_group<Rows, Width>(rows.values(group), rows.starts(group), group.chunks,
                                                      w.data() + group.first, transposed.data());
            });
    };
    if (rows.width() == 2) go.operator()<2>();
    if (rows.width() == 4) go.operator()<4>();
    if (rows.width() == 6) go.operator()<6>();
    EXPECT_EQ(here, plain);
    EXPECT_EQ(transposed_here, transposed);
}

TEST_P(Runs, GiveTheSameBitsByManyThreads) {
    const RandomRows random(5, 300, GetParam(), 200);
    const BlockRows rows = random.rows();
    Vector w = Vector::Random(random.dense.rows());
    w.head(20).setZero();
    Vector one = padded(Vector::Zero(300));
    rows.transpose_multiply_add(w.data(), one.data());
    for (const int members : {1, 2, 3, 4}) {
        const ColumnShares shares(rows, one.size(), members);
        Vector many = Vector::Constant(one.size(), 7.0);
        ThreadTeam threads(members);
        threads.team().run([&](int member) { shares.transpose_multiply(rows, w.data(), many.data(), member); });
        EXPECT_EQ(one, many) << members << " threads";
    }
}

TEST_P(Runs, AreMadeByManyThreadsWithTheSameBits) {
    const RandomRows random(6, 300, GetParam(), 200);
    const BlockRows one = random.rows();
    for (const int members : {2, 3}) {
        ThreadTeam threads(members);
        const BlockRows many(random.matrix, random.groups, random.left.data(), random.right.data(), threads.team());
        const Vector v = padded(Vector::Random(300));
        Vector a = Vector::Zero(random.dense.rows()), b = a;
        one.multiply_add(v.data(), a.data());
        many.multiply_add(v.data(), b.data());
        EXPECT_EQ(a, b);
        EXPECT_EQ(one.entries(), many.entries());
    }
}

TEST_P(Runs, ReorderedRowsAreTheSameRows) {
    const RandomRows random(9, 50, GetParam(), 30);
    const BlockRows rows = random.rows();
    std::vector<std::int32_t> order(rows.groups().size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<std::int32_t>(order.size() - 1 - k);
    std::vector<RowGroup> taken;
    for (const std::int32_t k : order) taken.push_back(random.groups[static_cast<std::size_t>(k)]);
    BlockRows kept, renumbered;
    for (BlockRows* other : {&kept, &renumbered}) {
        // Memory of other rows is used again.
        const RandomRows before(5, 50, 6, 20);
        *other = before.rows();
        other->lay_out(random.matrix, random.groups);
        other->reorder(order, other == &renumbered);
        other->fill(random.matrix, taken, random.left.data(), random.right.data());
    }
    const Vector v = padded(Vector::Random(50));
    Vector a = Vector::Zero(random.dense.rows()), b = a, c = a;
    rows.multiply_add(v.data(), a.data());
    kept.multiply_add(v.data(), b.data());
    renumbered.multiply_add(v.data(), c.data());
    EXPECT_EQ(a, b);
    for (std::size_t k = 0; k < order.size(); ++k) {
        const RowGroup& group = random.groups[static_cast<std::size_t>(order[k])];
        EXPECT_EQ(a.segment(group.first, group.rows), c.segment(renumbered.groups()[k].first, group.rows));
    }
}

INSTANTIATE_TEST_SUITE_P(OfColumns, Runs, testing::Values(1, 3, 4, 6, 12));

}  // namespace
}  // namespace delassus::sdk::block_rows_test
