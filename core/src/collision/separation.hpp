// SPDX-License-Identifier: BSD-3-Clause
// The signed distance of two cores A and B: the largest, over unit vectors n, of
//
//     s(n) = min_{b ∈ B} n·b − max_{a ∈ A} n·a
//
// It is their distance where they are apart, and minus the least translation that parts them where they are not. Every
// n gives a lower bound, so taking the best of several candidates is always safe.
#pragma once

#include <limits>
#include <optional>

#include "collision/solid.hpp"

namespace delassus::collision {

/// A normal within this angle (rad) of a face's counts as the face's. The distances of a manifold are measured along
/// the face's own normal and are exact for it; against another normal they differ by half of the square of the angle.
constexpr double kFlatAngle = 1e-3;

struct Separation {
    double distance = 0.0;               ///< s of the normal, m
    Vector3d normal = Vector3d::Zero();  ///< unit, from a to b
    Vector3d point_a = Vector3d::Zero();  ///< on the cores, relative to the position of a; normal · (b − a) = distance
    Vector3d point_b = Vector3d::Zero();
    std::uint32_t feature = 0;
};

/// Nearest points of two cores that are apart (Gilbert, Johnson, Keerthi); none where they touch or overlap.
/// offset: from the position of a to that of b. Where they are further apart than limit, a lower bound of their
/// distance that says so, and no points.
[[nodiscard]] std::optional<Separation> gjk(const Placed& a, const Placed& b, const Vector3d& offset,
                                            double limit = std::numeric_limits<double>::infinity());

/// Polytopes, exactly; none if further apart than limit. A cylinder counts as its prism.
[[nodiscard]] std::optional<Separation> polytope_separation(Placed& a, Placed& b, const Vector3d& offset, double limit);

/// Where one is a cylinder.
[[nodiscard]] std::optional<Separation> cylinder_separation(Placed& a, Placed& b, const Vector3d& offset, double limit);

/// Nearest points of the segments from p to p + u and from q to q + v; a segment may be a point.
void nearest_of_segments(const Vector3d& p, const Vector3d& u, const Vector3d& q, const Vector3d& v, Vector3d& on_p,
                         Vector3d& on_q);

}  // namespace delassus::collision
