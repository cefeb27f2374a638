// SPDX-License-Identifier: BSD-3-Clause
// Gaps against an oracle and against closed forms.
#ifdef DELASSUS_HAS_FCL
#include <tuple>

#include "collision/oracle.hpp"

namespace delassus::collision_tests::gap_test {
namespace {

/// Every pair of kinds, in random poses that are apart, just touching, and in penetration.
class PairGap : public ::testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(PairGap, IsTheSignedDistance) {
    const auto [i, j] = GetParam();
    const Shape a = kinds(0)[i], b = kinds(1)[j];
    Random random(static_cast<unsigned>(100 * i + j));
    for (int trial = 0; trial < 6; ++trial) {
        const Pose at_a = pose(Vector3d(1.0, -2.0, 0.5), random.rotation());
        const Vector3d direction = random.direction();
        const Quaterniond turned = random.rotation();
        const auto along = [&](double t) { return pose(vector(at_a.position) + t * direction, turned); };
        // Slides b to about the wanted gap.
        const double wanted = trial % 3 == 0 ? 0.2 : trial % 3 == 1 ? 1e-4 : -0.03;
        double low = 0.0, high = 4.0;
        for (int k = 0; k < 12; ++k) {
            const double middle = 0.5 * (low + high);
            (signed_distance(a, b, at_a, along(middle)) < wanted ? low : high) = middle;
        }
        const Pose at_b = along(high);
        const double expected = signed_distance(a, b, at_a, at_b);
        const auto contacts = touch(a, b, at_a, at_b, 0.4);
        expect_consistent(contacts, 0.4);
        ASSERT_FALSE(contacts.empty());
        // No direction separates more than the gap says, and the contact's own normal separates as much. Between nearly
        // parallel faces (1e-3) the gap is measured along the face's normal and right to 5e-7 of the depth.
        EXPECT_GE(least_gap(contacts), expected - 2e-8) << "trial " << trial;
        const Vector3d normal = nearest_normal(contacts);
        const double own = separation(a, b, at_a, at_b, normal);
        if (contacts.size() == 1) {
            EXPECT_NEAR(least_gap(contacts), own, 1e-11) << "trial " << trial;
        } else {
            EXPECT_NEAR(least_gap(contacts), std::max(own, expected), 2e-8) << "trial " << trial;
        }
        EXPECT_GT(vector(contacts[0].normal).dot(direction), 0.0) << "from a to b";

        // The other order of the shapes turns the normal and nothing else.
        const auto swapped = touch(b, a, at_b, at_a, 0.4);
        EXPECT_NEAR(least_gap(swapped), least_gap(contacts), 1e-10) << "trial " << trial;
        EXPECT_NEAR(nearest_normal(swapped).dot(normal), -1.0, 1e-6) << "trial " << trial;
    }
}

INSTANTIATE_TEST_SUITE_P(Kinds, PairGap, ::testing::Combine(::testing::Range(0, 10), ::testing::Range(0, 10)));

TEST(Gap, OfEveryKindToAPlane) {
    const Shape plane = shape(ShapeKind::Plane, {}, 0);
    Random random(7);
    for (const Shape& other : kinds(1)) {
        for (int trial = 0; trial < 20; ++trial) {
            const Quaterniond ground = random.rotation(), turned = random.rotation();
            const Vector3d origin(0.3, 0.2, -0.1), normal = ground * Vector3d::UnitZ();
            const double extent = support(other, turned.conjugate() * -normal);
            const double gap = random(-0.05, 0.05);
            const Pose at = pose(origin + (extent + gap) * normal + normal.unitOrthogonal(), turned);
            const auto contacts = touch(plane, other, pose(origin, ground), at, 0.06);
            expect_consistent(contacts, 0.06);
            EXPECT_NEAR(least_gap(contacts), gap, 1e-13);
            EXPECT_NEAR(vector(contacts[0].normal).dot(normal), 1.0, 1e-13);
            EXPECT_NEAR(least_gap(touch(other, plane, at, pose(origin, ground), 0.06)), gap, 1e-13);
        }
    }
}

/// Boxes, a mesh of a box and cylinders, face on face: 1e-9 m comes out as 1e-9 m, on either side of zero.
TEST(Gap, BetweenFacesIsExact) {
    const std::vector<Shape> flat{shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 1),
                                  shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 1, 0.1), convex(box_mesh(0.5, 0.5, 0.5), 1),
                                  convex(box_mesh(0.5, 0.5, 0.5), 1, 0.1),
                                  shape(ShapeKind::Cylinder, {0.4, 0.5, 0.0}, 1)};
    for (const Shape& lower : flat) {
        for (const Shape& upper : flat) {
            for (const double gap : {1e-9, -1e-9, 1e-6, -1e-6, 1e-3, -1e-3, 0.0}) {
                const auto contacts =
                    touch(lower, upper, pose(Vector3d::Zero()), pose(Vector3d(0.1, 0.05, 1.0 + gap)), 0.01);
                expect_consistent(contacts, 0.01);
                const bool caps = lower.kind == ShapeKind::Cylinder && upper.kind == ShapeKind::Cylinder;
                EXPECT_GE(contacts.size(), 4U);
                EXPECT_LE(contacts.size(), caps ? 10U : 8U);
                for (const auto& contact : contacts) {
                    EXPECT_NEAR(contact.gap, gap, 1e-12);
                    EXPECT_NEAR(contact.normal[2], 1.0, 1e-12);
                }
            }
        }
    }
}

