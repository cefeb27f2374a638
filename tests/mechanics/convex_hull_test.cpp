// SPDX-License-Identifier: BSD-3-Clause
// Convex hulls against closed forms, and what has none.
#include "mechanics/convex_hull.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "support/module.hpp"

namespace delassus {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d vector(const Vector3& v) {
    return {v[0], v[1], v[2]};
}

/// Volume (m³) and second moments ∫ x xᵀ dV (m⁵) about the origin, from tetrahedra between the origin and the faces.
struct Moments {
    double volume = 0.0;
    Matrix3d second = Matrix3d::Zero();
};

Moments moments(const ConvexHull& hull) {
    Moments result;
    for (const auto& loop : hull.faces) {
        for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
            Matrix3d corners;
            corners << vector(hull.vertices[static_cast<std::size_t>(loop[0])]),
                vector(hull.vertices[static_cast<std::size_t>(loop[i])]),
                vector(hull.vertices[static_cast<std::size_t>(loop[i + 1])]);
            const double part = corners.determinant() / 6.0;
            const Vector3d sum = corners.rowwise().sum();
            result.volume += part;
            result.second += part / 20.0 * (corners * corners.transpose() + sum * sum.transpose());
        }
    }
    return result;
}

/// V − E + F = 2, each edge between two faces, and no point outside any face by more than `tolerance` (m).
void expect_hull(const ConvexHull& hull, const std::vector<Vector3>& points, double tolerance) {
    std::size_t ends = 0;
    for (const auto& loop : hull.faces) {
        ends += loop.size();
        Vector3d area = Vector3d::Zero();
        const Vector3d origin = vector(hull.vertices[static_cast<std::size_t>(loop[0])]);
        for (std::size_t i = 1; i + 1 < loop.size(); ++i)
            area += (vector(hull.vertices[static_cast<std::size_t>(loop[i])]) - origin)
                        .cross(vector(hull.vertices[static_cast<std::size_t>(loop[i + 1])]) - origin);
        ASSERT_GT(area.norm(), 0.0);
        for (const Vector3& point : points) ASSERT_LE(area.normalized().dot(vector(point) - origin), tolerance);
    }
    EXPECT_EQ(ends % 2, 0U);
    EXPECT_EQ(hull.vertices.size() + hull.faces.size(), ends / 2 + 2);
}

std::vector<Vector3> box(double x, double y, double z) {
    std::vector<Vector3> points;
    for (int i = 0; i < 8; ++i) points.push_back({(i & 1) != 0 ? x : -x, (i & 2) != 0 ? y : -y, (i & 4) != 0 ? z : -z});
    return points;
}

class ConvexHulls : public testing::Test {
protected:
    void SetUp() override {
        if (!has_module("delassus_convex_hull")) GTEST_SKIP() << "this build has no Qhull";
    }
};

TEST_F(ConvexHulls, BoxKeepsItsCornersInTheirOrder) {
    auto points = box(0.5, 1.0, 2.0);
    const auto corners = points;
    // Inside, in a face, in an edge, and a corner once more: none of them is a vertex.
    points.insert(points.begin() + 3, {{0.1, 0.2, 0.3}, {0.5, 0.2, 0.3}, {0.5, 1.0, 0.3}, corners[5]});
    const auto hull = convex_hull(points);
    EXPECT_EQ(hull.vertices.size(), 8U);
    EXPECT_EQ(hull.faces.size(), 6U);
    for (const auto& loop : hull.faces) EXPECT_EQ(loop.size(), 4U);
    expect_hull(hull, points, 1e-15);
    const auto found = moments(hull);
    EXPECT_NEAR(found.volume, 8.0, 1e-14);
    EXPECT_LT((found.second - Matrix3d(Vector3d(2.0 / 3.0, 8.0 / 3.0, 32.0 / 3.0).asDiagonal())).norm(), 1e-13);
    const auto alone = convex_hull(corners);
    EXPECT_EQ(alone.vertices, corners);
    EXPECT_EQ(alone.faces, (std::vector<std::vector<std::int32_t>>{
                               {0, 1, 5, 4}, {0, 2, 3, 1}, {0, 4, 6, 2}, {1, 3, 7, 5}, {2, 6, 7, 3}, {4, 5, 7, 6}}));
}

