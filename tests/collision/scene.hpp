// SPDX-License-Identifier: BSD-3-Clause
// Shapes, poses and an oracle of gaps for the tests of collision.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <numbers>
#include <random>

#include "delassus/collision.hpp"

namespace delassus::collision_tests {

using Eigen::Quaterniond;
using Eigen::Vector3d;

inline Vector3d vector(const Vector3& v) {
    return {v[0], v[1], v[2]};
}

inline Pose pose(const Vector3d& position, const Quaterniond& q = Quaterniond::Identity()) {
    return {{position.x(), position.y(), position.z()}, {q.w(), q.x(), q.y(), q.z()}};
}

inline Quaterniond turn(double angle, const Vector3d& axis) {
    return Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

inline Shape shape(ShapeKind kind, const Vector3& size, std::int32_t body, double margin = 0.0) {
    Shape result;
    result.kind = kind;
    result.size = size;
    result.body = body;
    result.margin = margin;
    return result;
}

/// The mesh of a box with halves (a, b, c), twelve triangles.
inline std::shared_ptr<const Mesh> box_mesh(double a, double b, double c) {
    auto mesh = std::make_shared<Mesh>();
    for (int i = 0; i < 8; ++i) mesh->vertices.push_back({(i & 1) ? a : -a, (i & 2) ? b : -b, (i & 4) ? c : -c});
    mesh->triangles = {{1, 3, 7}, {1, 7, 5}, {0, 4, 6}, {0, 6, 2}, {2, 6, 7}, {2, 7, 3},
                       {0, 1, 5}, {0, 5, 4}, {4, 5, 7}, {4, 7, 6}, {0, 2, 3}, {0, 3, 1}};
    return mesh;
}

inline std::shared_ptr<const Mesh> tetrahedron_mesh() {
    auto mesh = std::make_shared<Mesh>();
    mesh->vertices = {{0.5, 0.1, -0.3}, {-0.4, 0.45, -0.25}, {-0.3, -0.5, -0.35}, {0.05, 0.0, 0.6}};
    mesh->triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    return mesh;
}

/// Rings of this many vertices about z, at radii and heights; convex if these are.
inline std::shared_ptr<const Mesh> rings_mesh(const std::vector<std::array<double, 2>>& rings, std::int32_t sides) {
    auto mesh = std::make_shared<Mesh>();
    const auto last = static_cast<std::int32_t>(rings.size() - 1) * sides;
    for (const auto& [radius, height] : rings)
        for (std::int32_t i = 0; i < sides; ++i) {
            const double angle = 2.0 * std::numbers::pi * i / sides;
            mesh->vertices.push_back({radius * std::cos(angle), radius * std::sin(angle), height});
        }
    for (std::int32_t ring = 0; ring < last; ring += sides)
        for (std::int32_t i = 0; i < sides; ++i) {
            const std::int32_t next = (i + 1) % sides;
            mesh->triangles.push_back({ring + i, ring + next, ring + sides + next});
            mesh->triangles.push_back({ring + i, ring + sides + next, ring + sides + i});
        }
    for (std::int32_t i = 2; i < sides; ++i) {
        mesh->triangles.push_back({0, i, i - 1});
        mesh->triangles.push_back({last, last + i - 1, last + i});
    }
    return mesh;
}

/// With more vertices than are looked at one by one.
inline std::shared_ptr<const Mesh> pebble_mesh() {
    std::vector<std::array<double, 2>> rings;
    for (int k = 0; k < 7; ++k) {
        const double angle = std::numbers::pi * (k + 0.5) / 7;
        rings.push_back({0.4 * std::sin(angle), -0.25 * std::cos(angle)});
    }
    return rings_mesh(rings, 9);
}
inline std::shared_ptr<const Mesh> prism_mesh() {
    return rings_mesh({{0.3, -0.4}, {0.3, 0.4}}, 40);
}

inline Shape convex(std::shared_ptr<const Mesh> mesh, std::int32_t body, double margin = 0.0) {
    Shape result = shape(ShapeKind::Convex, {}, body, margin);
    result.mesh = std::move(mesh);
    return result;
}

/// One shape of each kind but the plane, on body.
inline std::vector<Shape> kinds(std::int32_t body) {
    return {shape(ShapeKind::Sphere, {0.4, 0.0, 0.0}, body),
            shape(ShapeKind::Box, {0.5, 0.3, 0.2}, body),
            shape(ShapeKind::Box, {0.3, 0.4, 0.5}, body, 0.05),
            shape(ShapeKind::Capsule, {0.2, 0.4, 0.0}, body),
            shape(ShapeKind::Cylinder, {0.3, 0.4, 0.0}, body),
            shape(ShapeKind::Cylinder, {0.5, 0.1, 0.0}, body, 0.03),
            convex(tetrahedron_mesh(), body),
            convex(box_mesh(0.2, 0.5, 0.3), body, 0.02),
            convex(pebble_mesh(), body),
            convex(prism_mesh(), body)};
}

/// Two bodies with one shape each.
inline std::vector<ContactPoint> touch(Shape a, Shape b, const Pose& pose_a, const Pose& pose_b, double envelope) {
    a.body = 0;
    b.body = 1;
    CollisionSetup setup{{a, b}, {a.kind == ShapeKind::Plane, b.kind == ShapeKind::Plane}, {}};
    auto detector = make_collision_detector(setup);
    const std::vector<Pose> poses{pose_a, pose_b};
    std::vector<ContactPoint> contacts;
    detector->detect(poses, envelope, contacts);
    return contacts;
}

inline double least_gap(const std::vector<ContactPoint>& contacts) {
    double least = HUGE_VAL;
    for (const auto& contact : contacts) least = std::min(least, contact.gap);
    return least;
}

/// Of the point with the least gap.
inline Vector3d nearest_normal(const std::vector<ContactPoint>& contacts) {
    return vector(std::min_element(contacts.begin(), contacts.end(), [](const auto& one, const auto& other) {
                      return one.gap < other.gap;
                  })->normal);
}

/// What every contact point promises.
inline void expect_consistent(const std::vector<ContactPoint>& contacts, double envelope) {
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        const ContactPoint& c = contacts[i];
        const Vector3d normal = vector(c.normal), across = vector(c.point_b) - vector(c.point_a);
        EXPECT_NEAR(normal.norm(), 1.0, 1e-12);
        EXPECT_NEAR(normal.dot(across), c.gap, 1e-11);
        EXPECT_LT(c.gap, envelope);
        EXPECT_LT(c.shape_a, c.shape_b);
        if (i > 0) {
            const ContactPoint& before = contacts[i - 1];
            EXPECT_LT(std::tuple(before.shape_a, before.shape_b, before.feature),
                      std::tuple(c.shape_a, c.shape_b, c.feature));
        }
    }
}

class Random {
public:
    explicit Random(unsigned seed) : engine_(seed) {}
    double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
    Vector3d direction() {
        std::normal_distribution<double> normal;
        return Vector3d(normal(engine_), normal(engine_), normal(engine_)).normalized();
    }
    Quaterniond rotation() { return turn((*this)(0.0, 3.0), direction()); }

private:
    std::mt19937 engine_;
};

}  // namespace delassus::collision_tests
