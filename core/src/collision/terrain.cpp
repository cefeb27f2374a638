// SPDX-License-Identifier: BSD-3-Clause
#include "collision/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace delassus::collision {
namespace {

// Triangles that turn against each other by less count as flat (rad): coordinates in single precision do no better.
constexpr double kFlat = 1e-5;
constexpr std::int32_t kLeafTriangles = 4;

/// An edge of a triangle, its corners in ascending order.
struct HalfEdge {
    std::int32_t low, high, triangle, place;
    bool operator<(const HalfEdge& other) const {
        return std::tie(low, high, triangle) < std::tie(other.low, other.high, other.triangle);
    }
};

/// t: into the second triangle, normal to their edge. Its height over the plane of the first tells ridge from valley;
/// where the surface folds back on itself, it tells nothing, and the fold is a ridge.
Terrain::EdgeKind kind_of(const Vector3d& normal_1, const Vector3d& normal_2, const Vector3d& t) {
    const double rise = normal_1.dot(t);
    if (rise > kFlat) return Terrain::EdgeKind::Concave;
    return rise < -kFlat || normal_1.dot(normal_2) < 0.0 ? Terrain::EdgeKind::Convex : Terrain::EdgeKind::Flat;
}

}  // namespace

Terrain::Terrain(const Mesh& mesh) {
    for (const auto& vertex : mesh.vertices) vertices_.emplace_back(vertex[0], vertex[1], vertex[2]);
    std::vector<AlignedBox3d> boxes;
    for (const auto& corners : mesh.triangles) {
        Triangle triangle;
        triangle.corners = corners;
        const Vector3d &a = vertices_[corners[0]], &b = vertices_[corners[1]], &c = vertices_[corners[2]];
        triangle.normal = (b - a).cross(c - a).normalized();
        for (std::size_t k = 0; k < 3; ++k)
            triangle.inward[k] =
                triangle.normal.cross(vertices_[corners[(k + 1) % 3]] - vertices_[corners[k]]).normalized();
        triangles_.push_back(triangle);
        AlignedBox3d box(a);
        boxes.push_back(box.extend(b).extend(c));
    }
    find_edges();
    order_.resize(triangles_.size());
    std::iota(order_.begin(), order_.end(), 0);
    nodes_.emplace_back();
    build(0, 0, static_cast<std::int32_t>(order_.size()), boxes);
}

void Terrain::find_edges() {
    std::vector<HalfEdge> halves;
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(triangles_.size()); ++t)
        for (std::int32_t k = 0; k < 3; ++k) {
            const auto& corners = triangles_[t].corners;
            const auto [low, high] = std::minmax(corners[k], corners[(k + 1) % 3]);
            halves.push_back({low, high, t, k});
        }
    std::sort(halves.begin(), halves.end());
    std::vector<std::array<std::int32_t, 3>> neighbours(triangles_.size(), {-1, -1, -1});  // over flat edges
    std::vector<std::array<std::int32_t, 2>> joined;
    for (std::size_t i = 0; i < halves.size();) {
        const HalfEdge& half = halves[i];
        Triangle& one = triangles_[half.triangle];
        joined.push_back({half.low, half.high});
        joined.push_back({half.high, half.low});
        const bool inner = i + 1 < halves.size() && halves[i + 1].low == half.low && halves[i + 1].high == half.high;
        SharpEdge edge;
        edge.tail = one.corners[half.place];
        edge.head = one.corners[(half.place + 1) % 3];
        edge.triangles[0] = half.triangle;
        edge.inward[0] = edge.inward[1] = one.inward[half.place];
        EdgeKind kind = EdgeKind::Rim;
        if (inner) {
            const HalfEdge& second = halves[i + 1];
            const Triangle& other = triangles_[second.triangle];
            edge.triangles[1] = second.triangle;
            edge.inward[1] = other.inward[second.place];
            kind = kind_of(one.normal, other.normal, edge.inward[1]);
            if (kind == EdgeKind::Flat) {
                neighbours[half.triangle][half.place] = second.triangle;
                neighbours[second.triangle][second.place] = half.triangle;
            }
        }
        const bool sharp = kind == EdgeKind::Rim || kind == EdgeKind::Convex;
        for (std::size_t j = i; j < i + (inner ? 2 : 1); ++j) {
            Triangle& own = triangles_[halves[j].triangle];
            own.kinds[halves[j].place] = kind;
            own.sharp_edge[halves[j].place] = sharp ? static_cast<std::int32_t>(sharp_edges_.size()) : -1;
        }
        if (sharp) sharp_edges_.push_back(edge);
        i += inner ? 2 : 1;
    }
    std::sort(joined.begin(), joined.end());
    first_neighbour_.assign(vertices_.size() + 1, 0);
    for (const auto& [from, to] : joined) {
        ++first_neighbour_[from + 1];
        neighbour_.push_back(to);
    }
    std::partial_sum(first_neighbour_.begin(), first_neighbour_.end(), first_neighbour_.begin());
    find_facets(neighbours);
}

