// SPDX-License-Identifier: BSD-3-Clause
// Shapes of one solid that lie flush: what touches them meets no edge between them.
#ifdef DELASSUS_HAS_FCL
#include <array>
#include <set>

#include "collision/scene.hpp"
#include "delassus/error.hpp"
#include "delassus/mesh_files.hpp"

namespace delassus::collision_tests::flush_test {
namespace {

constexpr double half = 0.5, thick = 0.1;

Shape at(Shape shape, const Vector3d& position) {
    shape.pose = pose(position);
    return shape;
}

enum class Tiles { Boxes, Hulls, Fields, Mixed };

/// 4 × 4 tiles with their tops in z = 0, on a body each, or all on body 0; mixed: boxes and fields of heights in turns.
struct Floor {
    std::vector<Shape> shapes;
    std::int32_t bodies = 0;
};

Floor tiles(bool one_body, Tiles kind = Tiles::Boxes) {
    Floor floor;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            const std::int32_t body = one_body ? 0 : floor.bodies;
            const bool field = kind == Tiles::Fields || (kind == Tiles::Mixed && (i + j) % 2 == 0);
            Shape tile = shape(ShapeKind::Box, {half, half, thick}, body);
            if (kind == Tiles::Hulls) tile = convex(box_mesh(half, half, thick), body);
            if (field) {
                tile = shape(ShapeKind::HeightField, {}, body);
                tile.mesh = std::make_shared<const Mesh>(
                    height_field({3, 2, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}}, 2.0 * half, 2.0 * half));
            }
            floor.shapes.push_back(at(tile, Vector3d(i - 1.5, j - 1.5, field ? 0.0 : -thick)));
            floor.bodies = body + 1;
        }
    return floor;
}

/// Contacts of a shape at a pose with a floor that is turned and moved as a whole.
std::vector<ContactPoint> on(const Floor& floor, Shape moving, const Pose& placed, const Pose& whole, double envelope) {
    CollisionSetup setup{floor.shapes, std::vector<bool>(static_cast<std::size_t>(floor.bodies), true), {}};
    setup.fixed.push_back(false);
    moving.body = floor.bodies;
    setup.shapes.push_back(moving);
    const Quaterniond turned(whole.orientation[0], whole.orientation[1], whole.orientation[2], whole.orientation[3]);
    const Quaterniond own(placed.orientation[0], placed.orientation[1], placed.orientation[2], placed.orientation[3]);
    std::vector<Pose> poses(static_cast<std::size_t>(floor.bodies), whole);
    poses.push_back(pose(vector(whole.position) + turned * vector(placed.position), turned * own));
    std::vector<ContactPoint> contacts;
    make_collision_detector(setup)->detect(poses, envelope, contacts);
    return contacts;
}

// Against the plane: every contact is along its normal, the least gap is the same, and something holds the shape there.
TEST(Flush, TilesActAsThePlaneThatTheyFill) {
    const Pose level = pose(Vector3d::Zero()),
               odd = pose(Vector3d(3.0, -7.0, 11.0), turn(0.7, Vector3d(1.0, 2.0, 0.5)));
    Random random(11);
    int compared = 0;
    for (const bool one_body : {false, true})
        for (const Tiles kind : {Tiles::Boxes, Tiles::Hulls, Tiles::Fields, Tiles::Mixed}) {
            const Floor floor = tiles(one_body, kind);
            for (int trial = 0; trial < 60; ++trial)
                for (const Shape& moving : kinds(0)) {
                    const bool is_odd = trial % 2 == 1;
                    const Pose& whole = is_odd ? odd : level;
                    const Vector3d normal =
                        is_odd ? turn(0.7, Vector3d(1.0, 2.0, 0.5)) * Vector3d::UnitZ() : Vector3d(Vector3d::UnitZ());
                    const Quaterniond own = turn(random(0.0, 6.0), Vector3d::UnitZ());
                    // Next to the seam as well, up to the rounding that crossing it has.
                    const double x = trial % 3 == 0 ? random(-1.0, 1.0) : random(-1e-9, 1e-9);
                    Pose placed = pose(Vector3d(x, random(-1.0, 1.0), 1.0), own);
                    CollisionSetup alone{{shape(ShapeKind::Plane, {}, -1), moving}, {false}, {}};
                    std::vector<ContactPoint> expected;
                    make_collision_detector(alone)->detect(std::vector<Pose>{placed}, 2.0, expected);
                    const double depth = trial % 4 == 0 ? 1e-3 : trial % 4 == 1 ? -1e-4 : 1e-10;
                    placed.position[2] -= least_gap(expected) + depth;
                    const auto found = on(floor, moving, placed, whole, 0.02);
                    ASSERT_FALSE(found.empty());
                    EXPECT_NEAR(least_gap(found), -depth, 1e-10);
                    for (const ContactPoint& contact : found) {
                        ++compared;
                        EXPECT_LT((vector(contact.normal) - (contact.shape_a < 16 ? 1.0 : -1.0) * normal).norm(), 2e-3)
                            << "tiles " << static_cast<int>(kind) << " kind " << static_cast<int>(moving.kind)
                            << " trial " << trial;
                    }
                }
        }
    EXPECT_GT(compared, 5000);
}

