// SPDX-License-Identifier: BSD-3-Clause
// Several points of a pair: how many, where, and what stays of them under motion.
#ifdef DELASSUS_HAS_FCL
#include <map>
#include <numbers>
#include <set>

#include "collision/scene.hpp"

namespace delassus::collision_tests::manifold_test {
namespace {

const Shape kCube = shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 0);

TEST(Manifold, CountsOfFacesEdgesAndPoints) {
    const Pose below = pose(Vector3d::Zero());
    const Quaterniond lying = turn(0.5 * std::numbers::pi, Vector3d::UnitY());
    const Shape small = shape(ShapeKind::Box, {0.2, 0.2, 0.2}, 0),
                capsule = shape(ShapeKind::Capsule, {0.1, 0.3, 0.0}, 0);
    const Shape cylinder = shape(ShapeKind::Cylinder, {0.1, 0.3, 0.0}, 0), plane = shape(ShapeKind::Plane, {}, 0);
    const auto count = [&](const Shape& a, const Shape& b, const Pose& at) {
        return touch(a, b, below, at, 1e-3).size();
    };
    EXPECT_EQ(count(kCube, kCube, pose(Vector3d(0.0, 0.0, 1.0))), 4U) << "flush";
    EXPECT_EQ(count(kCube, kCube, pose(Vector3d(0.3, 0.2, 1.0))), 4U) << "overhanging";
    EXPECT_EQ(count(kCube, small, pose(Vector3d(0.1, 0.1, 0.7), turn(0.3, Vector3d::UnitZ()))), 4U) << "inside";
    EXPECT_EQ(count(kCube, kCube, pose(Vector3d(0.0, 0.0, 1.0), turn(0.25 * std::numbers::pi, Vector3d::UnitZ()))), 8U);
    EXPECT_EQ(count(kCube, kCube,
                    pose(Vector3d(0.0, 0.2, 0.5 + std::sqrt(0.5)), turn(0.25 * std::numbers::pi, Vector3d::UnitX()))),
              2U)
        << "edge on face";
    EXPECT_EQ(count(kCube, capsule, pose(Vector3d(0.0, 0.0, 0.6), lying)), 2U);
    EXPECT_EQ(count(kCube, cylinder, pose(Vector3d(0.0, 0.0, 0.6), lying)), 2U);
    EXPECT_EQ(count(capsule, capsule, pose(Vector3d(0.2, 0.0, 0.1))), 2U) << "side by side";
    EXPECT_EQ(count(cylinder, cylinder, pose(Vector3d(0.2, 0.0, 0.1))), 2U) << "side by side";
    EXPECT_EQ(count(cylinder, capsule, pose(Vector3d(0.2, 0.0, 0.1))), 2U) << "side by side";
    EXPECT_EQ(count(plane, kCube, pose(Vector3d(0.0, 0.0, 0.5))), 4U);
    EXPECT_EQ(count(plane, capsule, pose(Vector3d(0.0, 0.0, 0.1), lying)), 2U);
    EXPECT_EQ(count(plane, cylinder, pose(Vector3d(0.0, 0.0, 0.1), lying)), 2U);
    EXPECT_GE(count(plane, cylinder, pose(Vector3d(0.0, 0.0, 0.3))), 4U);
    EXPECT_EQ(count(kCube, shape(ShapeKind::Sphere, {0.1, 0.0, 0.0}, 0), pose(Vector3d(0.0, 0.0, 0.6))), 1U);
}

TEST(Manifold, CornersOfAnOverhangingBox) {
    const auto contacts = touch(kCube, kCube, pose(Vector3d::Zero()), pose(Vector3d(0.3, 0.2, 1.0 + 1e-4)), 1e-3);
    std::set<std::pair<long, long>> corners;
    for (const auto& c : contacts) corners.emplace(std::lround(10.0 * c.point_a[0]), std::lround(10.0 * c.point_a[1]));
    EXPECT_EQ(corners, (std::set<std::pair<long, long>>{{-2, -3}, {5, -3}, {5, 5}, {-2, 5}}));
}

TEST(Manifold, FeaturesStayWhileABoxSlides) {
    std::map<std::uint32_t, Vector3d> before;
    for (int step = 0; step < 50; ++step) {
        const Vector3d at(0.1 + 0.005 * step, 0.15 - 0.001 * step, 1.0 + 1e-5 * std::sin(step));
        const auto contacts = touch(kCube, kCube, pose(Vector3d::Zero()),
                                    pose(at, turn(1e-6 * std::cos(step), Vector3d(1.0, 2.0, 0.5))), 1e-3);
        ASSERT_EQ(contacts.size(), 4U) << step;
        std::map<std::uint32_t, Vector3d> now;
        for (const auto& contact : contacts) now[contact.feature] = vector(contact.point_a);
        if (step > 0) {
            for (const auto& [feature, point] : now) {
                ASSERT_TRUE(before.contains(feature)) << step;
                EXPECT_LT((point - before[feature]).norm(), 0.006);
            }
        }
        before = now;
    }
}

/// A box tips over another: its least gap moves no faster than its corners do.
TEST(Manifold, GapIsContinuousWhileABoxTips) {
    const double step = 1e-3, reach = std::sqrt(0.75);
    for (const Vector3d& axis : {Vector3d(1.0, 0.0, 0.0), Vector3d(1.0, 0.3, 0.1)}) {
        double before = 0.0;
        for (int i = 0; i < 1600; ++i) {
            const auto contacts = touch(kCube, kCube, pose(Vector3d::Zero()),
                                        pose(Vector3d(0.2, 0.1 + 2e-4 * i, 1.25), turn(i * step, axis)), 1.0);
            expect_consistent(contacts, 1.0);
            ASSERT_FALSE(contacts.empty());
            const double gap = least_gap(contacts);
            if (i > 0) {
                EXPECT_LT(std::abs(gap - before), step * reach + 2e-4 + 1e-9) << i;
            }
            before = gap;
        }
    }
}

TEST(Manifold, CylindersGapIsContinuousWhileTipping) {
    const Shape cylinder = shape(ShapeKind::Cylinder, {0.3, 0.4, 0.0}, 1);
    double before = 0.0;
    for (int i = 0; i < 1000; ++i) {
        const auto contacts = touch(kCube, cylinder, pose(Vector3d::Zero()),
                                    pose(Vector3d(0.2, 0.3, 0.95), turn(2e-3 * i, Vector3d(1.0, 0.2, 0.0))), 1.0);
        ASSERT_FALSE(contacts.empty());
        const double gap = least_gap(contacts);
        if (i > 0) {
            EXPECT_LT(std::abs(gap - before), 2e-3 * 0.5 + 1e-9) << i;
        }
        before = gap;
    }
}

}  // namespace
}  // namespace delassus::collision_tests::manifold_test
#endif
