// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/separation.hpp"
#include "mechanics/contact_feature.hpp"

namespace delassus::collision {
namespace {

/// The vertex of a core that is least along a direction.
std::size_t least_vertex(const Placed& placed, const Vector3d& direction) {
    return placed.solid->core.furthest(placed.vertices, -direction);
}

// Nearest points p_a and p_b at the distance d along n, where they are known, bound every other direction:
//
//     s(m) ≤ m·(p_b − p_a) = d m·n
//
// So only what is turned by little from n may part as much, and an edge of which that is a normal is nearly normal to
// n. Where they are not known, every direction is admitted.
class NearestBound {
public:
    NearestBound() = default;
    /// least: what has to be parted.
    NearestBound(const Separation& nearest, double least)
        : normal_(nearest.normal),
          cosine_(least / nearest.distance),
          sine_(std::sqrt(std::max(0.0, 1.0 - cosine_ * cosine_))) {}
    [[nodiscard]] bool admits_normal(const Vector3d& m) const { return m.dot(normal_) > cosine_; }
    [[nodiscard]] bool admits_edge(const Vector3d& direction) const {
        return std::abs(direction.dot(normal_)) <= sine_;
    }

private:
    Vector3d normal_ = Vector3d::Zero();
    double cosine_ = -1.0, sine_ = 1.0;
};

// The best face of first against second; sign −1 if first is b. Each vertex v of second bounds the distance that a face
// finds from above, n·v − offset: with the vertex of the best face so far, few faces of a large polytope have to look
// for their nearest vertex. The face that this bound promises most is looked at before the others, for what it is
// worth.
void face_axes(const Placed& first, const Placed& second, const Vector3d& to_second, double sign, double preference,
               const NearestBound& nearest, Separation& best) {
    if (first.normals.empty()) return;
    const auto& faces = first.solid->core.faces;
    std::size_t witness = least_vertex(second, to_second);
    const auto distance_of = [&](std::size_t f, std::size_t vertex) {
        const Vector3d& normal = first.normals[f];
        return normal.dot(second.vertices[vertex]) + normal.dot(to_second) - faces[f].offset;
    };
    const auto bound = [&](std::size_t f) { return distance_of(f, witness); };
    std::size_t promising = 0;
    double most = bound(promising);
    for (std::size_t f = 1; f < faces.size(); ++f) {
        const double promised = bound(f);
        if (promised <= most) continue;
        most = promised;
        promising = f;
    }
    witness = least_vertex(second, first.normals[promising]);
    const double reached = bound(promising) - 3.0 * preference;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const Vector3d& normal = first.normals[f];
        if (!nearest.admits_normal(sign * normal)) continue;
        if (bound(f) <= std::max(best.distance + preference, reached)) continue;
        const std::size_t least = least_vertex(second, normal);
        const double distance = distance_of(f, least);
        if (distance <= best.distance + preference) continue;
        witness = least;
        best.distance = distance;
        best.normal = sign * normal;
        const Vector3d vertex = second.vertices[least];
        if (sign > 0.0) {
            best.point_b = to_second + vertex;
            best.point_a = best.point_b - distance * normal;
            best.feature = feature_id(FeatureKind::VertexOfB, least, 0);
        } else {
            best.point_a = vertex;
            best.point_b = vertex - to_second - distance * normal;
            best.point_b += to_second;
            best.feature = feature_id(FeatureKind::VertexOfA, least, 0);
        }
    }
}

// Two edges make a face of the difference of the polytopes where their arcs on the sphere of normals cross: the arc of
// an edge of A joins the normals of its faces, that of B the opposite normals. A segment's arc is the full circle.
bool arcs_cross(const Placed& a, const Polytope::Edge& edge_a, const Vector3d& direction_a, const Placed& b,
                const Polytope::Edge& edge_b, const Vector3d& direction_b) {
    double m1 = 0.0, m2 = 0.0, n1 = 0.0, n2 = 0.0;
    if (edge_b.left >= 0) {
        m1 = b.normals[edge_b.left].dot(direction_a);
        m2 = b.normals[edge_b.right].dot(direction_a);
        if (m1 * m2 >= 0.0) return false;
    }
    if (edge_a.left >= 0) {
        n1 = -a.normals[edge_a.left].dot(direction_b);
        n2 = -a.normals[edge_a.right].dot(direction_b);
        if (n1 * n2 >= 0.0) return false;
    }
    return edge_a.left < 0 || edge_b.left < 0 || m1 * n2 > 0.0;
}

// With a normal n on the arc of an edge, between the normals l and r of its faces, two polytopes are at most n·x apart,
// x leading from the edge to any point of the other polytope. Of all n on the arc that is at most the length of x
// across the edge where x points between l and r, and else the larger of l·x and r·x.
bool may_exceed(const Placed& placed, std::size_t edge, const Vector3d& x, double distance) {
    const auto& [tail, head, left, right, direction] = placed.solid->core.edges[edge];
    if (left < 0) return true;
    const Vector3d &l = placed.normals[left], &r = placed.normals[right];
    const double along_l = l.dot(x), along_r = r.dot(x);
    if (std::max(along_l, along_r) > distance) return true;
    if (distance <= 0.0) return false;  // a sum of l and r with positive shares is at most as long as their sum
    const double cosine = l.dot(r);
    if (along_r <= cosine * along_l || along_l <= cosine * along_r) return false;
    const double along = placed.directions[edge].dot(x);
    return x.squaredNorm() - along * along > distance * distance;
}

// Most pairs of edges are left out by the bound of one of the two, with the vertices as points that are nearest along
// the best face.
void edge_axes(const Placed& a, const Placed& b, const Vector3d& offset, double preference, const NearestBound& nearest,
               Separation& best) {
    const Polytope& core_a = a.solid->core;
    const Polytope& core_b = b.solid->core;
    const bool known = best.distance > -std::numeric_limits<double>::infinity();
    const Vector3d direction = known ? best.normal : offset;
    const Vector3d nearest_of_a = a.vertices[least_vertex(a, -direction)];
    const Vector3d nearest_of_b = offset + b.vertices[least_vertex(b, direction)];
    thread_local std::vector<std::size_t> edges_of_b;
    edges_of_b.clear();
    for (std::size_t j = 0; j < core_b.edges.size(); ++j)
        if (nearest.admits_edge(b.directions[j]) &&
            may_exceed(b, j, nearest_of_a - offset - b.vertices[core_b.edges[j].tail], best.distance))
            edges_of_b.push_back(j);
    for (std::size_t i = 0; i < core_a.edges.size(); ++i) {
        const Polytope::Edge& edge_a = core_a.edges[i];
        if (!nearest.admits_edge(a.directions[i])) continue;
        if (!may_exceed(a, i, nearest_of_b - a.vertices[edge_a.tail], best.distance)) continue;
        for (const std::size_t j : edges_of_b) {
            const Polytope::Edge& edge_b = core_b.edges[j];
            if (!arcs_cross(a, edge_a, a.directions[i], b, edge_b, b.directions[j])) continue;
            Vector3d normal = a.directions[i].cross(b.directions[j]);
            const double sine = normal.norm();
            if (sine < 1e-8) continue;
            normal /= sine;
            const Vector3d between = offset + b.vertices[edge_b.tail] - a.vertices[edge_a.tail];
            double side = normal.dot(between);
            if (edge_a.left >= 0) {
                side = normal.dot(a.normals[edge_a.left] + a.normals[edge_a.right]);
            } else if (edge_b.left >= 0) {
                side = -normal.dot(b.normals[edge_b.left] + b.normals[edge_b.right]);
            }
            if (side < 0.0) normal = -normal;
            const double distance = normal.dot(between);
            if (distance <= best.distance + preference) continue;
            best.distance = distance;
            best.normal = normal;
            nearest_of_segments(a.vertices[edge_a.tail], a.vertices[edge_a.head] - a.vertices[edge_a.tail],
                                offset + b.vertices[edge_b.tail], b.vertices[edge_b.head] - b.vertices[edge_b.tail],
                                best.point_a, best.point_b);
            best.feature = feature_id(FeatureKind::Edges, i, j);
        }
    }
}

}  // namespace

