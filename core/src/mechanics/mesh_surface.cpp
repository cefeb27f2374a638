// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/mesh_surface.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace delassus::mechanics {
namespace {

constexpr std::int32_t leaf_triangles = 4;
const double sharp_sine = std::sin(20.0 * M_PI / 180.0);
constexpr double flat_sine = 1e-7;  // the gap that such an edge leaves between its triangles is rounding

/// The barycentric coordinates, in a quadratic side, of its corners and middles.
const std::array<Vector3d, 6> side_places = {Vector3d(1, 0, 0),       Vector3d(0, 1, 0),       Vector3d(0, 0, 1),
                                             Vector3d(0.5, 0.5, 0.0), Vector3d(0.0, 0.5, 0.5), Vector3d(0.5, 0.0, 0.5)};
/// The corners of its parts among these.
constexpr std::array<std::array<std::size_t, 3>, 4> side_parts = {{{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}};

std::array<std::int32_t, 6> nodes_of(const ElementSide& side) {
    return {side.corners[0], side.corners[1], side.corners[2], side.middles[0], side.middles[1], side.middles[2]};
}

}  // namespace

MeshSurface::MeshSurface(std::span<const ElementSide> sides, const std::vector<Vector3d>& position)
    : sides_(sides.begin(), sides.end()) {
    for (const ElementSide& side : sides_) side.for_each_node([&](std::int32_t node) { nodes_.push_back(node); });
    std::sort(nodes_.begin(), nodes_.end());
    nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
    const auto vertex_of = [&](std::int32_t node) {
        return static_cast<std::int32_t>(std::lower_bound(nodes_.begin(), nodes_.end(), node) - nodes_.begin());
    };
    for (std::size_t s = 0; s < sides_.size(); ++s) {
        const auto nodes = nodes_of(sides_[s]);
        const bool quadratic = sides_[s].middles[0] >= 0;
        for (std::size_t part = 0; part < (quadratic ? 4U : 1U); ++part) {
            Triangle& triangle = triangles_.emplace_back();
            triangle.side = static_cast<std::int32_t>(s);
            triangle.part = static_cast<std::int32_t>(part);
            for (std::size_t k = 0; k < 3; ++k)
                triangle.corners[k] = vertex_of(nodes[quadratic ? side_parts[part][k] : k]);
        }
    }
    x_ = position;
    find_edges();
    find_patches();
    std::vector<Vector3d> middles;
    for (const Triangle& triangle : triangles_)
        middles.emplace_back((at(triangle.corners[0]) + at(triangle.corners[1]) + at(triangle.corners[2])) / 3.0);
    order_.resize(triangles_.size());
    std::iota(order_.begin(), order_.end(), 0);
    tree_.emplace_back();
    build(0, 0, static_cast<std::int32_t>(order_.size()), middles);
    normals_.resize(nodes_.size());
}

void MeshSurface::find_edges() {
    struct HalfEdge {
        std::int32_t low, high, triangle, place;
    };
    std::vector<HalfEdge> halves;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
        triangles_[t].normal = normal_at(triangles_[t], 0.0);
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax(triangles_[t].corners[k], triangles_[t].corners[(k + 1) % 3]);
            halves.push_back({low, high, static_cast<std::int32_t>(t), static_cast<std::int32_t>(k)});
        }
    }
    std::sort(halves.begin(), halves.end(), [](const HalfEdge& a, const HalfEdge& b) {
        return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    const auto same = [](const HalfEdge& a, const HalfEdge& b) { return a.low == b.low && a.high == b.high; };
    sharp_vertex_.assign(nodes_.size(), 0);
    std::vector<std::array<std::int32_t, 2>> joined;
    for (std::size_t i = 0; i < halves.size();) {
        const bool pair = i + 1 < halves.size() && same(halves[i], halves[i + 1]);
        const auto number = static_cast<std::int32_t>(edges_.size());
        Edge& edge = edges_.emplace_back();
        const Triangle& one = triangles_[to_index(halves[i].triangle)];
        edge.tail = one.corners[to_index(halves[i].place)];
        edge.head = one.corners[(to_index(halves[i].place) + 1) % 3];
        for (std::size_t j = 0; j < (pair ? 2U : 1U); ++j) {
            edge.triangles[j] = halves[i + j].triangle;
            triangles_[to_index(halves[i + j].triangle)].edges[to_index(halves[i + j].place)] = number;
        }
        edge.inner = pair && one.side == triangles_[to_index(edge.triangles[1])].side;
        edge.sharp = !pair ||
                     one.normal.dot(inward(triangles_[to_index(edge.triangles[1])], edge, 0.0)) < -sharp_sine ||
                     one.normal.dot(triangles_[to_index(edge.triangles[1])].normal) < -0.5;
        if (edge.sharp) {
            sharp_edges_.push_back(number);
            sharp_vertex_[to_index(edge.tail)] = sharp_vertex_[to_index(edge.head)] = 1;
        }
        edge_length_ += (at(edge.head) - at(edge.tail)).norm();
        joined.push_back({edge.tail, edge.head});
        joined.push_back({edge.head, edge.tail});
        i += pair ? 2 : 1;
    }
    edge_length_ /= static_cast<double>(std::max<std::size_t>(1, edges_.size()));
    std::sort(joined.begin(), joined.end());
    first_neighbour_.assign(nodes_.size() + 1, 0);
    for (const auto& [from, to] : joined) {
        ++first_neighbour_[to_index(from) + 1];
        neighbour_.push_back(to);
    }
    std::partial_sum(first_neighbour_.begin(), first_neighbour_.end(), first_neighbour_.begin());
}

void MeshSurface::find_patches() {
    for (Triangle& triangle : triangles_) triangle.patch = -1;
    std::int32_t patches = 0;
    std::vector<std::int32_t> waiting;
    for (std::size_t seed = 0; seed < triangles_.size(); ++seed) {
        if (triangles_[seed].patch >= 0) continue;
        triangles_[seed].patch = patches;
        waiting.assign(1, static_cast<std::int32_t>(seed));
        while (!waiting.empty()) {
            const std::int32_t from = waiting.back();
            waiting.pop_back();
            for (const std::int32_t number : triangles_[to_index(from)].edges) {
                const Edge& edge = edges_[to_index(number)];
                if (edge.sharp) continue;
                const std::int32_t next = edge.triangles[edge.triangles[0] == from ? 1 : 0];
                if (triangles_[to_index(next)].patch >= 0 ||
                    triangles_[to_index(next)].normal.cross(triangles_[to_index(from)].normal).norm() > sharp_sine)
                    continue;
                triangles_[to_index(next)].patch = patches;
                waiting.push_back(next);
            }
        }
        ++patches;
    }
}

// Halves by the median of the triangles' middles along the longest edge of the box that holds them. The tree stays as
// it is when the mesh deforms: elements bound how far neighbours part.
void MeshSurface::build(std::int32_t node, std::int32_t first, std::int32_t count,
                        const std::vector<Vector3d>& middles) {
    if (count <= leaf_triangles) {
        tree_[to_index(node)].first = first;
        tree_[to_index(node)].count = count;
        return;
    }
    Box3d box;
    for (std::int32_t i = first; i < first + count; ++i) box.extend(middles[to_index(order_[to_index(i)])]);
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::int32_t half = count / 2;
    std::nth_element(order_.begin() + first, order_.begin() + first + half, order_.begin() + first + count,
                     [&](std::int32_t a, std::int32_t b) {
                         const double at_a = middles[to_index(a)][axis], at_b = middles[to_index(b)][axis];
                         return at_a < at_b || (at_a == at_b && a < b);
                     });
    const auto children = static_cast<std::int32_t>(tree_.size());
    tree_[to_index(node)].first = children;
    tree_.resize(tree_.size() + 2);
    build(children, first, half, middles);
    build(children + 1, first + half, count - half, middles);
}

void MeshSurface::place(std::span<const Vector3d> x, std::span<const Vector3d> way) {
    x_ = x;
    way_ = way;
    box_.setEmpty();
    longest_way_ = 0.0;
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(nodes_.size()); ++v) {
        box_.extend(at(v));
        if (way_.empty()) continue;
        box_.extend(at(v, 1.0));
        longest_way_ = std::max(longest_way_, this->way(v).norm());
    }
}

