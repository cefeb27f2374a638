// SPDX-License-Identifier: BSD-3-Clause
// The signed distance by brute force over the support functions, knowing nothing of features.
#pragma once

#include <algorithm>
#include <numbers>

#include "collision/scene.hpp"

namespace delassus::collision_tests {

/// max of n · x over a shape in its own frame, for margins that leave the support function of a shrunk hull simple:
/// boxes, cylinders, and meshes of boxes.
inline double support(const Shape& s, const Vector3d& n) {
    const double m = s.margin, across = std::hypot(n.x(), n.y());
    switch (s.kind) {
        case ShapeKind::Sphere:
            return s.size[0];
        case ShapeKind::Box:
            return m + (vector(s.size).array() - m).matrix().dot(n.cwiseAbs());
        case ShapeKind::Capsule:
            return s.size[0] + s.size[1] * std::abs(n.z());
        case ShapeKind::Cylinder:
            return m + (s.size[0] - m) * across + (s.size[1] - m) * std::abs(n.z());
        default: {
            double most = -HUGE_VAL;
            for (const auto& vertex : s.mesh->vertices) {
                const Vector3d v = vector(vertex);
                most = std::max(most, n.dot(v - m * v.cwiseSign()));
            }
            return most + m;
        }
    }
}

/// s(n) = min n · b − max n · a, of which the signed distance is the largest value over unit vectors.
inline double separation(const Shape& a, const Shape& b, const Pose& pose_a, const Pose& pose_b, const Vector3d& n) {
    const auto q = [](const Pose& p) {
        return Quaterniond(p.orientation[0], p.orientation[1], p.orientation[2], p.orientation[3]);
    };
    const Vector3d offset = vector(pose_b.position) - vector(pose_a.position);
    return n.dot(offset) - support(a, q(pose_a).conjugate() * n) - support(b, q(pose_b).conjugate() * -n);
}

/// A lower bound of the signed distance, tight but for where the search ends on a ridge, about 1e-5.
inline double signed_distance(const Shape& a, const Shape& b, const Pose& pose_a, const Pose& pose_b) {
    const auto s = [&](const Vector3d& n) { return separation(a, b, pose_a, pose_b, n); };
    // A Fibonacci lattice, then a search around its best few points with ever smaller circles.
    constexpr int kPoints = 1500;
    std::vector<std::pair<double, Vector3d>> samples;
    for (int i = 0; i < kPoints; ++i) {
        const double z = 1.0 - (2.0 * i + 1.0) / kPoints, r = std::sqrt(1.0 - z * z);
        const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
        const Vector3d n(r * std::cos(angle), r * std::sin(angle), z);
        samples.emplace_back(s(n), n);
    }
    std::partial_sort(samples.begin(), samples.begin() + 8, samples.end(),
                      [](const auto& x, const auto& y) { return x.first > y.first; });
    double best = -HUGE_VAL;
    for (int k = 0; k < 8; ++k) {
        auto [value, n] = samples[k];
        for (double radius = 0.05; radius > 1e-9;) {
            const Vector3d u = n.unitOrthogonal(), v = n.cross(u);
            bool better = false;
            for (int i = 0; i < 24; ++i) {
                const double angle = 2.0 * std::numbers::pi * i / 24;
                const Vector3d trial = (n + radius * (std::cos(angle) * u + std::sin(angle) * v)).normalized();
                if (const double at = s(trial); at > value + 1e-11) {
                    value = at;
                    n = trial;
                    better = true;
                }
            }
            if (!better) radius *= 0.5;
        }
        best = std::max(best, value);
    }
    return best;
}

}  // namespace delassus::collision_tests
