// SPDX-License-Identifier: BSD-3-Clause
// Arrays that own or borrow their numbers.
#include "delassus/array.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "delassus/needs.hpp"
#include "delassus/problem.hpp"

namespace delassus {
namespace array_test {

using Numbers = std::vector<double>;

Numbers values(const Array<double>& array) {
    return {array.begin(), array.end()};
}

/// An owner of three numbers, and an array that borrows them.
struct Lent {
    std::shared_ptr<Numbers> owner = std::make_shared<Numbers>(Numbers{1.0, 2.0, 3.0});
    Array<double> array = Array<double>::borrowed(owner->data(), owner->size(), owner);
    [[nodiscard]] bool in_place(const Array<double>& other) const { return other.data() == owner->data(); }
};

TEST(Array, ReadsTheOwnersMemoryAndKeepsItAlive) {
    Lent lent;
    const Array<double>& array = lent.array;
    EXPECT_TRUE(lent.in_place(array));
    EXPECT_TRUE(array.borrows());
    const std::weak_ptr<Numbers> watched = lent.owner;
    lent.owner.reset();
    ASSERT_FALSE(watched.expired());
    EXPECT_EQ(values(array), Numbers({1.0, 2.0, 3.0}));
    lent.array = Numbers{4.0};
    EXPECT_TRUE(watched.expired());
    EXPECT_EQ(values(array), Numbers({4.0}));
}

TEST(Array, CopiesAndMovesBorrowToo) {
    Lent lent;
    Array<double> copy = lent.array;
    EXPECT_TRUE(lent.in_place(std::as_const(copy)));
    const Array<double> moved = std::move(copy);
    EXPECT_TRUE(lent.in_place(moved));
    EXPECT_TRUE(copy.empty());  // NOLINT(bugprone-use-after-move,clang-analyzer-cplusplus.Move)
    Array<double> other = {5.0, 6.0};
    other.swap(lent.array);
    EXPECT_TRUE(lent.in_place(std::as_const(other)));
    EXPECT_EQ(values(lent.array), Numbers({5.0, 6.0}));
    EXPECT_FALSE(lent.array.borrows());
    std::swap(other, lent.array);
    EXPECT_TRUE(lent.in_place(std::as_const(lent.array)));
    EXPECT_EQ(values(other), Numbers({5.0, 6.0}));
}

TEST(Array, WritingLeavesTheOwnerAlone) {
    const auto after = [](auto&& change) {
        Lent lent;
        change(lent.array);
        EXPECT_FALSE(lent.array.borrows());
        EXPECT_EQ(*lent.owner, Numbers({1.0, 2.0, 3.0}));
        return values(lent.array);
    };
    using A = Array<double>;
    EXPECT_EQ(after([](A& a) { a[1] = 7.0; }), Numbers({1.0, 7.0, 3.0}));
    EXPECT_EQ(after([](A& a) { a.data()[0] = 7.0; }), Numbers({7.0, 2.0, 3.0}));
    EXPECT_EQ(after([](A& a) { a.front() = a.back(); }), Numbers({3.0, 2.0, 3.0}));
    EXPECT_EQ(after([](A& a) {
                  for (double& v : a) v = -v;
              }),
              Numbers({-1.0, -2.0, -3.0}));
    EXPECT_EQ(after([](A& a) { a.push_back(4.0); }), Numbers({1.0, 2.0, 3.0, 4.0}));
    EXPECT_EQ(after([](A& a) { a.pop_back(); }), Numbers({1.0, 2.0}));
    EXPECT_EQ(after([](A& a) { a.resize(2); }), Numbers({1.0, 2.0}));
    EXPECT_EQ(after([](A& a) { a.clear(); }), Numbers());
    EXPECT_EQ(after([](A& a) { a.assign(2, 0.5); }), Numbers({0.5, 0.5}));
    EXPECT_EQ(after([](A& a) { a.assign(std::as_const(a).begin() + 1, std::as_const(a).end()); }), Numbers({2.0, 3.0}));
    EXPECT_EQ(after([](A& a) {
                  const Numbers two = {8.0, 9.0};
                  a.insert(std::as_const(a).begin() + 1, two.begin(), two.end());
              }),
              Numbers({1.0, 8.0, 9.0, 2.0, 3.0}));
    Numbers taken;
    EXPECT_EQ(after([&](A& a) { a.swap(taken); }), Numbers());
    EXPECT_EQ(taken, Numbers({1.0, 2.0, 3.0}));
}

TEST(Array, SharedMemoryIsThatOfTheCopies) {
    Array<double> array = {1.0, 2.0};
    const double* before = std::as_const(array).data();
    array.share();
    EXPECT_EQ(std::as_const(array).data(), before);
    const Array<double> copy = array;
    EXPECT_EQ(copy.data(), before);
    array[0] = 3.0;
    EXPECT_EQ(values(copy), Numbers({1.0, 2.0}));
    EXPECT_EQ(values(array), Numbers({3.0, 2.0}));
}

TEST(Array, ComparesValues) {
    const Lent lent;
    EXPECT_EQ(lent.array, Array<double>({1.0, 2.0, 3.0}));
    EXPECT_FALSE(lent.array == Array<double>({1.0, 2.0}));
    EXPECT_FALSE(lent.array == Array<double>({1.0, 2.0, 4.0}));
}

/// One velocity with one joint, all numbers in memory of the test.
struct LentProblem {
    std::shared_ptr<Numbers> reals = std::make_shared<Numbers>(Numbers{2.0, 1.0, -6.0, 0.5});
    std::shared_ptr<std::vector<std::int32_t>> indices =
        std::make_shared<std::vector<std::int32_t>>(std::initializer_list<std::int32_t>{0, 1, 0});
    Problem problem;

