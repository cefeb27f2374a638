// SPDX-License-Identifier: BSD-3-Clause
// Shapes that move farther in a step than the envelope, and boxes whose faces nearly meet.
#include <numbers>

#include "delassus/error.hpp"
#include "scene.hpp"

#ifdef DELASSUS_HAS_FCL

namespace delassus::collision_tests::swept_test {
namespace {

/// The contacts of a shape that moves by d and turns by θ, with a second one that stays.
std::vector<ContactPoint> sweep(Shape moving, Shape fixed, const Pose& from, const Pose& at, const Vector3d& d,
                                const Vector3d& theta, double envelope) {
    moving.body = 0;
    fixed.body = 1;
    const auto detector = make_collision_detector({{moving, fixed}, {false, true}, {}});
    const std::vector<Pose> poses{from, at};
    const std::vector<BodyDisplacement> displacements{{{d.x(), d.y(), d.z()}, {theta.x(), theta.y(), theta.z()}}, {}};
    std::vector<ContactPoint> contacts;
    detector->detect(poses, envelope, contacts, {}, displacements);
    for (const auto& contact : contacts) {
        if (contact.on_the_way && theta.norm() > 0.0) continue;
        EXPECT_NEAR(vector(contact.normal).dot(vector(contact.point_b) - vector(contact.point_a)), contact.gap, 1e-12);
    }
    return contacts;
}

const Vector3d still = Vector3d::Zero();

// The way to the plate is z − 0.05 − 0.005 whatever the phase, and with that much of a step left the ball stops there.
TEST(Swept, ABallMeetsAThinPlateAtAnyPhase) {
    const Shape ball = shape(ShapeKind::Sphere, {0.05, 0.0, 0.0}, 0);
    const Shape plate = shape(ShapeKind::Box, {1.0, 1.0, 0.005}, 1);
    for (double z = 0.056; z < 0.24; z += 0.0071) {
        const auto contacts =
            sweep(ball, plate, pose(Vector3d(0.1, 0.2, z)), pose(still), Vector3d(0.03, 0.0, -0.15), still, 0.002);
        const double way = z - 0.055;
        ASSERT_EQ(contacts.size(), way < 0.152 ? 1U : 0U) << z;
        if (contacts.empty()) continue;
        EXPECT_NEAR(contacts[0].gap, way, 1e-12);
        EXPECT_NEAR(contacts[0].normal[2], -1.0, 1e-12);
        EXPECT_NEAR(contacts[0].point_a[2], z - 0.05, 1e-12);
    }
}

TEST(Swept, PlanesAndTerrainsAreMetToo) {
    const Shape ball = shape(ShapeKind::Sphere, {0.05, 0.0, 0.0}, 0);
    Shape ground = shape(ShapeKind::Terrain, {}, 1);
    auto mesh = std::make_shared<Mesh>();
    mesh->vertices = {{-1.0, -1.0, 0.0}, {1.0, -1.0, 0.0}, {1.0, 1.0, 0.0}, {-1.0, 1.0, 0.0}};
    mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
    ground.mesh = mesh;
    for (const Shape& below : {shape(ShapeKind::Plane, {}, 1), ground}) {
        const auto contacts =
            sweep(ball, below, pose(Vector3d(0.2, 0.1, 0.3)), pose(still), Vector3d(0.0, 0.0, -0.4), still, 0.002);
        ASSERT_EQ(contacts.size(), 1U);
        EXPECT_NEAR(contacts[0].gap, 0.25, 1e-12);
        EXPECT_TRUE(
            sweep(ball, below, pose(Vector3d(0.2, 0.1, 0.3)), pose(still), Vector3d(0.0, 0.0, -0.2), still, 0.002)
                .empty());
    }
}

// The ball flies over the edge: along the normal of the beginning it would seem to go through the box.
TEST(Swept, ShapesThatPassEachOtherGetNoContact) {
    const Shape ball = shape(ShapeKind::Sphere, {0.1, 0.0, 0.0}, 0), box = shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 1);
    const auto over = [&](double height) {
        return sweep(ball, box, pose(Vector3d(0.8, 0.5 + height, 0.0)), pose(still), Vector3d(-0.6, 0.0, 0.0), still,
                     0.002);
    };
    EXPECT_TRUE(over(0.3).empty());
    EXPECT_TRUE(over(0.103).empty());
    const auto contacts = over(0.05);
    ASSERT_EQ(contacts.size(), 1U);
    // The edge is met where the centre is 0.05 above it, √(0.1² − 0.05²) beside it.
    const Vector3d normal = vector(contacts[0].normal);
    EXPECT_NEAR(normal.y(), -0.5, 0.02);
    EXPECT_NEAR(contacts[0].gap, (0.3 - std::sqrt(0.0075)) * -normal.x(), 0.003);
}

TEST(Swept, ARodThatTurnsMeetsABall) {
    const Shape rod = shape(ShapeKind::Box, {0.5, 0.02, 0.02}, 0), ball = shape(ShapeKind::Sphere, {0.03, 0.0, 0.0}, 1);
    const Pose ahead = pose(Vector3d(0.4 * std::cos(0.5), 0.4 * std::sin(0.5), 0.0));
    EXPECT_TRUE(sweep(rod, ball, pose(still), ahead, still, Vector3d(0.0, 0.0, 0.3), 0.002).empty());
    const auto contacts = sweep(rod, ball, pose(still), ahead, still, Vector3d(0.0, 0.0, 0.7), 0.002);
    ASSERT_EQ(contacts.size(), 1U);
    // Turned by 0.5 rad less the angle of 0.05 m at 0.4 m, its face is at the ball. The gap is what the speed of that
    // place takes until then.
    const double turned = 0.5 - std::asin(0.05 / 0.4), arm = std::sqrt(0.4 * 0.4 - 0.05 * 0.05);
    const Vector3d normal = vector(contacts[0].normal), point = vector(contacts[0].point_a);
    EXPECT_NEAR(normal.y(), std::cos(turned), 0.01);
    EXPECT_NEAR(Vector3d::UnitZ().cross(point).dot(normal), arm, 0.01);
    EXPECT_NEAR(contacts[0].gap, turned * arm, 0.01);
}

// A ball rolls against a wall: it turns by 2 rad until it meets it, about an axis through its centre.
TEST(Swept, WhatRollsMeetsAsWhatSlides) {
    const Shape ball = shape(ShapeKind::Sphere, {0.1, 0.0, 0.0}, 0), wall = shape(ShapeKind::Box, {0.1, 1.0, 1.0}, 1);
    const auto contacts = sweep(ball, wall, pose(Vector3d(-0.4, 0.0, 0.0)), pose(still), Vector3d(0.25, 0.0, 0.0),
                                Vector3d(0.0, 2.5, 0.0), 0.002);
    ASSERT_EQ(contacts.size(), 1U);
    EXPECT_NEAR(contacts[0].gap, 0.2, 1e-9);
    EXPECT_NEAR(vector(contacts[0].point_a).x(), -0.3, 1e-9);
    EXPECT_NEAR(vector(contacts[0].point_a).z(), 0.0, 1e-9);
}

TEST(Swept, WhatMovesWithinTheEnvelopeIsAsIfItStood) {
    const Shape box = shape(ShapeKind::Box, {0.2, 0.3, 0.1}, 0), other = shape(ShapeKind::Box, {0.4, 0.1, 0.3}, 1);
    const Pose from = pose(Vector3d(0.1, 0.05, 0.405), turn(0.3, Vector3d(0.1, 0.2, 1.0)));
    const auto one = sweep(box, other, from, pose(still), still, still, 0.01);
    const auto moving = sweep(box, other, from, pose(still), Vector3d(0.004, 0.0, -0.005), still, 0.01);
    ASSERT_GT(one.size(), 0U);
    ASSERT_EQ(one.size(), moving.size());
    for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].gap, moving[i].gap);
}