// A box in the corner of a floor and a wall, both of boxes, that may stand on the floor or beside it.
TEST(Flush, AWallStopsWhatStandsOnTheFloorBesideIt) {
    const Shape moving = shape(ShapeKind::Box, {0.2, 0.15, 0.1}, 0);
    for (const double foot : {0.0, -2.0 * thick}) {
        Floor floor = tiles(false);
        if (foot < 0.0) floor.shapes.erase(floor.shapes.begin() + 12, floor.shapes.end());
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 4; ++j)
                floor.shapes.push_back(at(shape(ShapeKind::Box, {0.25, half, thick}, 0),
                                          Vector3d(1.25, j - 1.5, foot + (2 * i + 1) * thick)));
        for (const double depth : {1e-10, 1e-3}) {
            const auto found =
                on(floor, moving, pose(Vector3d(0.8 + depth, 0.1, 0.1 - depth)), pose(Vector3d::Zero()), 1e-3);
            // Of the points below and before the box, how far they reach along x and along z on either side of it.
            std::array<std::set<double>, 2> below, before;
            for (const ContactPoint& contact : found) {
                const Vector3d normal = vector(contact.normal), point = vector(contact.point_b);
                const std::size_t side = point.y() < 0.1 ? 0 : 1;
                if (std::abs(point.y()) < 1e-9) continue;  // between the sides, over the seam
                EXPECT_NEAR(point.y(), side == 0 ? -0.05 : 0.25, 1e-3);
                if (normal.z() > 0.999) {
                    below[side].insert(point.x());
                } else {
                    EXPECT_LT(normal.x(), -0.999);
                    before[side].insert(point.z());
                }
            }
            for (const std::size_t side : {0U, 1U}) {
                ASSERT_FALSE(below[side].empty() || before[side].empty());
                EXPECT_NEAR(*below[side].begin(), 0.6, 2e-3);
                EXPECT_NEAR(*below[side].rbegin(), 1.0, 2e-3);
                EXPECT_NEAR(*before[side].begin(), 0.0, 2e-3);
                EXPECT_NEAR(*before[side].rbegin(), 0.2, 2e-3);
            }
        }
    }
}

TEST(Flush, StepsOfRealHeightAreEdges) {
    const Shape moving = shape(ShapeKind::Box, {0.2, 0.15, 0.1}, 0);
    for (const double height : {1e-2, 1e-3, -1e-2}) {
        Floor floor = tiles(false);
        for (std::size_t i = 8; i < 16; ++i) floor.shapes[i].pose.position[2] += height;
        const auto before = on(floor, moving, pose(Vector3d(-0.2001, 0.1, 0.1)), pose(Vector3d::Zero()), 1e-3);
        const bool stops = std::any_of(before.begin(), before.end(),
                                       [](const ContactPoint& contact) { return contact.normal[0] < -0.9; });
        EXPECT_EQ(stops, height > 0.0) << height;
        if (height > 0.0) continue;
        // Tipped over the edge of the upper floor.
        const auto over = on(floor, moving, pose(Vector3d(0.0, 0.1, 0.1004), turn(0.04, Vector3d::UnitY())),
                             pose(Vector3d::Zero()), 2e-3);
        EXPECT_FALSE(over.empty());
    }
}

// A body of two boxes is one box to what it slides over.
TEST(Flush, ABodyOfTwoBoxesHasNoEdgeBetweenThem) {
    CollisionSetup setup{{at(shape(ShapeKind::Box, {half, half, thick}, 0), Vector3d(half, 0.0, thick)),
                          at(shape(ShapeKind::Box, {half, half, thick}, 0), Vector3d(-half, 0.0, thick)),
                          at(shape(ShapeKind::Box, {half, half, thick}, 1), Vector3d(0.0, 0.0, -thick))},
                         {false, true},
                         {}};
    const auto detector = make_collision_detector(setup);
    std::vector<ContactPoint> contacts;
    for (const double x : {half + 1e-3, half - 1e-9, half - 1e-3, -half + 1e-3}) {
        detector->detect(std::vector<Pose>{pose(Vector3d(x, 0.1, -1e-10)), pose(Vector3d::Zero())}, 0.02, contacts);
        ASSERT_GE(contacts.size(), 4U);
        for (const ContactPoint& contact : contacts) EXPECT_LT(contact.normal[2], -0.999) << x;
    }
}

// A tile whose place is given passes one that is fixed; bodies that move by themselves are solids of their own.
TEST(Flush, WhatIsOneSolidIsSaidBySolid) {
    const std::vector<Shape> shapes = {at(shape(ShapeKind::Box, {half, half, thick}, 0), Vector3d(-half, 0.0, -thick)),
                                       at(shape(ShapeKind::Box, {half, half, thick}, 1), Vector3d(half, 0.0, -thick)),
                                       at(shape(ShapeKind::Box, {0.2, 0.2, 0.2}, 2), Vector3d(-0.21, 0.0, 0.2))};
    const auto sideways = [&](std::vector<std::int32_t> solid) {
        CollisionSetup setup{shapes, {true, false, false}, {{0, 1}}, {}, std::move(solid)};
        std::vector<ContactPoint> contacts;
        make_collision_detector(setup)->detect(std::vector<Pose>(3), 0.02, contacts);
        return std::any_of(contacts.begin(), contacts.end(),
                           [](const ContactPoint& contact) { return std::abs(contact.normal[0]) > 0.1; });
    };
    EXPECT_TRUE(sideways({}));
    EXPECT_FALSE(sideways({0, 0, -1}));
    EXPECT_THROW(sideways({0, 0}), InputError);
}

}  // namespace
}  // namespace delassus::collision_tests::flush_test
#endif