    LentProblem() {
        const auto real = [&](std::size_t at) { return Array<double>::borrowed(reals->data() + at, 1, reals); };
        const auto matrix = [&](std::size_t at) {
            return SparseMatrix{1, 1, Array<std::int32_t>::borrowed(indices->data(), 2, indices),
                                Array<std::int32_t>::borrowed(indices->data() + 2, 1, indices), real(at)};
        };
        problem.H = matrix(0);
        problem.D = matrix(1);
        problem.a = real(2);
        problem.b = real(3);
        problem.cones = {Cone::free(1)};
    }
};

TEST(Array, SolversSeeTheBorrowedMemory) {
    const LentProblem lent;
    const PreparedProblem prepared(lent.problem);
    const PreparedProblem other = prepared.with_law(Law::Coulomb);
    for (const PreparedProblem* shown : {&prepared, &other}) {
        const delassus_problem& raw = shown->raw();
        EXPECT_EQ(raw.H.value, lent.reals->data());
        EXPECT_EQ(raw.D.value, lent.reals->data() + 1);
        EXPECT_EQ(raw.a, lent.reals->data() + 2);
        EXPECT_EQ(raw.b, lent.reals->data() + 3);
        for (const delassus_matrix* matrix : {&raw.H, &raw.D}) {
            EXPECT_EQ(matrix->row_start, lent.indices->data());
            EXPECT_EQ(matrix->column, lent.indices->data() + 2);
        }
    }
}

TEST(Array, RenewingNeverWritesToBorrowedMemory) {
    const LentProblem lent;
    PreparedProblem prepared(lent.problem);
    Problem next = lent.problem;
    next.H.value[0] = 4.0;
    next.a[0] = 5.0;
    prepared.renew(std::move(next));
    EXPECT_EQ(prepared.problem().H.value[0], 4.0);
    EXPECT_EQ(prepared.raw().a[0], 5.0);
    prepared.set_right_hand_side({1.0}, {2.0});
    EXPECT_EQ(*lent.reals, Numbers({2.0, 1.0, -6.0, 0.5}));
    const LentProblem again;
    prepared.renew(again.problem);
    EXPECT_EQ(prepared.raw().a, again.reals->data() + 2);
}

}  // namespace array_test
}  // namespace delassus
