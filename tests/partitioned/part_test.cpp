// SPDX-License-Identifier: BSD-3-Clause
// Parts of a problem, in one process and, started by mpirun, in several.
#include <gtest/gtest.h>

#include "delassus/error.hpp"
#include "delassus/generate.hpp"
#include "delassus/partitioned.hpp"
#include "support/small_problems.hpp"

namespace delassus::part_test {
namespace {

void expect_same(const SparseMatrix& here, const SparseMatrix& there) {
    if (here.entries() == 0 && there.entries() == 0) return;
    EXPECT_EQ(here.rows, there.rows);
    EXPECT_EQ(here.columns, there.columns);
    EXPECT_EQ(here.row_start, there.row_start);
    EXPECT_EQ(here.column, there.column);
    EXPECT_EQ(here.value, there.value);
}

class Parts : public testing::Test {
protected:
    std::shared_ptr<const Communicator> run = communicator_of_run();
};

TEST_F(Parts, AreTheWholeTogether) {
    for (const char* family : {"box_stack", "chain", "elastic_block", "sphere_pile"}) {
        SCOPED_TRACE(family);
        const Problem whole = generate(family, {});
        const PartitionedProblem part = part_of(*run, whole);
        validate(*run, part);
        EXPECT_EQ(part.n_all(), whole.n());
        EXPECT_EQ(part.m_all(), whole.m());
        const Problem again = gathered(*run, part);
        expect_same(again.H, whole.H);
        expect_same(again.D, whole.D);
        expect_same(again.E, whole.E);
        EXPECT_EQ(again.a, whole.a);
        EXPECT_EQ(again.b, whole.b);
        ASSERT_EQ(again.cones.size(), whole.cones.size());
        for (std::size_t k = 0; k < whole.cones.size(); ++k) {
            EXPECT_EQ(again.cones[k].kind, whole.cones[k].kind);
            EXPECT_EQ(again.cones[k].rows, whole.cones[k].rows);
            EXPECT_EQ(again.cones[k].parameters, whole.cones[k].parameters);
        }
    }
}

TEST_F(Parts, KeepBodiesAndConesWhole) {
    const Problem whole = generate("box_stack", {});
    const PartitionedProblem part = part_of(*run, whole);
    for (const auto start : part.column_start) EXPECT_EQ(start % 6, 0);
    std::int64_t rows = 0;
    for (const Cone& cone : part.cones) rows += cone.rows;
    EXPECT_EQ(rows, part.m());
}

// More processes than bodies: some own nothing.
TEST_F(Parts, MayBeEmpty) {
    const PartitionedProblem part = part_of(*run, tests::point_on_plane(1.0, 1.0, 0.5, 0.5, Law::Associated));
    validate(*run, part);
    EXPECT_EQ(part.n_all(), 3);
    EXPECT_EQ(part.m_all(), 3);
}

TEST_F(Parts, AWrongPartIsRefusedOnAllProcesses) {
    PartitionedProblem part = part_of(*run, generate("box_stack", {}));
    if (run->rank() == run->size() - 1 && part.m() > 0) part.b[0] = std::nan("");
    try {
        validate(*run, part);
        FAIL() << "it was taken";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("its b holds a value that is not finite"), std::string::npos)
            << error.what();
    }
}

TEST_F(Parts, OneFailureIsEverybodys) {
    const int last = run->size() - 1;
    try {
        together(*run, [&] {
            if (run->rank() == last) throw InputError("the disk is full");
        });
        FAIL() << "nobody knows";
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "the disk is full");
    }
}

TEST_F(Parts, TalkToOneAnother) {
    const int size = run->size(), rank = run->rank();
    std::vector<double> sums = {1.0, static_cast<double>(rank)};
    run->sum(sums);
    EXPECT_EQ(sums, (std::vector<double>{static_cast<double>(size), 0.5 * size * (size - 1)}));
    std::vector<std::int64_t> largest = {rank, -rank};
    run->max(largest);
    EXPECT_EQ(largest, (std::vector<std::int64_t>{size - 1, 0}));
    std::vector<std::vector<std::byte>> to(static_cast<std::size_t>(size));
    for (int p = 0; p < size; ++p) to[static_cast<std::size_t>(p)].assign(static_cast<std::size_t>(p), std::byte(rank));
    const auto from = run->exchange(to);
    for (int p = 0; p < size; ++p)
        EXPECT_EQ(from[static_cast<std::size_t>(p)],
                  std::vector<std::byte>(static_cast<std::size_t>(rank), std::byte(p)));
    EXPECT_EQ(run->broadcast(std::to_string(rank), size - 1), std::to_string(size - 1));
    EXPECT_EQ(run->bytes_sent() > 0, size > 1);
}

}  // namespace
}  // namespace delassus::part_test