TEST(Swept, DisplacementsOfAllBodiesOrNone) {
    const auto detector = make_collision_detector({{shape(ShapeKind::Sphere, {1.0, 0.0, 0.0}, 0)}, {false}, {}});
    std::vector<ContactPoint> contacts;
    const std::vector<Pose> poses(1);
    EXPECT_THROW(detector->detect(poses, 0.1, contacts, {}, std::vector<BodyDisplacement>(2)), InputError);
}

// Two boxes beside each other on the ground, edge to face, 2.8 mm apart. Their lower faces differ by nanometres, within
// the tolerance of the clipping, whose cut once lay far outside the face: 155 mm behind it.
TEST(Manifold, FacesThatAreFlushWithinTheToleranceHaveNoPointsBehindThem) {
    const Shape box = shape(ShapeKind::Box, {0.12, 0.08, 0.06}, 0);
    const Pose first{{-3.277282151256092e-01, -3.426685990969614e-01, 5.999997397116550e-02},
                     {8.044150578274781e-01, -3.435458970475567e-08, -1.213908302842989e-07, -5.940676853191050e-01}};
    const Pose second{
        {-1.4656828900427310e-01, -1.8513869022160992e-01, 6.0025588714684310e-02},
        {-8.2211890464667203e-01, 1.3188456345885818e-04, 9.1219141626859148e-05, -5.6931580068366838e-01}};
    const auto contacts = touch(box, box, first, second, 0.038);
    ASSERT_GE(contacts.size(), 2U);
    EXPECT_NEAR(least_gap(contacts), 2.786e-3, 1e-6);
    for (const auto& contact : contacts) EXPECT_LT(contact.gap, 0.038);
}

// Two edges cross where faces that are a degree from parallel come nearest; the corners above the face are as near as
// the tilt makes them, and would be in it a moment later.
TEST(Manifold, FacesThatNearlyMeetHaveTheirOtherCornersBesideCrossingEdges) {
    const Shape lower = shape(ShapeKind::Box, {0.5, 0.5, 0.1}, 0), upper = shape(ShapeKind::Box, {0.2, 0.2, 0.1}, 1);
    constexpr double degree = std::numbers::pi / 180.0;
    const Quaterniond tilt = turn(1.0 * degree, Vector3d::UnitY()) * turn(0.5 * degree, Vector3d::UnitX());
    const auto contacts = touch(lower, upper, pose(still), pose(Vector3d(0.5, 0.0, 0.204), tilt), 0.02);
    const double nearest = least_gap(contacts);
    ASSERT_GE(contacts.size(), 3U);
    Vector3d low = vector(contacts[0].point_a), high = low;
    for (const auto& contact : contacts) {
        const Vector3d at = vector(contact.point_a);
        low = low.cwiseMin(at);
        high = high.cwiseMax(at);
        EXPECT_GE(contact.gap, nearest);
        EXPECT_GT(contact.normal[2], 0.99);
    }
    EXPECT_GT(high.x() - low.x(), 0.19);
    EXPECT_GT(high.y() - low.y(), 0.38);
}

}  // namespace
}  // namespace delassus::collision_tests::swept_test

#endif