void MeshSurface::find_normals() {
    std::fill(normals_.begin(), normals_.end(), Vector3d::Zero());
    for (Triangle& triangle : triangles_) {
        const Vector3d a = at(triangle.corners[0]);
        const Vector3d twice_area = (at(triangle.corners[1]) - a).cross(at(triangle.corners[2]) - a);
        triangle.normal = twice_area.normalized();
        for (const auto corner : triangle.corners) normals_[to_index(corner)] += twice_area;
    }
    for (Vector3d& normal : normals_) normal.normalize();
    convex_vertex_.assign(nodes_.size(), 0);
    for (Edge& edge : edges_) {
        edge.convex = edge.triangles[1] < 0;
        if (!edge.convex) {
            const Triangle &one = triangles_[to_index(edge.triangles[0])],
                           &other = triangles_[to_index(edge.triangles[1])];
            edge.convex = one.normal.dot(inward(other, edge, 0.0)) < -flat_sine || one.normal.dot(other.normal) < 0.0;
        }
        if (edge.convex) convex_vertex_[to_index(edge.tail)] = convex_vertex_[to_index(edge.head)] = 1;
    }
    // Children come after their parents.
    for (auto node = tree_.rbegin(); node != tree_.rend(); ++node) {
        node->box.setEmpty();
        if (node->count == 0) {
            node->box.extend(tree_[to_index(node->first)].box);
            node->box.extend(tree_[to_index(node->first) + 1].box);
            continue;
        }
        for (std::int32_t i = node->first; i < node->first + node->count; ++i)
            for (const auto corner : triangles_[to_index(order_[to_index(i)])].corners) {
                node->box.extend(at(corner));
                if (!way_.empty()) node->box.extend(at(corner, 1.0));
            }
    }
}

