// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>

#include "collision/separation.hpp"

namespace delassus::collision {
namespace {

struct Simplex {
    std::array<Vector3d, 4> difference;  ///< b − a
    std::array<Vector3d, 4> on_a;
    std::array<double, 4> weight{};
    int count = 0;
};

/// Weights of the point of the hull of the chosen vertices' affine hull nearest to the origin; false if one is negative
/// or the vertices are degenerate.
bool weigh(const Simplex& simplex, const std::array<int, 4>& chosen, int count, std::array<double, 4>& weight) {
    const auto& w = simplex.difference;
    const Vector3d& p = w[chosen[0]];
    if (count == 1) {
        weight[0] = 1.0;
        return true;
    }
    const Vector3d u = w[chosen[1]] - p;
    if (count == 2) {
        const double square = u.squaredNorm();
        if (!(square > 0.0)) return false;
        weight[1] = -p.dot(u) / square;
        weight[0] = (p + u).dot(u) / square;
        return weight[0] >= 0.0 && weight[1] >= 0.0;
    }
    const Vector3d v = w[chosen[2]] - p;
    if (count == 3) {
        const Vector3d area = u.cross(v);
        const double square = area.squaredNorm();
        if (!(square > 1e-28 * u.squaredNorm() * v.squaredNorm())) return false;
        weight[1] = area.dot(v.cross(p)) / square;
        weight[2] = area.dot(p.cross(u)) / square;
        weight[0] = 1.0 - weight[1] - weight[2];
        return weight[0] >= 0.0 && weight[1] >= 0.0 && weight[2] >= 0.0;
    }
    const Vector3d z = w[chosen[3]] - p;
    const double volume = u.dot(v.cross(z));
    if (!(std::abs(volume) > 1e-14 * u.norm() * v.norm() * z.norm())) return false;
    weight[1] = -p.dot(v.cross(z)) / volume;
    weight[2] = -p.dot(z.cross(u)) / volume;
    weight[3] = -p.dot(u.cross(v)) / volume;
    weight[0] = 1.0 - weight[1] - weight[2] - weight[3];
    return weight[0] >= 0.0 && weight[1] >= 0.0 && weight[2] >= 0.0 && weight[3] >= 0.0;
}

/// The point of the simplex nearest to the origin: of all faces of it whose own nearest point lies inside them, the
/// nearest. Keeps only the vertices of that face.
Vector3d reduce(Simplex& simplex) {
    double best = std::numeric_limits<double>::infinity();
    std::array<int, 4> best_chosen{};
    std::array<double, 4> best_weight{};
    int best_count = 0;
    Vector3d nearest = Vector3d::Zero();
    for (int set = 1; set < (1 << simplex.count); ++set) {
        std::array<int, 4> chosen{};
        std::array<double, 4> weight{};
        int count = 0;
        for (int i = 0; i < simplex.count; ++i) {
            if ((set >> i & 1) != 0) chosen[count++] = i;
        }
        if (!weigh(simplex, chosen, count, weight)) continue;
        Vector3d point = Vector3d::Zero();
        for (int i = 0; i < count; ++i) point += weight[i] * simplex.difference[chosen[i]];
        const double square = count == 4 ? 0.0 : point.squaredNorm();
        if (square < best) {
            best = square;
            best_chosen = chosen;
            best_weight = weight;
            best_count = count;
            nearest = count == 4 ? Vector3d::Zero() : point;
        }
    }
    Simplex result;
    result.count = best_count;
    for (int i = 0; i < best_count; ++i) {
        result.difference[i] = simplex.difference[best_chosen[i]];
        result.on_a[i] = simplex.on_a[best_chosen[i]];
        result.weight[i] = best_weight[i];
    }
    simplex = result;
    return nearest;
}

}  // namespace

// v is the nearest point so far of the difference B − A to the origin. The support point of the difference against v
// gives the lower bound v·w/|v| of the distance, and v the upper; the search ends where they meet, or where rounding
// lets v shrink no more. For polytopes that is after finitely many steps.
std::optional<Separation> gjk(const Placed& a, const Placed& b, const Vector3d& offset, double limit) {
    const double scale = a.solid->reach + b.solid->reach;
    const double beyond = limit + 1e-12 * scale;
    Separation result;
    Simplex simplex;
    simplex.on_a[0] = a.support(offset);
    simplex.difference[0] = offset + b.support(-offset) - simplex.on_a[0];
    simplex.weight[0] = 1.0;
    simplex.count = 1;
    Vector3d v = simplex.difference[0];
    for (int iteration = 0; iteration < 200; ++iteration) {
        const double square = v.squaredNorm();
        if (square <= 1e-30 * scale * scale) return std::nullopt;
        const Vector3d on_a = a.support(v);
        const Vector3d w = offset + b.support(-v) - on_a;
        result.distance = v.dot(w) / std::sqrt(square);
        if (result.distance > beyond) return result;
        if (square - v.dot(w) <= 1e-15 * (square + scale * std::sqrt(square))) break;
        bool repeated = false;
        for (int i = 0; i < simplex.count; ++i) repeated = repeated || simplex.difference[i] == w;
        if (repeated) break;
        Simplex larger = simplex;
        larger.difference[larger.count] = w;
        larger.on_a[larger.count++] = on_a;
        const Vector3d nearest = reduce(larger);
        if (larger.count == 4) return std::nullopt;
        if (!(nearest.squaredNorm() < square)) break;
        simplex = larger;
        v = nearest;
    }
    result.distance = v.norm();
    result.normal = v / result.distance;
    for (int i = 0; i < simplex.count; ++i) result.point_a += simplex.weight[i] * simplex.on_a[i];
    result.point_b = result.point_a + v;
    return result;
}

}  // namespace delassus::collision
