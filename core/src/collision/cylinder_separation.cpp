// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "collision/separation.hpp"
#include "mechanics/contact_feature.hpp"

namespace delassus::collision {
namespace {

// s(n) is smooth except on great circles, n ⟂ an edge of a polytope or n ⟂ the axis of a cylinder, and at the axes and
// face normals. From a start near it, the maximum is found as the best of: the points where two circles meet, the
// maxima along single circles, the smooth maximum, the face normals and axes.
class Search {
public:
    Search(const Placed& a, const Placed& b, const Vector3d& offset) : a_(a), b_(b), offset_(offset) {}

    // s of every normal is at most its product with the difference of any two points, such as those of the best so far.
    void take(const Vector3d& normal) {
        if (normal.dot(apart_) <= value_) return;
        const Vector3d apart = between(normal);
        const double value = normal.dot(apart);
        if (value > value_) {
            value_ = value;
            normal_ = normal;
            apart_ = apart;
        }
    }

    void take_around(const Vector3d& start) {
        take(start);
        std::vector<Vector3d> circles;
        circles_near(a_, start, circles);
        circles_near(b_, -start, circles);
        for (std::size_t i = 0; i < circles.size(); ++i) {
            along_circle(circles[i], start);
            for (std::size_t j = 0; j < i; ++j) {
                const Vector3d meeting = circles[i].cross(circles[j]);
                const double sine = meeting.norm();
                if (sine < 1e-8) continue;
                take((meeting.dot(start) < 0.0 ? -1.0 : 1.0) / sine * meeting);
            }
        }
        smooth(start);
    }

    [[nodiscard]] double value() const { return value_; }
    [[nodiscard]] const Vector3d& normal() const { return normal_; }

private:
    /// The gradient of s: from the support point of a to that of b.
    [[nodiscard]] Vector3d between(const Vector3d& normal) const {
        return offset_ + b_.support(-normal) - a_.support(normal);
    }

    /// The axis, or the edges at the vertices that support directions about start.
    static void circles_near(const Placed& placed, const Vector3d& start, std::vector<Vector3d>& circles) {
        if (placed.is_cylinder()) {
            circles.push_back(placed.axis());
            return;
        }
        const Vector3d u = start.unitOrthogonal(), v = start.cross(u);
        std::vector<Vector3d> supports{placed.support(start)};
        for (int i = 0; i < 8; ++i) {
            const double angle = 0.25 * std::numbers::pi * i;
            const Vector3d point = placed.support(start + 0.15 * (std::cos(angle) * u + std::sin(angle) * v));
            if (std::find(supports.begin(), supports.end(), point) == supports.end()) supports.push_back(point);
        }
        for (std::size_t e = 0; e < placed.directions.size(); ++e) {
            const Polytope::Edge& edge = placed.solid->core.edges[e];
            if (std::abs(placed.directions[e].dot(start)) > 0.4) continue;
            for (const Vector3d& point : supports) {
                if (point == placed.vertices[edge.tail] || point == placed.vertices[edge.head]) {
                    circles.push_back(placed.directions[e]);
                    break;
                }
            }
        }
    }