Vector3d MeshSurface::normal_at(const Triangle& triangle, double share) const {
    const Vector3d a = at(triangle.corners[0], share);
    return (at(triangle.corners[1], share) - a).cross(at(triangle.corners[2], share) - a).normalized();
}

Vector3d MeshSurface::inward(const Triangle& triangle, const Edge& edge, double share) const {
    const Vector3d along = (at(edge.head, share) - at(edge.tail, share)).normalized();
    Vector3d third = Vector3d::Zero();
    for (const auto corner : triangle.corners)
        if (corner != edge.tail && corner != edge.head) third = at(corner, share) - at(edge.tail, share);
    return (third - third.dot(along) * along).normalized();
}

bool MeshSurface::is_top(std::int32_t vertex, const Vector3d& direction, double angle, double share) const {
    const Vector3d here = at(vertex, share);
    for (std::int32_t i = first_neighbour_[to_index(vertex)]; i < first_neighbour_[to_index(vertex) + 1]; ++i) {
        const Vector3d edge = at(neighbour_[to_index(i)], share) - here;
        if (direction.dot(edge) > angle * edge.norm()) return false;
    }
    return true;
}

void MeshSurface::near(const Box3d& box, std::vector<std::int32_t>& triangles) const {
    triangles.clear();
    std::array<std::int32_t, 64> waiting;  // halves of halves: their depth is the logarithm of 2³¹ triangles
    std::size_t count = 0;
    waiting[count++] = 0;
    while (count > 0) {
        const TreeNode& node = tree_[to_index(waiting[--count])];
        if (!node.box.intersects(box)) continue;
        if (node.count == 0) {
            waiting[count++] = node.first;
            waiting[count++] = node.first + 1;
            continue;
        }
        for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
            Box3d own;
            for (const auto corner : triangles_[to_index(order_[to_index(i)])].corners) {
                own.extend(at(corner));
                if (!way_.empty()) own.extend(at(corner, 1.0));
            }
            if (own.intersects(box)) triangles.push_back(order_[to_index(i)]);
        }
    }
    std::sort(triangles.begin(), triangles.end());
}

CarriedPoint MeshSurface::vertex_point(std::int32_t vertex) const {
    CarriedPoint point;
    point.nodes[0] = nodes_[to_index(vertex)];
    point.weights[0] = 1.0;
    point.count = 1;
    return point;
}

Vector3d MeshSurface::side_coordinates(const Triangle& triangle, const Vector3d& coordinates) const {
    const auto& corners = side_parts[to_index(triangle.part)];
    return coordinates[0] * side_places[corners[0]] + coordinates[1] * side_places[corners[1]] +
           coordinates[2] * side_places[corners[2]];
}