// The faces of the difference B − A are those of A, those of B, and the pairs of edges whose arcs cross. In penetration
// the best of them is the answer. Apart, it is the answer unless the nearest features are vertices, or a vertex and an
// edge; then it is less than the distance, which GJK finds. For large polytopes that is found first: most of their
// pairs are further apart than limit, and of the others only what reaches the distance is looked for.
std::optional<Separation> polytope_separation(Placed& a, Placed& b, const Vector3d& offset, double limit) {
    // Equal up to rounding, faces go before edges and those of a before those of b.
    const double rounding = 1e-14 * (a.solid->reach + b.solid->reach), equal = 10.0 * rounding;
    const bool large = a.solid->core.is_large() || b.solid->core.is_large();
    // What a normal parts is less than the distance of the points where rounding ended the search, which for gaps near
    // rounding leaves a direction that is wrong.
    const auto parted_by = [&](const Vector3d& n) { return n.dot(offset + b.support(-n) - a.support(n)); };
    Separation best;
    best.distance = -std::numeric_limits<double>::infinity();
    std::optional<Separation> apart;
    NearestBound nearest;
    if (large) {
        for (Placed* const one : {&a, &b})
            if (!one->solid->core.is_large()) one->rotate_core();
        apart = gjk(a, b, offset, limit);
        if (apart && apart->distance > limit) return std::nullopt;
        if (apart) {
            apart->feature = feature_id(FeatureKind::Nearest, 0, 0);
            best = *apart;
            best.distance = parted_by(apart->normal) - equal - rounding;
            nearest = NearestBound(*apart, best.distance);
        }
    }
    a.rotate_core();
    b.rotate_core();
    face_axes(a, b, offset, 1.0, rounding, nearest, best);
    if (best.distance > limit) return std::nullopt;
    face_axes(b, a, -offset, -1.0, rounding, nearest, best);
    if (best.distance > limit) return std::nullopt;
    edge_axes(a, b, offset, rounding, nearest, best);
    if (best.distance > limit) return std::nullopt;
    if (best.distance <= 0.0 && !(a.normals.empty() && b.normals.empty())) return best;
    if (!large) apart = gjk(a, b, offset);
    if (!apart || apart->distance <= best.distance + equal || parted_by(apart->normal) <= best.distance + equal)
        return best;
    if (apart->distance > limit) return std::nullopt;
    apart->feature = feature_id(FeatureKind::Nearest, 0, 0);
    return apart;
}

}  // namespace delassus::collision