void Terrain::find_facets(const std::vector<std::array<std::int32_t, 3>>& neighbours) {
    for (Triangle& triangle : triangles_) triangle.facet = -1;
    std::vector<std::int32_t> waiting;
    for (std::int32_t seed = 0; seed < static_cast<std::int32_t>(triangles_.size()); ++seed) {
        if (triangles_[seed].facet >= 0) continue;
        triangles_[seed].facet = seed;
        waiting.assign(1, seed);
        while (!waiting.empty()) {
            const std::int32_t at = waiting.back();
            waiting.pop_back();
            for (const std::int32_t next : neighbours[at]) {
                if (next < 0 || triangles_[next].facet >= 0) continue;
                // Against the seed: a surface that bends little by little is not flat.
                if (triangles_[next].normal.cross(triangles_[seed].normal).norm() > 2.0 * kFlat) continue;
                triangles_[next].facet = seed;
                waiting.push_back(next);
            }
        }
    }
}

// Halves by the median of the boxes' middles along the longest edge of the box that holds them.
void Terrain::build(std::int32_t node, std::int32_t first, std::int32_t count, const std::vector<AlignedBox3d>& boxes) {
    AlignedBox3d box, middles;
    for (std::int32_t i = first; i < first + count; ++i) {
        box.extend(boxes[order_[i]]);
        middles.extend(boxes[order_[i]].center());
    }
    nodes_[node].box = box;
    if (count <= kLeafTriangles) {
        nodes_[node].first = first;
        nodes_[node].count = count;
        return;
    }
    Eigen::Index axis = 0;
    middles.sizes().maxCoeff(&axis);
    const std::int32_t half = count / 2;
    std::nth_element(order_.begin() + first, order_.begin() + first + half, order_.begin() + first + count,
                     [&](std::int32_t a, std::int32_t b) {
                         const double at_a = boxes[a].center()[axis], at_b = boxes[b].center()[axis];
                         return at_a < at_b || (at_a == at_b && a < b);
                     });
    const auto children = static_cast<std::int32_t>(nodes_.size());
    nodes_[node].first = children;
    nodes_.resize(nodes_.size() + 2);
    build(children, first, half, boxes);
    build(children + 1, first + half, count - half, boxes);
}

void Terrain::near(const AlignedBox3d& box, std::vector<std::int32_t>& triangles) const {
    triangles.clear();
    std::array<std::int32_t, 64> waiting;  // halves of halves: their depth is the logarithm of 2³¹ triangles
    std::size_t count = 0;
    waiting[count++] = 0;
    while (count > 0) {
        const Node& node = nodes_[waiting[--count]];
        if (!node.box.intersects(box)) continue;
        if (node.count == 0) {
            waiting[count++] = node.first;
            waiting[count++] = node.first + 1;
            continue;
        }
        for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
            const auto& corners = triangles_[order_[i]].corners;
            const Vector3d &a = vertices_[corners[0]], &b = vertices_[corners[1]], &c = vertices_[corners[2]];
            if ((a.cwiseMax(b).cwiseMax(c).array() >= box.min().array()).all() &&
                (a.cwiseMin(b).cwiseMin(c).array() <= box.max().array()).all())
                triangles.push_back(order_[i]);
        }
    }
    std::sort(triangles.begin(), triangles.end());
}

bool Terrain::is_top(std::int32_t vertex, const Vector3d& direction, double angle) const {
    for (std::int32_t i = first_neighbour_[vertex]; i < first_neighbour_[vertex + 1]; ++i) {
        const Vector3d edge = vertices_[neighbour_[i]] - vertices_[vertex];
        if (direction.dot(edge) > angle * edge.norm()) return false;
    }
    return true;
}

// By the regions about a triangle (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
Vector3d Terrain::nearest(const Triangle& triangle, const Vector3d& point) const {
    const Vector3d &a = vertices_[triangle.corners[0]], &b = vertices_[triangle.corners[1]],
                   &c = vertices_[triangle.corners[2]];
    const Vector3d ab = b - a, ac = c - a, ap = point - a;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0.0 && d2 <= 0.0) return a;
    const Vector3d bp = point - b;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0.0 && d4 <= d3) return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + d1 / (d1 - d3) * ab;
    const Vector3d cp = point - c;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0.0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + d2 / (d2 - d6) * ac;
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b);
    const double sum = va + vb + vc;
    return a + vb / sum * ab + vc / sum * ac;
}

}  // namespace delassus::collision