    // The maximum of s along the circle n ⟂ pole is bracketed by slopes of different signs. It is looked for in turns
    // where the planes of both ends meet, which is where s has a kink, where the secant of the slopes vanishes, which
    // is near a smooth maximum, and in the middle.
    void along_circle(const Vector3d& pole, const Vector3d& start) {
        const Vector3d across = start - pole.dot(start) * pole;
        if (across.norm() < 0.1) return;
        const Vector3d u = across.normalized(), v = pole.cross(u);
        const auto at = [&](double angle) -> Vector3d { return std::cos(angle) * u + std::sin(angle) * v; };
        struct End {
            double angle, slope;
            Vector3d apart;
        };
        const auto look = [&](double angle) {
            const Vector3d apart = between(at(angle));
            return End{angle, (std::cos(angle) * v - std::sin(angle) * u).dot(apart), apart};
        };
        // Uphill from the start until the slope turns.
        End low = look(0.0);
        const double uphill = low.slope > 0.0 ? 1.0 : -1.0;
        End high = look(uphill * 0.01);
        while (uphill * high.slope > 0.0) {
            low = high;
            if (std::abs(high.angle) > 0.5) return;
            high = look(2.0 * high.angle);
        }
        const double flat = 1e-16 * (a_.solid->reach + b_.solid->reach);
        for (int i = 0; i < 100; ++i) {
            const double way = high.angle - low.angle;
            if (std::abs(way) <= 4e-16) break;
            double angle = low.angle + 0.5 * way;
            bool meets = false;
            if (i % 3 == 0) {
                const Vector3d turn = low.apart - high.apart;
                const double kink = std::atan(-u.dot(turn) / v.dot(turn));
                meets = (kink - low.angle) * (kink - high.angle) < 0.0;
                if (meets) angle = kink;
            } else if (i % 3 == 1) {
                angle = low.angle + way * low.slope / (low.slope - high.slope);
            }
            const End next = look(angle);
            meets = meets && (next.apart == low.apart || next.apart == high.apart);
            (uphill * next.slope > 0.0 ? low : high) = next;
            if (meets || std::abs(next.slope) <= flat) break;
        }
        take(at(low.angle));
        take(at(high.angle));
    }

    // Newton's method on the sphere. A rim of radius R adds R/|n_⟂| t tᵀ to the Hessian of a support function, n_⟂
    // being the part of n across the axis and t the tangent of the rim; vertices add nothing. s is homogeneous of
    // degree 1, so that the Hessian on the sphere is that of s less s times the identity.
    void smooth(const Vector3d& start) {
        Vector3d normal = start;
        for (int i = 0; i < 12; ++i) {
            const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
            const Vector3d gradient = between(normal);
            Eigen::Matrix2d hessian = -normal.dot(gradient) * Eigen::Matrix2d::Identity();
            for (const Placed* placed : {&a_, &b_}) {
                if (!placed->is_cylinder()) continue;
                const Vector3d rim = placed->axis().cross(normal);
                const double across = rim.norm();
                if (across < 1e-9) return;
                const Eigen::Vector2d tangent(u.dot(rim) / across, v.dot(rim) / across);
                hessian -= placed->solid->cylinder_radius / across * tangent * tangent.transpose();
            }
            if (!(hessian.determinant() > 0.0) || hessian.trace() >= 0.0) return;
            Eigen::Vector2d step = -hessian.inverse() * Eigen::Vector2d(u.dot(gradient), v.dot(gradient));
            const double length = step.norm();
            if (length > 0.2) step *= 0.2 / length;
            normal = (normal + step.x() * u + step.y() * v).normalized();
            take(normal);
            if (length < 1e-15) return;
        }
    }

