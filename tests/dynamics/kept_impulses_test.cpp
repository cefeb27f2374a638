// SPDX-License-Identifier: BSD-3-Clause
// Impulses that serve as the start of the next step.
#include "dynamics/kept_impulses.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "delassus/error.hpp"
#include "support/frames.hpp"

namespace delassus::kept_impulses_test {
namespace {

using Eigen::Vector3d;

UnilateralRows::Block contact_block(std::uint64_t key) {
    return {.cone = Cone::friction(0.5), .key = key};
}

ContactPoint contact_with(const Vector3d& normal) {
    ContactPoint contact;
    contact.normal = {normal[0], normal[1], normal[2]};
    return contact;
}

Vector3d in_space(const Vector3d& normal, const std::array<double, 3>& rows) {
    return contact_frame(normal) * Vector3d(rows.data());
}

TEST(KeptImpulses, AContactThatTurnsKeepsItsImpulseInSpace) {
    // Two normals on either side of the jump of the tangents at |n_x| = 0.9.
    const Vector3d before = Vector3d(0.8999, std::sqrt(1.0 - 0.8999 * 0.8999), 0.0),
                   after = Vector3d(0.9001, std::sqrt(1.0 - 0.9001 * 0.9001), 0.0);
    ASSERT_LT(contact_frame(before).col(1).dot(contact_frame(after).col(1)), 0.0);
    const std::array<double, 3> rows = {3.0, -1.0, 0.5};
    const std::vector<UnilateralRows::Block> blocks = {contact_block(7)};
    const std::vector<ContactPoint> contacts = {contact_with(before)};
    KeptImpulses kept;
    kept.keep(blocks, contacts, rows);
    const ContactPoint turned = contact_with(after);
    std::array<double, 3> start{};
    kept.begin_walk();
    EXPECT_TRUE(kept.start(blocks[0], &turned, start).pushed);
    EXPECT_LT((in_space(after, start) - in_space(before, rows)).norm(), 1e-14);
}

TEST(KeptImpulses, BlocksAreFoundByTheirKeysInAnyOrder) {
    const std::vector<UnilateralRows::Block> blocks = {
        {.cone = Cone::nonnegative(1), .key = 9}, {.cone = Cone::nonnegative(1), .key = 3}, contact_block(5)};
    const std::vector<ContactPoint> contacts = {contact_with(Vector3d::UnitZ())};
    const std::vector<double> lambda = {9.0, 0.0, 5.0, 1.0, 2.0};
    KeptImpulses kept;
    kept.keep(blocks, contacts, lambda, std::vector<char>{0, 0, 1});
    std::vector<double> memory;
    kept.append_to(memory);
    KeptImpulses loaded;
    loaded.load(memory);
    for (KeptImpulses* one : {&kept, &loaded}) {
        one->begin_walk();
        double value = -1.0;
        const KeptImpulses::Start first = one->start(blocks[0], nullptr, {&value, 1});
        EXPECT_TRUE(first.pushed && !first.impulsive);
        EXPECT_EQ(value, 9.0);
        EXPECT_FALSE(one->start(blocks[1], nullptr, {&value, 1}).pushed);  // a key before the last one asked for
        EXPECT_EQ(value, 0.0);
        std::array<double, 3> three{};
        const KeptImpulses::Start contact = one->start(blocks[2], contacts.data(), three);
        EXPECT_TRUE(contact.pushed && contact.impulsive);
        EXPECT_NEAR(three[1], 1.0, 1e-15);
        // Unknown, or known with other rows: nothing.
        EXPECT_FALSE(one->start(contact_block(9), contacts.data(), three).pushed);
        EXPECT_EQ(three, (std::array<double, 3>{}));
        EXPECT_FALSE(one->start(contact_block(6), contacts.data(), three).pushed);
    }
    memory.pop_back();
    EXPECT_THROW(loaded.load(memory), InputError);
}

}  // namespace
}  // namespace delassus::kept_impulses_test