TEST_F(ConvexHulls, TetrahedronAndOctahedron) {
    const std::vector<Vector3> tetrahedron{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const auto first = moments(convex_hull(tetrahedron));
    EXPECT_NEAR(first.volume, 1.0 / 6.0, 1e-16);
    EXPECT_NEAR(first.second(0, 0), 1.0 / 60.0, 1e-16);
    EXPECT_NEAR(first.second(0, 1), 1.0 / 120.0, 1e-16);
    const std::vector<Vector3> octahedron{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    const auto second = moments(convex_hull(octahedron));
    EXPECT_NEAR(second.volume, 4.0 / 3.0, 1e-15);
    EXPECT_NEAR(second.second(2, 2), 2.0 / 15.0, 1e-15);
}

TEST_F(ConvexHulls, PrismHasTwoCapsWhereverItIs) {
    const int sides = 40;
    std::vector<Vector3> points;
    const Eigen::Quaterniond turn = Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized();
    for (int i = 0; i < sides; ++i)
        for (const double z : {-1.5, 1.5}) {
            const double angle = 2.0 * std::numbers::pi * i / sides;
            const Vector3d p = turn * Vector3d(std::cos(angle), std::sin(angle), z) + Vector3d(1e4, -3e4, 2e4);
            points.push_back({p.x(), p.y(), p.z()});
        }
    const auto hull = convex_hull(points);
    EXPECT_EQ(hull.vertices, points);
    EXPECT_EQ(hull.faces.size(), static_cast<std::size_t>(sides + 2));
    ConvexHull moved = hull;
    for (auto& vertex : moved.vertices)
        vertex = {vertex[0] - points[0][0], vertex[1] - points[0][1], vertex[2] - points[0][2]};
    EXPECT_NEAR(moments(moved).volume, 3.0 * 0.5 * sides * std::sin(2.0 * std::numbers::pi / sides), 1e-9);
}

TEST_F(ConvexHulls, ManyPointsOfASphereAreAllVertices) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    std::vector<Vector3> points;
    for (int i = 0; i < 2000; ++i) {
        const Vector3d p = 0.01 * Vector3d(normal(random), normal(random), normal(random)).normalized();
        points.push_back({p.x(), p.y(), p.z()});
    }
    const auto hull = convex_hull(points);
    EXPECT_EQ(hull.vertices, points);
    expect_hull(hull, points, 4e-9);  // twice what is merged
    const auto found = moments(hull);
    const double ball = 4.0 / 3.0 * std::numbers::pi * 1e-6;
    EXPECT_LT(found.volume, ball);
    EXPECT_GT(found.volume, 0.99 * ball);
    EXPECT_EQ(convex_hull(points).faces, hull.faces);
}

// As a file of single-precision numbers has them.
TEST_F(ConvexHulls, FacesThatRoundingBendsAreOne) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> along(-1.0, 1.0);
    const Eigen::Quaterniond turn = Eigen::Quaterniond(0.9, 0.1, 0.2, -0.4).normalized();
    std::vector<Vector3> points;
    const auto add = [&](const Vector3d& p) {
        const Eigen::Vector3f q = (turn * p).cast<float>();
        points.push_back({q.x(), q.y(), q.z()});
    };
    for (const auto& corner : box(1.0, 1.0, 1.0)) add(vector(corner));
    for (int i = 0; i < 200; ++i)
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
            Vector3d p(along(random), along(random), along(random));
            p[axis] = i % 2 == 0 ? 1.0 : -1.0;
            add(p);
        }
    const auto hull = convex_hull(points);
    EXPECT_EQ(hull.faces.size(), 6U);
    EXPECT_EQ(hull.vertices, std::vector<Vector3>(points.begin(), points.begin() + 8));
}

TEST_F(ConvexHulls, WithoutVolumeThereIsNone) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
    const std::vector<Vector3> three{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, same(7, {1, 2, 3}),
        line{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {5, 5, 5}},
        flat{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0.3, 0.4, 0}},
        tilted{{0, 0, 0}, {0.1, 0.7, 0.3}, {0.3, -0.2, 0.9}, {0.4, 0.5, 1.2}, {-0.2, 0.9, -0.6}},
        twice{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {1, 0, 0}};
    std::vector<Vector3> broken = box(1, 1, 1), unbounded = box(1, 1, 1);
    broken[3][1] = nan;
    unbounded[5][0] = infinite;
    for (const auto& points : {std::vector<Vector3>{}, three, same, line, flat, tilted, twice, broken, unbounded}) {
        const auto hull = convex_hull(points);
        EXPECT_TRUE(hull.vertices.empty() && hull.faces.empty()) << points.size();
    }
}

}  // namespace
}  // namespace delassus