// N = l (2 l − 1) at the corners and 4 l l' in the middles of the edges.
CarriedPoint MeshSurface::quadratic_point(const ElementSide& side, const Vector3d& l) const {
    CarriedPoint point;
    point.nodes = nodes_of(side);
    point.count = 6;
    for (std::size_t k = 0; k < 3; ++k) {
        const auto i = static_cast<Eigen::Index>(k), j = static_cast<Eigen::Index>((k + 1) % 3);
        point.weights[k] = l[i] * (2.0 * l[i] - 1.0);
        point.weights[3 + k] = 4.0 * l[i] * l[j];
    }
    return point;
}

CarriedPoint MeshSurface::point_of(const Triangle& triangle, const Vector3d& coordinates) const {
    const ElementSide& side = sides_[to_index(triangle.side)];
    if (side.middles[0] >= 0) return quadratic_point(side, side_coordinates(triangle, coordinates));
    CarriedPoint point;
    point.count = 3;
    for (std::size_t k = 0; k < 3; ++k) {
        point.nodes[k] = side.corners[k];
        point.weights[k] = coordinates[static_cast<Eigen::Index>(k)];
    }
    return point;
}

// With l = (1 − ξ − η, ξ, η), Gauss and Newton's step for min |p − x(ξ, η)|²: JᵀJ Δ = Jᵀ (p − x), J = (∂x/∂ξ, ∂x/∂η).
CarriedPoint MeshSurface::project(const Triangle& triangle, const Vector3d& coordinates, const Vector3d& p,
                                  double share, Vector3d& normal) const {
    const ElementSide& side = sides_[to_index(triangle.side)];
    if (side.middles[0] < 0) return point_of(triangle, coordinates);
    const auto nodes = nodes_of(side);
    std::array<Vector3d, 6> x;
    for (std::size_t k = 0; k < 6; ++k) {
        x[k] = x_[to_index(nodes[k])];
        if (share != 0.0) x[k] += share * way_[to_index(nodes[k])];
    }
    double bulge = 0.0;
    for (std::size_t k = 0; k < 3; ++k)
        bulge = std::max(bulge, (x[3 + k] - 0.5 * (x[k] + x[(k + 1) % 3])).squaredNorm());
    Vector3d l = side_coordinates(triangle, coordinates);
    if (bulge <= 1e-24 * (x[1] - x[0]).squaredNorm()) return quadratic_point(side, l);
    Vector3d along = Vector3d::Zero(), across = Vector3d::Zero();
    constexpr int most_steps = 4;
    for (int step = 0; step <= most_steps; ++step) {
        Vector3d here = Vector3d::Zero();
        std::array<Vector3d, 3> by_l = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t next = (k + 1) % 3;
            const double a = l[static_cast<Eigen::Index>(k)], b = l[static_cast<Eigen::Index>(next)];
            here += a * (2.0 * a - 1.0) * x[k] + 4.0 * a * b * x[3 + k];
            by_l[k] += (4.0 * a - 1.0) * x[k] + 4.0 * b * x[3 + k];
            by_l[next] += 4.0 * a * x[3 + k];
        }
        along = by_l[1] - by_l[0];
        across = by_l[2] - by_l[0];
        if (step == most_steps) break;
        Eigen::Matrix<double, 3, 2> J;
        J.col(0) = along;
        J.col(1) = across;
        const Eigen::Vector2d change = (J.transpose() * J).inverse() * (J.transpose() * (p - here));
        if (!change.allFinite()) break;
        l += Vector3d(-change[0] - change[1], change[0], change[1]);
        // The neighbour has what is beyond.
        l = l.cwiseMax(0.0);
        l /= l.sum();
        if (change.norm() < 1e-12) break;
    }
    const Vector3d curved = along.cross(across);
    if (curved.norm() > 0.0) normal = curved.normalized();
    return quadratic_point(side, l);
}

Vector3d MeshSurface::place_of(const CarriedPoint& point, double share) const {
    Vector3d result = Vector3d::Zero();
    for (std::size_t k = 0; k < point.count; ++k) result += point.weights[k] * x_[to_index(point.nodes[k])];
    return share == 0.0 ? result : Vector3d(result + share * way_of(point));
}

Vector3d MeshSurface::way_of(const CarriedPoint& point) const {
    Vector3d result = Vector3d::Zero();
    if (!way_.empty())
        for (std::size_t k = 0; k < point.count; ++k) result += point.weights[k] * way_[to_index(point.nodes[k])];
    return result;
}

}  // namespace delassus::mechanics
