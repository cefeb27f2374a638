// SPDX-License-Identifier: BSD-3-Clause
// Contacts with triangles that need be neither closed nor convex.
#ifdef DELASSUS_HAS_FCL
#include "collision/scene.hpp"
#include "delassus/error.hpp"
#include "delassus/mesh_files.hpp"

namespace delassus::collision_tests::terrain_test {
namespace {

Shape surface(ShapeKind kind, Mesh mesh) {
    Shape result = shape(kind, {}, -1);
    result.mesh = std::make_shared<const Mesh>(std::move(mesh));
    return result;
}

/// Heights over n × n points, from a function of x and y.
template <class Height>
Shape field(std::int32_t n, double size, Height&& height) {
    Heights heights{n, n, {}};
    for (std::int32_t row = 0; row < n; ++row)
        for (std::int32_t column = 0; column < n; ++column)
            heights.values.push_back(height(size * (column / (n - 1.0) - 0.5), size * (0.5 - row / (n - 1.0))));
    return surface(ShapeKind::HeightField, height_field(heights, size, size));
}

std::vector<ContactPoint> on(const Shape& ground, Shape moving, const Pose& at, double envelope) {
    moving.body = 0;
    auto detector = make_collision_detector({{ground, moving}, {false}, {}});
    std::vector<ContactPoint> contacts;
    detector->detect(std::vector<Pose>{at}, envelope, contacts);
    return contacts;
}

TEST(Terrain, FlatTrianglesGiveTheContactsOfThePlaneWithTheirNames) {
    const Shape ground = field(9, 8.0, [](double, double) { return 0.0; }), plane = shape(ShapeKind::Plane, {}, -1);
    Random random(3);
    int compared = 0;
    for (int trial = 0; trial < 300; ++trial) {
        for (const Shape& moving : kinds(0)) {
            const bool upright = trial % 3 == 0;
            const Quaterniond turned = upright ? Quaterniond::Identity() : random.rotation();
            // The last ones with corners over the borders of triangles.
            const double x = trial > 200 ? 0.5 : random(-2.0, 2.0), y = trial > 200 ? 0.7 : random(-2.0, 2.0);
            const Pose at = pose(Vector3d(x, y, random(0.2, 0.7)), turned);
            const auto expected = on(plane, moving, at, 0.05), found = on(ground, moving, at, 0.05);
            if (expected.size() == 8U && found.size() > 8U) continue;  // of a plane's points eight are kept
            ASSERT_EQ(found.size(), expected.size()) << "kind " << static_cast<int>(moving.kind) << " trial " << trial;
            expect_consistent(found, 0.05);
            for (std::size_t i = 0; i < found.size(); ++i) {
                ++compared;
                EXPECT_EQ(found[i].feature, expected[i].feature);
                EXPECT_NEAR(found[i].gap, expected[i].gap, 1e-15);
                EXPECT_EQ(found[i].normal, expected[i].normal);
                EXPECT_LT((vector(found[i].point_b) - vector(expected[i].point_b)).norm(), 1e-14);
            }
        }
    }
    EXPECT_GT(compared, 500);
}

TEST(Terrain, GapsOfAClosedConvexMeshAreThoseOfItsHull) {
    Random random(5);
    int near = 0;
    for (const auto& mesh : {tetrahedron_mesh(), box_mesh(0.2, 0.5, 0.3)}) {
        const Shape ground = surface(ShapeKind::Terrain, *mesh);
        Shape hull = convex(mesh, -1);
        for (int trial = 0; trial < 150; ++trial) {
            for (const Shape& moving : kinds(0)) {
                const Pose at = pose(random(0.5, 1.2) * random.direction(), random.rotation());
                const auto expected = on(hull, moving, at, 0.3);
                if (expected.empty() || least_gap(expected) < 1e-6) continue;
                ++near;
                const auto found = on(ground, moving, at, 0.3);
                // Points between flat features are measured along the face, to half of the square of 1e-3.
                EXPECT_NEAR(least_gap(found), least_gap(expected), 1e-6 * least_gap(expected) + 1e-10)
                    << "kind " << static_cast<int>(moving.kind) << " trial " << trial;
                expect_consistent(found, 0.3);
            }
        }
    }
    EXPECT_GT(near, 300);
}

TEST(Terrain, ShallowPenetrationOfAClosedConvexMeshIsThatOfItsHull) {
    Random random(6);
    int compared = 0;
    const auto mesh = box_mesh(0.2, 0.5, 0.3);
    const Shape ground = surface(ShapeKind::Terrain, *mesh), hull = convex(mesh, -1);
    for (int trial = 0; trial < 1600; ++trial) {
        for (const Shape& moving : kinds(0)) {
            const Pose at = pose(random(0.4, 1.0) * random.direction(), random.rotation());
            const auto expected = on(hull, moving, at, 0.01);
            if (expected.empty() || least_gap(expected) > -1e-6 || least_gap(expected) < -1e-3) continue;
            ++compared;
            EXPECT_NEAR(least_gap(on(ground, moving, at, 0.01)), least_gap(expected), 1e-9)
                << "kind " << static_cast<int>(moving.kind) << " trial " << trial;
        }
    }
    EXPECT_GT(compared, 10);
}

TEST(Terrain, ASphereIsAsFarAsTheNearestTriangle) {
    const auto height = [](double x, double y) { return 0.3 * std::sin(3.0 * x) * std::cos(2.0 * y) + 0.1 * x * x; };
    const Shape ground = field(21, 4.0, height);
    Random random(7);
    const double radius = 0.4;
    int below = 0;
    for (int trial = 0; trial < 400; ++trial) {
        const double x = random(-1.0, 1.0), y = random(-1.0, 1.0);
        const Vector3d centre(x, y, height(x, y) + random(-0.3, 0.7));
        // Dense samples of all triangles about it.
        double least = HUGE_VAL;
        for (const auto& corners : ground.mesh->triangles) {
            const Vector3d a = vector(ground.mesh->vertices[static_cast<std::size_t>(corners[0])]);
            const Vector3d b = vector(ground.mesh->vertices[static_cast<std::size_t>(corners[1])]);
            const Vector3d c = vector(ground.mesh->vertices[static_cast<std::size_t>(corners[2])]);
            if ((a - centre).norm() > least + 0.5) continue;
            for (int i = 0; i <= 20; ++i)
                for (int j = 0; i + j <= 20; ++j)
                    least = std::min(least, (a + i / 20.0 * (b - a) + j / 20.0 * (c - a) - centre).norm());
        }
        const auto contacts = on(ground, shape(ShapeKind::Sphere, {radius, 0.0, 0.0}, 0), pose(centre), 0.2);
        const bool under = centre.z() < height(x, y) - 0.02;
        if (under) ++below;
        if (centre.z() < height(x, y) + 0.02 && !under) continue;
        const double expected = (under ? -least : least) - radius;
        if (expected > 0.19) continue;
        // A sample is at most 0.01 from the nearest point, along the surface.
        EXPECT_NEAR(least_gap(contacts), expected, under ? 1.5e-2 : 1e-4 / std::max(0.05, least)) << trial;
        expect_consistent(contacts, 0.2);
    }
    EXPECT_GT(below, 20);
}

TEST(Terrain, AHeightFieldIsSolidAllTheWayDown) {
    const Shape ground = field(11, 4.0, [](double x, double) { return 0.1 * x; });
    for (const double depth : {0.5, 3.0, 100.0}) {
        const auto contacts =
            on(ground, shape(ShapeKind::Sphere, {0.1, 0.0, 0.0}, 0), pose(Vector3d(0.0, 0.0, -depth)), 0.01);
        if (0.1 * depth > 1.9) continue;  // the foot of the slope is beyond the field
        ASSERT_EQ(contacts.size(), 1U) << depth;
        EXPECT_NEAR(contacts[0].gap, -depth / std::hypot(1.0, 0.1) - 0.1, 1e-12);
        EXPECT_GT(contacts[0].normal[2], 0.9);
    }
    EXPECT_TRUE(on(ground, shape(ShapeKind::Sphere, {0.1, 0.0, 0.0}, 0), pose(Vector3d(3.0, 0.0, -1.0)), 0.01).empty());
}

TEST(Terrain, ASheetPushesUpWhatIsLittleBelowItAndAWallHasTwoSides) {
    const Shape sheet =
        surface(ShapeKind::Terrain, {{{-1.0, -1.0, 0.0}, {1.0, -1.0, 0.0}, {0.0, 1.0, 0.0}}, {{0, 1, 2}}});
    const Shape ball = shape(ShapeKind::Sphere, {0.1, 0.0, 0.0}, 0);
    const auto above = on(sheet, ball, pose(Vector3d(0.0, 0.0, 0.05)), 0.01),
               below = on(sheet, ball, pose(Vector3d(0.0, 0.0, -0.08)), 0.01);
    ASSERT_EQ(above.size(), 1U);
    ASSERT_EQ(below.size(), 1U);
    EXPECT_NEAR(above[0].gap, -0.05, 1e-15);
    EXPECT_NEAR(below[0].gap, -0.18, 1e-15);
    EXPECT_EQ(below[0].normal[2], 1.0);
    EXPECT_TRUE(on(sheet, ball, pose(Vector3d(0.0, 0.0, -0.5)), 0.01).empty());
    // A wall that is thinner than the ball: each side acts on its own side only.
    const Shape wall = surface(ShapeKind::Terrain, *box_mesh(0.02, 1.0, 1.0));
    for (const double side : {-1.0, 1.0}) {
        const auto contacts = on(wall, ball, pose(Vector3d(0.11 * side, 0.0, 0.0)), 0.01);
        ASSERT_EQ(contacts.size(), 1U);
        EXPECT_NEAR(contacts[0].gap, -0.01, 1e-15);
        EXPECT_EQ(contacts[0].normal[0], side);
    }
}

TEST(Terrain, ARimAndARidgeHoldABox) {
    // A table of two triangles; the box hangs over its edge by less than half.
    const Shape table =
        surface(ShapeKind::Terrain,
                {{{0.0, -2.0, 0.0}, {2.0, -2.0, 0.0}, {2.0, 2.0, 0.0}, {0.0, 2.0, 0.0}}, {{0, 1, 2}, {0, 2, 3}}});
    const Shape box = shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 0);
    const auto contacts = on(table, box, pose(Vector3d(0.1, 0.0, 0.499)), 0.01);
    ASSERT_EQ(contacts.size(), 4U);
    double least = HUGE_VAL;
    for (const auto& contact : contacts) {
        EXPECT_NEAR(contact.gap, -0.001, 1e-12);
        EXPECT_NEAR(contact.normal[2], 1.0, 1e-12);
        least = std::min(least, contact.point_b[0]);
    }
    EXPECT_NEAR(least, 0.0, 1e-12) << "on the rim";
    const Shape roof = field(3, 4.0, [](double x, double) { return -0.5 * std::abs(x); });
    const auto balanced = on(roof, box, pose(Vector3d(0.1, 0.0, 0.501)), 0.01);
    ASSERT_EQ(balanced.size(), 3U) << "at both ends, and where the ridge has a vertex";
    for (const auto& contact : balanced) {
        EXPECT_NEAR(contact.gap, 0.001, 1e-12);
        EXPECT_NEAR(contact.point_a[0], 0.0, 1e-12);
    }
}

// A box that is tilted along a ridge: the lower end comes near first, whichever it is, and is called the same when the
// other one has come near.
TEST(Terrain, WhatLiesOnARidgeKeepsItsNameWhenMoreComesNear) {
    const Shape roof =
        surface(ShapeKind::Terrain,
                {{{-2.0, 0.0, 0.0}, {2.0, 0.0, 0.0}, {0.0, 2.0, -1.0}, {0.0, -2.0, -1.0}}, {{0, 1, 2}, {1, 0, 3}}});
    const Shape box = shape(ShapeKind::Box, {0.5, 0.5, 0.5}, 0);
    for (const double tilt : {-0.01, 0.01}) {
        const Pose at = pose(Vector3d(0.1, 0.0, 0.51), turn(tilt, Vector3d::UnitY()));
        const auto near = on(roof, box, at, 0.007), all = on(roof, box, at, 0.05);
        ASSERT_EQ(near.size(), 1U) << tilt;
        ASSERT_EQ(all.size(), 2U) << tilt;
        const auto same = std::find_if(all.begin(), all.end(),
                                       [&](const ContactPoint& one) { return one.feature == near[0].feature; });
        ASSERT_NE(same, all.end()) << tilt;
        EXPECT_NEAR(same->gap, near[0].gap, 1e-12) << tilt;
    }
}

TEST(Terrain, InAValleyBothSidesAct) {
    const Shape valley = field(5, 4.0, [](double x, double) { return std::abs(x); });
    const auto ball = on(valley, shape(ShapeKind::Sphere, {0.3, 0.0, 0.0}, 0),
                         pose(Vector3d(0.0, 0.1, 0.3 * std::sqrt(2.0) - 1e-3)), 0.01);
    ASSERT_EQ(ball.size(), 2U);
    for (const auto& contact : ball) EXPECT_NEAR(contact.gap, -1e-3 / std::sqrt(2.0), 1e-12);
    // A cube stands on its edge in the valley.
    const auto cube =
        on(valley, shape(ShapeKind::Box, {0.3, 0.3, 0.3}, 0),
           pose(Vector3d(0.0, 0.0, 0.3 * std::sqrt(2.0) - 1e-4), turn(std::atan(1.0), Vector3d::UnitY())), 0.01);
    EXPECT_EQ(cube.size(), 8U);
    for (const auto& contact : cube) EXPECT_NEAR(contact.gap, -1e-4 / std::sqrt(2.0), 1e-12);
}

TEST(Terrain, BadSurfacesAreRefused) {
    const auto refusal = [](CollisionSetup setup) -> std::string {
        try {
            static_cast<void>(make_collision_detector(std::move(setup)));
        } catch (const InputError& error) {
            return error.what();
        }
        return "taken";
    };
    const std::vector<Vector3> corners{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {2.0, 0.0, 0.0}};
    EXPECT_EQ(refusal({{surface(ShapeKind::Terrain, {corners, {{0, 1, 3}}})}, {}, {}}),
              "Shape 0 (terrain): triangle 0 of the mesh has no area.");
    EXPECT_NE(refusal({{surface(ShapeKind::Terrain, {corners, {{0, 1, 2}, {0, 1, 2}}})}, {}, {}})
                  .find("run from vertex 0 to 1"),
              std::string::npos);
    EXPECT_EQ(refusal({{surface(ShapeKind::Terrain, {corners, {}})}, {}, {}}),
              "Shape 0 (terrain): the mesh has no triangles.");
    Shape moving = surface(ShapeKind::Terrain, {corners, {{0, 1, 2}}});
    moving.body = 0;
    EXPECT_NE(refusal({{moving}, {false}, {}}).find("body 0 moves"), std::string::npos);
    EXPECT_THROW(static_cast<void>(height_field({1, 2, {0.0, 0.0}}, 1.0, 1.0)), InputError);
    EXPECT_THROW(static_cast<void>(height_field({2, 2, {0.0, 0.0, 0.0, 0.0}}, 0.0, 1.0)), InputError);
}

}  // namespace
}  // namespace delassus::collision_tests::terrain_test
#endif
