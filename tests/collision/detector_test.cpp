// SPDX-License-Identifier: BSD-3-Clause
// What the detector reports of many shapes, and what it refuses.
#include <cstring>
#include <limits>
#include <tuple>

#include "collision/scene.hpp"
#include "delassus/error.hpp"

namespace delassus::collision_tests::detector_test {
namespace {

std::string refusal(const CollisionSetup& setup) {
    try {
        (void)make_collision_detector(setup);
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

// Of boxes and hulls that touch in several ways, and lie flush beside one another.
TEST(CollisionDetector, FindsOfAPairAloneWhatItFindsAmongAll) {
    std::vector<Shape> shapes = {
        shape(ShapeKind::Box, {1.0, 1.0, 0.1}, 0),      shape(ShapeKind::Box, {1.0, 1.0, 0.1}, 1),
        shape(ShapeKind::Box, {0.3, 0.2, 0.1}, 2),      convex(tetrahedron_mesh(), 3),
        shape(ShapeKind::Cylinder, {0.2, 0.3, 0.0}, 4), shape(ShapeKind::Plane, {}, -1)};
    shapes[2].pose.position = {0.05, 0.0, 0.02};
    const auto make = [&] { return make_collision_detector({shapes, {true, true, false, false, false}, {}}); };
    std::vector<Pose> poses = {pose({0.0, 0.0, -0.1}), pose({2.0, 0.0, -0.1}), pose({1.0, 0.1, 0.07}),
                               pose({1.1, -0.2, 0.45}, turn(0.4, {1.0, 0.3, 0.0})),
                               pose({0.9, 0.6, 0.19}, turn(1.55, {1.0, 0.1, 0.0}))};
    const std::vector<Pose> elsewhere = {poses[0], poses[1], pose({0.3, 0.1, 0.2}), pose({-0.4, 0.0, 0.9}),
                                         pose({0.2, -0.5, 0.4})};
    const auto whole = make(), alone = make();
    std::vector<ContactPoint> all, others;
    whole->detect(poses, 0.05, all);
    alone->detect(elsewhere, 0.05, others);
    std::vector<ContactPoint> pairs;
    for (std::int32_t a = 0; a < 6; ++a)
        for (std::int32_t b = a + 1; b < 6; ++b) {
            const auto body = [&](std::int32_t k) { return shapes[static_cast<std::size_t>(k)].body; };
            if (b == 1 || (a < 2 && b == 5)) continue;
            alone->detect_pair(a, b, poses[static_cast<std::size_t>(body(a))],
                               body(b) < 0 ? Pose{} : poses[static_cast<std::size_t>(body(b))], 0.05, pairs);
        }
    ASSERT_GT(all.size(), 6U);
    ASSERT_EQ(pairs.size(), all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
        EXPECT_EQ(std::tuple(pairs[k].shape_a, pairs[k].shape_b, pairs[k].feature),
                  std::tuple(all[k].shape_a, all[k].shape_b, all[k].feature));
        EXPECT_NEAR(pairs[k].gap, all[k].gap, 1e-14);
        EXPECT_LT((vector(pairs[k].normal) - vector(all[k].normal)).norm(), 1e-14);
        EXPECT_LT((vector(pairs[k].point_a) - vector(all[k].point_a)).norm(), 1e-14);
    }
}

TEST(CollisionSetup, BadOnesAreRefused) {
    const auto one = [](const Shape& bad) { return refusal({{bad}, {false}, {}}); };
    const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
    EXPECT_TRUE(has(one(shape(ShapeKind::Sphere, {0.0, 0.0, 0.0}, 0)), "positive"));
    EXPECT_TRUE(has(one(shape(ShapeKind::Box, {1.0, std::nan(""), 1.0}, 0)), "size 1"));
    EXPECT_TRUE(has(one(shape(ShapeKind::Capsule, {1.0, HUGE_VAL, 0.0}, 0)), "finite"));
    EXPECT_TRUE(has(one(shape(ShapeKind::Box, {1.0, 0.1, 1.0}, 0, 0.1)), "margin"));
    EXPECT_TRUE(has(one(shape(ShapeKind::Box, {1.0, 0.1, 1.0}, 0, -0.1)), "margin"));
    EXPECT_TRUE(has(one(shape(ShapeKind::Plane, {}, 0)), "moves"));
    EXPECT_TRUE(has(one(shape(ShapeKind::Sphere, {1.0, 0.0, 0.0}, 1)), "body"));
    EXPECT_TRUE(has(one(shape(ShapeKind::Convex, {}, 0)), "no mesh"));
    Shape tilted = shape(ShapeKind::Sphere, {1.0, 0.0, 0.0}, 0);
    tilted.pose.orientation = {0.0, 0.0, 0.0, 0.0};
    EXPECT_TRUE(has(one(tilted), "quaternion"));
    EXPECT_TRUE(has(refusal({{}, {false}, {{0, 1}}}), "of bodies that never touch"));
    EXPECT_TRUE(has(refusal({{}, {false, false}, {}, {0}}), "groups for 1 bodies of 2"));

    Mesh mesh = *box_mesh(1.0, 1.0, 1.0);
    const auto meshed = [&](const Mesh& bad) { return one(convex(std::make_shared<Mesh>(bad), 0)); };
    Mesh open = mesh;
    open.triangles.pop_back();
    EXPECT_TRUE(has(meshed(open), "open"));
    Mesh turned = mesh;
    std::swap(turned.triangles[3][0], turned.triangles[3][1]);
    EXPECT_TRUE(has(meshed(turned), "opposite directions"));
    Mesh inside_out = mesh;
    for (auto& triangle : inside_out.triangles) std::swap(triangle[0], triangle[1]);
    EXPECT_TRUE(has(meshed(inside_out), "clockwise"));
    Mesh flat = mesh;
    for (auto& vertex : flat.vertices) vertex[2] = 0.0;
    EXPECT_TRUE(has(meshed(flat), "volume"));
    Mesh outside = mesh;
    outside.triangles[0][0] = 8;
    EXPECT_TRUE(has(meshed(outside), "triangle 0"));
    Mesh infinite = mesh;
    infinite.vertices[2][1] = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(has(meshed(infinite), "vertex 2"));
#ifdef DELASSUS_HAS_FCL
    EXPECT_TRUE(has(one(convex(box_mesh(1.0, 1.0, 1.0), 0, 1.0)), "margin"));
#endif
}

#ifdef DELASSUS_HAS_FCL

/// Bodies in a heap, all kinds mixed, over a fixed plane and a fixed box of the world.
CollisionSetup heap(int count) {
    CollisionSetup setup;
    setup.shapes.push_back(shape(ShapeKind::Plane, {}, -1));
    setup.shapes.push_back(shape(ShapeKind::Box, {1.0, 1.0, 0.2}, -1));
    for (int i = 0; i < count; ++i) {
        setup.shapes.push_back(kinds(i)[static_cast<std::size_t>(i) % 8]);
        setup.fixed.push_back(i % 10 == 9);
    }
    return setup;
}

std::vector<Pose> heap_poses(int count, unsigned seed) {
    Random random(seed);
    std::vector<Pose> poses;
    for (int i = 0; i < count; ++i) {
        const Quaterniond turned = random.rotation();
        poses.push_back(pose(Vector3d(random(-1.5, 1.5), random(-1.5, 1.5), random(0.0, 2.0)), turned));
    }
    return poses;
}

bool same_bits(const std::vector<ContactPoint>& first, const std::vector<ContactPoint>& second) {
    return std::equal(
        first.begin(), first.end(), second.begin(), second.end(), [](const ContactPoint& a, const ContactPoint& b) {
            return a.shape_a == b.shape_a && a.shape_b == b.shape_b && a.point_a == b.point_a &&
                   a.point_b == b.point_b && a.normal == b.normal && a.gap == b.gap && a.feature == b.feature;
        });
}

TEST(Detector, SameInputSameBits) {
    auto detector = make_collision_detector(heap(60)), other = make_collision_detector(heap(60));
    std::vector<ContactPoint> first, between, again, elsewhere;
    detector->detect(heap_poses(60, 1), 0.02, first);
    detector->detect(heap_poses(60, 2), 0.05, between);
    detector->detect(heap_poses(60, 1), 0.02, again);
    other->detect(heap_poses(60, 1), 0.02, elsewhere);
    ASSERT_GT(first.size(), 100U);
    expect_consistent(first, 0.02);
    EXPECT_TRUE(same_bits(first, again));
    EXPECT_TRUE(same_bits(first, elsewhere));
}

// The pairs that a detector keeps from call to call must not show: whether nothing, a few shapes, most of them or the
// envelope changed, a new detector finds the same.
TEST(Detector, FindsWhatANewOneFindsWhileShapesMove) {
    const CollisionSetup setup = heap(60);
    auto kept = make_collision_detector(setup);
    auto poses = heap_poses(60, 1);
    Random random(7);
    std::vector<ContactPoint> contacts, expected;
    std::size_t changes = 0, last = 0;
    for (int step = 0; step < 60; ++step) {
        const double share = step % 20 == 19 ? 1.0 : step % 5 == 4 ? 0.0 : 0.1;
        for (std::size_t i = 0; i < poses.size(); ++i) {
            if (setup.fixed[i] || random(0.0, 1.0) >= share) continue;
            for (double& coordinate : poses[i].position) coordinate += random(-0.3, 0.3);
        }
        const double envelope = step % 7 == 6 ? 0.05 : 0.02;
        kept->detect(poses, envelope, contacts);
        make_collision_detector(setup)->detect(poses, envelope, expected);
        ASSERT_TRUE(same_bits(contacts, expected)) << "step " << step;
        changes += contacts.size() != last ? 1 : 0;
        last = contacts.size();
    }
    EXPECT_GT(changes, 30U);
}

TEST(Detector, FindsWhatAllPairsFind) {
    CollisionSetup setup = heap(40);
    auto poses = heap_poses(40, 3);
    // Each body by itself, so that none covers what another one has: the box of the world becomes one.
    setup.shapes[1].body = 40;
    setup.fixed.push_back(true);
    poses.emplace_back();
    setup.solid.assign(41, -1);
    std::vector<ContactPoint> contacts;
    make_collision_detector(setup)->detect(poses, 0.02, contacts);
    std::size_t expected = 0;
    for (std::size_t i = 0; i < setup.shapes.size(); ++i) {
        for (std::size_t j = i + 1; j < setup.shapes.size(); ++j) {
            CollisionSetup pair{{setup.shapes[i], setup.shapes[j]}, setup.fixed, {}, {}, setup.solid};
            std::vector<ContactPoint> alone;
            make_collision_detector(pair)->detect(poses, 0.02, alone);
            expected += alone.size();
        }
    }
    EXPECT_EQ(contacts.size(), expected);
}

TEST(Detector, TheWholeSceneMayMove) {
    CollisionSetup setup;
    const int count = 24;
    for (int i = 0; i < count; ++i) {
        setup.shapes.push_back(kinds(i)[static_cast<std::size_t>(i) % 8]);
        setup.fixed.push_back(false);
    }
    auto poses = heap_poses(count, 5);
    auto detector = make_collision_detector(setup);
    std::vector<ContactPoint> still, moved;
    detector->detect(poses, 0.01, still);
    const Quaterniond turned = turn(0.7, Vector3d(1.0, -2.0, 0.5));
    const Vector3d shift(3.0, -5.0, 2.0);
    for (Pose& at : poses) {
        const Quaterniond q(at.orientation[0], at.orientation[1], at.orientation[2], at.orientation[3]);
        at = pose(turned * vector(at.position) + shift, turned * q);
    }
    detector->detect(poses, 0.01, moved);
    ASSERT_EQ(still.size(), moved.size());
    ASSERT_GT(still.size(), 30U);
    for (std::size_t i = 0; i < still.size(); ++i) {
        EXPECT_NEAR(still[i].gap, moved[i].gap, 1e-12) << i;
        EXPECT_EQ(still[i].feature, moved[i].feature) << i;
    }
}

TEST(Detector, LeavesOutWhatCannotTouch) {
    const Shape ball = shape(ShapeKind::Sphere, {1.0, 0.0, 0.0}, 0);
    std::vector<Shape> shapes(5, ball);
    for (int i = 0; i < 5; ++i) shapes[static_cast<std::size_t>(i)].body = std::min(i, 3);
    shapes.push_back(shape(ShapeKind::Plane, {}, -1));
    // Bodies 0 and 1 are fixed; 2 and 3 are joined; body 3 has two shapes.
    auto detector = make_collision_detector({shapes, {true, true, false, false}, {{3, 2}, {2, -1}}});
    std::vector<ContactPoint> contacts;
    detector->detect(std::vector<Pose>(4, pose(Vector3d(0.0, 0.0, 0.5))), 0.1, contacts);
    std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
    for (const auto& contact : contacts) pairs.emplace_back(contact.shape_a, contact.shape_b);
    EXPECT_EQ(pairs, (std::vector<std::pair<std::int32_t, std::int32_t>>{
                         {0, 2}, {0, 3}, {0, 4}, {1, 2}, {1, 3}, {1, 4}, {3, 5}, {4, 5}}));
}

TEST(Detector, RespectsTheEnvelope) {
    const Shape ball = shape(ShapeKind::Sphere, {1.0, 0.0, 0.0}, 0);
    EXPECT_EQ(touch(ball, ball, pose(Vector3d::Zero()), pose(Vector3d(2.1, 0.0, 0.0)), 0.0999).size(), 0U);
    EXPECT_EQ(touch(ball, ball, pose(Vector3d::Zero()), pose(Vector3d(2.1, 0.0, 0.0)), 0.1001).size(), 1U);
}

TEST(Detector, APairIsNearByTheLesserOfItsShapes) {
    const Shape one = shape(ShapeKind::Sphere, {1.0, 0.0, 0.0}, 0),
                other = shape(ShapeKind::Sphere, {1.0, 0.0, 0.0}, 1);
    CollisionSetup setup{{one, other}, {false, false}, {}};
    setup.near = {0.3, 0.05};
    const auto detector = make_collision_detector(setup);
    std::vector<ContactPoint> contacts;
    for (const auto& [envelope, gap, found] :
         {std::tuple(0.2, 0.04, 1U), std::tuple(0.2, 0.06, 0U), std::tuple(0.02, 0.04, 0U)}) {
        detector->detect(std::vector<Pose>{pose(Vector3d::Zero()), pose(Vector3d(2.0 + gap, 0.0, 0.0))}, envelope,
                         contacts);
        EXPECT_EQ(contacts.size(), found) << envelope << " " << gap;
    }
}

TEST(Detector, ShapesSitWhereTheirPoseSays) {
    Shape ball = shape(ShapeKind::Sphere, {0.5, 0.0, 0.0}, 0), box = shape(ShapeKind::Box, {1.0, 0.2, 0.1}, 1);
    ball.pose = pose(Vector3d(0.0, 0.0, 2.0));
    box.pose = pose(Vector3d(0.0, 3.0, 0.0), turn(0.5 * std::acos(-1.0), Vector3d::UnitZ()));
    // The body's quarter turn about x brings the ball to y = −2; the box reaches from 3 − 1 to 3 + 1 along y, less 3.4.
    const auto contacts = touch(ball, box, pose(Vector3d::Zero(), turn(0.5 * std::acos(-1.0), Vector3d::UnitX())),
                                pose(Vector3d(0.0, -3.4, 0.0)), 1.0);
    ASSERT_EQ(contacts.size(), 1U);
    EXPECT_NEAR(contacts[0].gap, -1.4 - -2.0 - 0.5, 1e-12);
    EXPECT_NEAR(contacts[0].point_b[1], -1.4, 1e-12);
    EXPECT_NEAR(contacts[0].normal[1], 1.0, 1e-12);
}

TEST(Detector, BadCallsAreRefused) {
    auto detector = make_collision_detector({{shape(ShapeKind::Sphere, {1.0, 0.0, 0.0}, 0)}, {false}, {}});
    std::vector<ContactPoint> contacts;
    std::vector<Pose> poses(1);
    EXPECT_THROW(detector->detect(poses, -1.0, contacts), InputError);
    EXPECT_THROW(detector->detect({}, 0.1, contacts), InputError);
    for (const double absurd : {std::nan(""), 1e300}) {
        poses[0].position[1] = absurd;
        EXPECT_THROW(detector->detect(poses, 0.1, contacts), InputError);
    }
}

#endif

}  // namespace
}  // namespace delassus::collision_tests::detector_test