/// Faces that rounding alone keeps apart, turned by as little: their normal stays the faces'.
TEST(Gap, NearRoundingKeepsTheNormalOfTheFaces) {
    const Shape lower = convex(box_mesh(0.5, 0.5, 0.5), 0), upper = convex(box_mesh(0.5, 0.5, 0.5), 1);
    Random random(3);
    for (int trial = 0; trial < 200; ++trial) {
        const Quaterniond turned = random.rotation();
        const double gap = 1e-12 * random(0.1, 10.0);
        const Quaterniond little = turn(gap, random.direction());
        const Vector3d at = turned * Vector3d(0.1 * random(0.0, 1.0), 0.05, 1.0 + gap);
        const auto contacts = touch(lower, upper, pose(Vector3d::Zero(), turned), pose(at, little * turned), 0.01);
        EXPECT_GE(contacts.size(), 4U) << "trial " << trial;
        for (const auto& contact : contacts)
            EXPECT_NEAR(vector(contact.normal).dot(turned * Vector3d::UnitZ()), 1.0, 1e-12) << "trial " << trial;
    }
}

TEST(Gap, OfCrossedEdges) {
    // Two cubes on edge, their edges crossing at right angles.
    const Shape cube = shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 0);
    const double half = std::sqrt(0.5);
    for (const double gap : {-1e-3, -1e-9, 1e-9, 1e-3}) {
        const auto contacts =
            touch(cube, cube, pose(Vector3d::Zero(), turn(0.25 * std::numbers::pi, Vector3d::UnitX())),
                  pose(Vector3d(0.1, 0.2, 2.0 * half + gap), turn(0.25 * std::numbers::pi, Vector3d::UnitY())), 0.01);
        ASSERT_EQ(contacts.size(), 1U);
        EXPECT_NEAR(contacts[0].gap, gap, 1e-12);
        EXPECT_NEAR(contacts[0].point_a[0], 0.1, 1e-9);
        EXPECT_NEAR(contacts[0].point_a[1], 0.0, 1e-9);
        EXPECT_NEAR(contacts[0].normal[2], 1.0, 1e-9);
    }
}

TEST(Gap, OfAVertexOnAFace) {
    const Shape cube = shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 0);
    const Quaterniond on_corner = Quaterniond::FromTwoVectors(Vector3d(1.0, 1.0, 1.0), -Vector3d::UnitZ());
    for (const double gap : {-1e-3, 1e-9, 1e-3}) {
        const auto contacts = touch(cube, cube, pose(Vector3d::Zero()),
                                    pose(Vector3d(0.1, -0.2, 0.5 + 0.5 * std::sqrt(3.0) + gap), on_corner), 0.01);
        ASSERT_EQ(contacts.size(), 1U);
        EXPECT_NEAR(contacts[0].gap, gap, 1e-12);
        EXPECT_NEAR(contacts[0].point_a[0], 0.1, 1e-12);
        EXPECT_NEAR(contacts[0].point_a[1], -0.2, 1e-12);
    }
}

TEST(Gap, OfLargeHullsThatLieFlush) {
    const Shape prism = convex(prism_mesh(), 0), cube = shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 0);
    for (const double gap : {-1e-3, 0.0, 1e-9, 1e-3})
        for (const Shape& below : {prism, cube}) {
            const double top = below.kind == ShapeKind::Box ? 0.5 : 0.4;
            const auto contacts =
                touch(below, prism, pose(Vector3d::Zero()),
                      pose(Vector3d(0.01, -0.02, top + 0.4 + gap), turn(0.3, Vector3d::UnitZ())), 0.01);
            EXPECT_GE(contacts.size(), 3U);
            for (const ContactPoint& contact : contacts) {
                EXPECT_NEAR(contact.gap, gap, 1e-12);
                EXPECT_NEAR(contact.normal[2], 1.0, 1e-12);
            }
        }
}

TEST(Gap, OfTwoVertices) {
    const Shape cube = shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 0);
    const auto contacts = touch(cube, cube, pose(Vector3d::Zero()), pose(Vector3d(1.01, 1.02, 1.02)), 0.05);
    ASSERT_EQ(contacts.size(), 1U);
    EXPECT_NEAR(contacts[0].gap, 0.03, 1e-14);
}

}  // namespace
}  // namespace delassus::collision_tests::gap_test
#endif
