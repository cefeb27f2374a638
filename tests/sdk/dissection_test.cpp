// SPDX-License-Identifier: BSD-3-Clause
// Orders by METIS: permutations, always the same, without a trace in the process.
#include "delassus/sdk/dissection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <thread>

#include "delassus/sdk/sparse_factor.hpp"

namespace delassus {
namespace {

using sdk::SparseColumns;

/// The lower triangle of the Laplacian of a grid of side³ nodes.
SparseColumns grid(int side) {
    const auto node = [side](int x, int y, int z) { return (z * side + y) * side + x; };
    std::vector<Eigen::Triplet<double, std::int32_t>> entries;
    for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                entries.emplace_back(node(x, y, z), node(x, y, z), 7.0);
                if (x > 0) entries.emplace_back(node(x, y, z), node(x - 1, y, z), -1.0);
                if (y > 0) entries.emplace_back(node(x, y, z), node(x, y - 1, z), -1.0);
                if (z > 0) entries.emplace_back(node(x, y, z), node(x, y, z - 1), -1.0);
            }
    SparseColumns matrix(side * side * side, side * side * side);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
}

class Dissection : public testing::Test {
protected:
    void SetUp() override {
        if (!sdk::Metis::find()) GTEST_SKIP() << "METIS is not installed";
    }
};

TEST_F(Dissection, IsAPermutationAndSavesFill) {
    const SparseColumns matrix = grid(20);
    auto position = sdk::nested_dissection(matrix);
    std::sort(position.begin(), position.end());
    ASSERT_EQ(position.size(), 8000U);
    for (std::size_t i = 0; i < position.size(); ++i) ASSERT_EQ(position[i], static_cast<std::int32_t>(i));
    sdk::SparseFactor factor;
    factor.analyze(matrix, 8000);
    EXPECT_LT(factor.entries(), 1.3e6) << "AMD alone leaves some 1.6 million";
}

TEST_F(Dissection, IsTheSameInEachCallAndInThreads) {
    const SparseColumns matrix = grid(16);
    const auto first = sdk::nested_dissection(matrix);
    std::array<std::vector<std::int32_t>, 4> found;
    std::array<std::thread, 4> threads;
    for (std::size_t i = 0; i < threads.size(); ++i)
        threads[i] = std::thread([&, i] { found[i] = sdk::nested_dissection(matrix); });
    for (auto& thread : threads) thread.join();
    for (const auto& position : found) EXPECT_EQ(position, first);
}

TEST_F(Dissection, LeavesRandomNumbersAndSignalsOfTheProcess) {
    std::srand(5);
    const int expected = std::rand();
    const auto before = std::signal(SIGTERM, SIG_IGN);
    std::srand(5);
    static_cast<void>(sdk::nested_dissection(grid(12)));
    EXPECT_EQ(std::rand(), expected);
    EXPECT_EQ(std::signal(SIGTERM, before), SIG_IGN);
}

TEST_F(Dissection, TakesPartsThatNothingJoins) {
    SparseColumns matrix(3000, 3000);
    matrix.setIdentity();
    EXPECT_EQ(sdk::nested_dissection(matrix).size(), 3000U);
}

}  // namespace
}  // namespace delassus