    const Placed& a_;
    const Placed& b_;
    const Vector3d offset_;
    double value_ = -std::numeric_limits<double>::infinity();
    Vector3d normal_ = Vector3d::UnitZ();
    Vector3d apart_ = Vector3d::Zero();  // from the support point of a to that of b, of the best normal
};

/// The end points of the edge that supports a direction, or twice the vertex.
struct Support {
    Vector3d tail, head;
    bool cap = false;
};

Support support_edge(const Placed& placed, const Vector3d& direction) {
    const double tolerance = 1e-10;
    if (placed.is_cylinder()) {
        const double along = placed.axis().dot(direction);
        const Vector3d point = placed.support(direction);
        if (std::abs(along) > tolerance) return {point, point, (direction - along * placed.axis()).norm() < tolerance};
        const Vector3d rim = point - placed.axis().dot(point) * placed.axis();
        const Vector3d half = placed.solid->half_length * placed.axis();
        return {rim - half, rim + half};
    }
    const Vector3d first = placed.support(direction);
    const double least = first.dot(direction) - tolerance * placed.solid->reach;
    Vector3d last = first;
    for (const Vector3d& vertex : placed.vertices) {
        if (vertex.dot(direction) >= least && (vertex - first).squaredNorm() > (last - first).squaredNorm())
            last = vertex;
    }
    return {first, last};
}

/// The point of the cap, on the side of direction, nearest to a point.
Vector3d on_cap(const Placed& placed, const Vector3d& direction, const Vector3d& point) {
    const Vector3d axis = placed.axis();
    Vector3d across = point - axis.dot(point) * axis;
    const double length = across.norm();
    if (length > placed.solid->cylinder_radius) across *= placed.solid->cylinder_radius / length;
    return across + std::copysign(placed.solid->half_length, axis.dot(direction)) * axis;
}

/// Takes all directions that may be the best. False: they are further apart than limit.
bool search_all(Search& search, Placed& a, Placed& b, const Vector3d& offset, double limit) {
    // A prism lies inside its cylinder, at most the sagitta R (1 − cos(π/sides)) from it.
    const double sagitta =
        (1.0 - std::cos(std::numbers::pi / kPrismSides)) * (a.solid->cylinder_radius + b.solid->cylinder_radius);
    const auto rough = polytope_separation(a, b, offset, limit + sagitta);
    if (!rough) return false;
    for (const Placed* placed : {&a, &b}) {
        if (placed->is_cylinder()) {
            search.take(placed->axis());
            search.take(-placed->axis());
        } else {
            for (const Vector3d& normal : placed->normals) search.take(placed == &a ? normal : Vector3d(-normal));
        }
    }
    search.take_around(rough->normal);
    if (rough->distance > 0.0) {
        if (const auto apart = gjk(a, b, offset); apart && apart->distance > search.value()) {
            search.take_around(apart->normal);
        }
    }
    return search.value() <= limit;
}

/// Where the segment of a capsule is nearest to a cylinder's side, from the cylinder outwards: the direction; none
/// where it is nearest to a rim or inside. offset: from the cylinder to the capsule, whose core is rotated. An
/// infinitely long cylinder is nowhere farther than the one that it holds, so that its nearest point is that of the
/// other one if it lies on that.
std::optional<Vector3d> out_of_side(const Placed& cylinder, const Placed& capsule, const Vector3d& offset) {
    const Vector3d axis = cylinder.axis(), half = capsule.vertices.back();
    const auto across = [&](const Vector3d& v) { return Vector3d(v - axis.dot(v) * axis); };
    const Vector3d from_axis = across(offset), along = across(half);
    const double square = along.squaredNorm();
    const double s = square > 0.0 ? std::clamp(-from_axis.dot(along) / square, -1.0, 1.0) : 0.0;
    const Vector3d outwards = from_axis + s * along;
    const double distance = outwards.norm();
    if (!(distance > cylinder.solid->cylinder_radius) ||
        std::abs(axis.dot(offset + s * half)) > cylinder.solid->half_length)
        return std::nullopt;
    return outwards / distance;
}

}  // namespace

std::optional<Separation> cylinder_separation(Placed& a, Placed& b, const Vector3d& offset, double limit) {
    a.rotate_core();
    b.rotate_core();
    Search search(a, b, offset);
    std::optional<Vector3d> side;
    if (a.is_cylinder() && b.solid->kind == ShapeKind::Capsule) side = out_of_side(a, b, offset);
    if (b.is_cylinder() && a.solid->kind == ShapeKind::Capsule) {
        side = out_of_side(b, a, -offset);
        if (side) side = -*side;
    }
    if (side) {
        search.take(*side);
        if (search.value() > limit) return std::nullopt;
    } else if (!search_all(search, a, b, offset, limit)) {
        return std::nullopt;
    }
    Separation result;
    result.distance = search.value();
    result.normal = search.normal();
    const Support edge_a = support_edge(a, result.normal), edge_b = support_edge(b, -result.normal);
    const Vector3d lift = result.distance * result.normal;
    nearest_of_segments(edge_a.tail, edge_a.head - edge_a.tail, offset + edge_b.tail - lift, edge_b.head - edge_b.tail,
                        result.point_a, result.point_b);
    result.point_b += lift;
    if (edge_b.cap)
        result.point_b = offset + on_cap(b, -result.normal, (edge_a.cap ? Vector3d::Zero() : result.point_a) - offset);
    if (edge_a.cap) result.point_a = on_cap(a, result.normal, result.point_b);
    result.point_b += (result.distance - result.normal.dot(result.point_b - result.point_a)) * result.normal;
    result.feature = feature_id(FeatureKind::Nearest, 0, 0);
    return result;
}

}  // namespace delassus::collision
