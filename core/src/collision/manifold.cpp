// SPDX-License-Identifier: BSD-3-Clause
#include "collision/manifold.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "mechanics/contact_feature.hpp"

namespace delassus::collision {
namespace {

// Features of a cylinder that its prism does not have: the ends of the generator (or rim points) that supports a
// direction, the generator, and the first of the rim points of put_leaning_rims().
constexpr std::int32_t kLowerRim = 0x7ffd, kUpperRim = 0x7ffe, kGenerator = 0x7ffc, kLeaningRims = 0x7ff9;

struct Edge {
    Vector3d tail, head;
    std::int32_t tail_vertex, head_vertex;
};

Vector3d rim_point(const Placed& placed, const Vector3d& direction, bool upper) {
    const Vector3d axis = placed.axis();
    Vector3d across = direction - axis.dot(direction) * axis;
    across -= axis.dot(across) * axis;
    return placed.solid->cylinder_radius * across.normalized() +
           (upper ? placed.solid->half_length : -placed.solid->half_length) * axis;
}

/// Whether a face lies within the cap of a cylinder on which it lies; offset: from the cylinder to the other.
bool holds(const Placed& cylinder, const Placed& other, std::int32_t face, const Vector3d& offset) {
    const auto& loop = other.solid->core.faces[static_cast<std::size_t>(face)].loop;
    return std::all_of(loop.begin(), loop.end(), [&](std::int32_t v) {
        return cylinder.axis().cross(offset + other.vertices[static_cast<std::size_t>(v)]).norm() <=
               cylinder.solid->cylinder_radius;
    });
}

/// The edges whose points all nearly support a direction.
void edges_towards(const Placed& placed, const Vector3d& direction, std::vector<Edge>& edges) {
    if (placed.is_cylinder()) {
        if (std::abs(placed.axis().dot(direction)) < kFlatAngle)
            edges.push_back(
                {rim_point(placed, direction, false), rim_point(placed, direction, true), kLowerRim, kUpperRim});
        return;
    }
    const double most = placed.support(direction).dot(direction);
    for (std::size_t e = 0; e < placed.directions.size(); ++e) {
        if (std::abs(placed.directions[e].dot(direction)) > kFlatAngle) continue;
        const Polytope::Edge& edge = placed.solid->core.edges[e];
        const Vector3d& tail = placed.vertices[edge.tail];
        const Vector3d& head = placed.vertices[edge.head];
        if (std::min(tail.dot(direction), head.dot(direction)) < most - kFlatAngle * (head - tail).norm()) continue;
        edges.push_back({tail, head, edge.tail, edge.head});
    }
}

}  // namespace

std::uint32_t Manifold::feature(const Corner& corner, bool incident_is_a) {
    const auto name = [&](FeatureKind of_a, FeatureKind of_b, std::int32_t vertex) {
        return incident_is_a ? feature_id(of_a, static_cast<std::size_t>(vertex), 0)
                             : feature_id(of_b, static_cast<std::size_t>(vertex), 0);
    };
    if (corner.vertex >= 0) return name(FeatureKind::VertexOfA, FeatureKind::VertexOfB, corner.vertex);
    if (corner.other >= 0) return name(FeatureKind::VertexOfB, FeatureKind::VertexOfA, corner.other);
    const auto edge = static_cast<std::size_t>(corner.edge), cut = static_cast<std::size_t>(corner.cut);
    return feature_id(FeatureKind::Edges, incident_is_a ? edge : cut, incident_is_a ? cut : edge);
}

/// The face whose normal is a direction up to kFlatAngle, or −1.
std::int32_t Manifold::face_towards(const Placed& placed, const Vector3d& direction) {
    const auto count = static_cast<std::int32_t>(placed.normals.size());
    std::int32_t best = -1;
    double most = 1.0 - 0.5 * kFlatAngle * kFlatAngle;
    for (std::int32_t f = placed.is_cylinder() ? count - 2 : 0; f < count; ++f) {
        const double cosine = placed.normals[f].dot(direction);
        if (cosine > most) {
            most = cosine;
            best = f;
        }
    }
    return best;
}

Manifold::Corner Manifold::rim_corner(const Vector3d& point, std::int32_t name) {
    return {point, name, -1, -1, -1, kGenerator, -1};
}

std::size_t Manifold::nearest_corner(const Vector3d& point) const {
    const auto nearest = std::min_element(polygon_.begin(), polygon_.end(), [&](const auto& p, const auto& q) {
        return (p.point - point).squaredNorm() < (q.point - point).squaredNorm();
    });
    return static_cast<std::size_t>(nearest - polygon_.begin());
}

/// Between the nearest corner and the nearer one of its neighbours.
void Manifold::insert_on_arc(const Corner& rim) {
    const std::size_t count = polygon_.size(), nearest = nearest_corner(rim.point);
    const auto to = [&](std::size_t i) { return (polygon_[i % count].point - rim.point).squaredNorm(); };
    const bool after = to(nearest + 1) < to(nearest + count - 1);
    polygon_.insert(polygon_.begin() + static_cast<std::ptrdiff_t>(nearest + (after ? 1 : 0)), rim);
}

/// What lies flat would fall over the rim, not over an edge between two of its vertices: where it goes ahead or is
/// drawn by its weight, or where a mass centre is.
void Manifold::put_leaning_rims(const Placed& cylinder, const Vector3d& direction, const Placed* other,
                                const Vector3d& to_other) {
    constexpr double rounding = 1e-9, apart = 1e-3;
    const double radius = cylinder.solid->cylinder_radius;
    const bool upper = cylinder.axis().dot(direction) > 0.0;
    const auto put = [&](const Vector3d& lean, double known, std::int32_t name) {
        if (!(cylinder.axis().cross(lean).norm() > rounding * known)) return;
        const Corner rim = rim_corner(rim_point(cylinder, lean, upper), name);
        if ((polygon_[nearest_corner(rim.point)].point - rim.point).norm() > apart * radius) insert_on_arc(rim);
    };
    const BodyInStep own = cylinder.body, against = other ? other->body : BodyInStep{};
    put(own.way - against.way + radius * direction.cross(own.turn - against.turn),
        own.way.norm() + against.way.norm() + radius * (own.turn.norm() + against.turn.norm()), kLeaningRims);
    if (own.known) put(own.centre, radius, kLeaningRims + 1);
    if (against.known) put(to_other + against.centre, radius, kLeaningRims + 2);
}

/// The polygon, edge or vertex that faces a direction: of the faces at the vertices that support it, the most aligned.
void Manifold::incident_polygon(const Placed& placed, const Vector3d& direction, const Placed* other,
                                const Vector3d& to_other) {
    polygon_.clear();
    const Polytope& core = placed.solid->core;
    const auto put = [&](const Vector3d& point, std::int32_t vertex, std::int32_t leaving) {
        polygon_.push_back({point, vertex, -1, -1, -1, leaving, -1});
    };
    if (placed.is_cylinder()) {
        const double along = placed.axis().dot(direction);
        if (std::abs(along) < std::sqrt(0.5)) {
            put(rim_point(placed, direction, false), kLowerRim, kGenerator);
            put(rim_point(placed, direction, true), kUpperRim, kGenerator);
            return;
        }
        // Every third vertex of the cap, and among them the rim point furthest along the direction.
        const bool upper = along > 0.0;
        const Polytope::Face& cap = core.faces[core.faces.size() - (upper ? 2 : 1)];
        for (std::size_t i = 0; i < cap.loop.size(); i += 3)
            put(placed.vertices[cap.loop[i]], cap.loop[i], cap.edges[i]);
        const double tilt = placed.axis().cross(direction).norm();
        if (tilt >= 1e-12) {
            const Corner lowest = rim_corner(rim_point(placed, direction, upper), upper ? kUpperRim : kLowerRim);
            // A cap that rolls on its rim passes its vertices: each touches at a cusp of its path, which no step
            // resolves. So the rim point stands for the vertex that is nearest to it, unless the cap lies flat.
            if (tilt > kFlatAngle) {
                polygon_[nearest_corner(lowest.point)] = lowest;
                return;
            }
            insert_on_arc(lowest);
        }
        put_leaning_rims(placed, direction, other, to_other);
        return;
    }
    if (core.faces.empty()) {
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(placed.vertices.size()); ++i)
            put(placed.vertices[i], i, 0);
        return;
    }
    const double least = placed.support(direction).dot(direction) - 1e-9 * placed.solid->reach;
    std::int32_t best = -1;
    for (std::int32_t f = 0; f < static_cast<std::int32_t>(core.faces.size()); ++f) {
        if (best >= 0 && placed.normals[f].dot(direction) <= placed.normals[best].dot(direction)) continue;
        const auto& loop = core.faces[f].loop;
        if (std::any_of(loop.begin(), loop.end(),
                        [&](std::int32_t v) { return placed.vertices[v].dot(direction) >= least; }))
            best = f;
    }
    const Polytope::Face& face = core.faces[best];
    for (std::size_t i = 0; i < face.loop.size(); ++i) put(placed.vertices[face.loop[i]], face.loop[i], face.edges[i]);
}

/// Clips the polygon (Sutherland, Hodgman) against the sides of a face, which is at to_reference from the polygon's
/// origin. Corners up to tolerance (m) outside are kept, so that flush faces keep their vertices.
void Manifold::clip(const Placed& reference, std::int32_t face, const Vector3d& to_reference, double tolerance) {
    const Polytope::Face& sides = reference.solid->core.faces[face];
    const auto count = static_cast<std::int32_t>(sides.loop.size());
    for (std::int32_t side = 0; side < count && !polygon_.empty(); ++side) {
        const Vector3d tail = to_reference + reference.vertices[sides.loop[side]];
        const Vector3d head = to_reference + reference.vertices[sides.loop[(side + 1) % count]];
        const Vector3d outward = (head - tail).cross(reference.normals[face]).normalized();
        clipped_.clear();
        const std::size_t corners = polygon_.size();
        for (std::size_t i = 0; i < corners; ++i) {
            const Corner& from = polygon_[i];
            const Corner& to = polygon_[(i + 1) % corners];
            const double from_outside = outward.dot(from.point - tail);
            const double to_outside = outward.dot(to.point - tail);
            const bool from_in = from_outside <= tolerance, to_in = to_outside <= tolerance;
            if (from_in) clipped_.push_back(from);
            // A segment is not a closed polygon: it has one edge.
            if (from_in == to_in || (corners == 2 && i == 1)) continue;
            Corner corner;
            // Both may be outside, one of them within the tolerance: then the cut is at that one.
            const double share = std::clamp(from_outside / (from_outside - to_outside), 0.0, 1.0);
            corner.point = from.point + share * (to.point - from.point);
            if (from.leaving >= 0) {
                corner.edge = from.leaving;
                corner.cut = sides.edges[side];
            } else {
                // Two sides of the face meet at the vertex between them.
                const bool first_and_last = side == count - 1 && from.leaving_cut == 0;
                corner.other = sides.loop[first_and_last ? 0 : side];
            }
            if (to_in) {
                corner.leaving = from.leaving;
                corner.leaving_cut = from.leaving_cut;
            } else {
                corner.leaving_cut = side;
            }
            clipped_.push_back(corner);
        }
        polygon_.swap(clipped_);
    }
}

bool Manifold::from_face(const Placed& reference, std::int32_t face, const Placed& incident,
                         const Vector3d& to_incident, bool reference_is_a, double limit,
                         std::vector<CorePoint>& points) {
    const Vector3d& normal = reference.normals[face];
    const double offset = reference.solid->core.faces[face].offset;
    incident_polygon(incident, -normal, &reference, -to_incident);
    clip(reference, face, -to_incident, 1e-7 * std::min(reference.solid->reach, incident.solid->reach));
    const Vector3d origin = reference_is_a ? Vector3d::Zero() : Vector3d(-to_incident);
    for (const Corner& corner : polygon_) {
        const Vector3d at = to_incident + corner.point;
        const double distance = normal.dot(at) - offset;
        if (distance >= limit) continue;
        CorePoint point;
        point.distance = distance;
        point.normal = reference_is_a ? normal : Vector3d(-normal);
        const Vector3d on_incident = origin + at, on_reference = on_incident - distance * normal;
        point.point_a = reference_is_a ? on_reference : on_incident;
        point.point_b = reference_is_a ? on_incident : on_reference;
        point.feature = feature(corner, !reference_is_a);
        points.push_back(point);
    }
    return !points.empty();
}

/// Two nearly parallel edges that overlap: the ends of the overlap, both measured along the nearest normal.
bool Manifold::from_edges(const Placed& a, const Placed& b, const Vector3d& offset, const Separation& nearest,
                          double limit, std::vector<CorePoint>& points) {
    std::vector<Edge> edges_a, edges_b;
    edges_towards(a, nearest.normal, edges_a);
    if (edges_a.empty()) return false;
    edges_towards(b, -nearest.normal, edges_b);
    for (const Edge& ea : edges_a) {
        const Vector3d along_a = ea.head - ea.tail;
        const double length = along_a.norm();
        const Vector3d u = along_a / length;
        for (const Edge& eb : edges_b) {
            const Vector3d tail = offset + eb.tail, along_b = eb.head - eb.tail;
            if (u.cross(along_b).norm() > kFlatAngle * along_b.norm()) continue;
            // Parameters along u, from the tail of a's edge.
            const double b_tail = u.dot(tail - ea.tail), slope = u.dot(along_b), b_head = b_tail + slope;
            const bool forward = slope > 0.0;
            const double b_low = forward ? b_tail : b_head, b_high = forward ? b_head : b_tail;
            const double low = std::max(0.0, b_low), high = std::min(length, b_high);
            if (high - low < kFlatAngle * std::min(length, std::abs(slope))) continue;
            for (const bool lower : {true, false}) {
                const double at = lower ? low : high;
                const bool of_a = lower ? b_low <= 0.0 : b_high >= length;
                CorePoint point;
                point.normal = nearest.normal;
                point.point_a = ea.tail + at * u;
                point.point_b = tail + (at - b_tail) / slope * along_b;
                point.distance = point.normal.dot(point.point_b - point.point_a);
                const std::int32_t vertex_a = lower ? ea.tail_vertex : ea.head_vertex;
                const std::int32_t vertex_b = lower == forward ? eb.tail_vertex : eb.head_vertex;
                point.feature = of_a ? feature_id(FeatureKind::VertexOfA, static_cast<std::size_t>(vertex_a), 0)
                                     : feature_id(FeatureKind::VertexOfB, static_cast<std::size_t>(vertex_b), 0);
                if (point.distance < limit) points.push_back(point);
            }
            return !points.empty();
        }
    }
    return false;
}

/// Faces that nearly meet touch first where two edges cross, and then turn until they lie on each other. Their other
/// corners within the limit are points too, each with the distance and the normal of the face; those near a point that
/// is there already would only repeat it with a normal a little off.
void Manifold::beside_edges(const Placed& a, const Placed& b, const Vector3d& offset, const Separation& nearest,
                            double limit, std::vector<CorePoint>& points) {
    constexpr double least_cosine = 0.87;  // 30°
    constexpr double apart = 0.1;          // of the smaller reach
    const auto aligned = [&](const Placed& placed, const Vector3d& direction) {
        std::pair<double, std::int32_t> best{least_cosine, -1};
        for (std::size_t f = 0; f < placed.normals.size(); ++f)
            best = std::max(best, std::pair(placed.normals[f].dot(direction), static_cast<std::int32_t>(f)));
        return best;
    };
    const auto [cosine_a, face_a] = aligned(a, nearest.normal);
    const auto [cosine_b, face_b] = aligned(b, -nearest.normal);
    if (face_a < 0 && face_b < 0) return;
    beside_.clear();
    if (cosine_b > cosine_a) {
        from_face(b, face_b, a, -offset, false, limit, beside_);
    } else {
        from_face(a, face_a, b, offset, true, limit, beside_);
    }
    const double least = apart * std::min(a.solid->reach, b.solid->reach);
    for (const CorePoint& point : beside_) {
        const bool repeats = std::any_of(points.begin(), points.end(), [&](const CorePoint& other) {
            return other.feature == point.feature || (other.point_a - point.point_a).norm() < least ||
                   (other.point_b - point.point_b).norm() < least;
        });
        if (!repeats && point.distance > nearest.distance) points.push_back(point);
    }
}

// Points nearer to each other than a thousandth of the patch say the same: the one with the lower feature stays. Of too
// many, the deepest is taken first, then always the one furthest from those taken; of equals the lower feature.
void Manifold::reduce(std::vector<CorePoint>& points, std::size_t most) {
    std::sort(points.begin(), points.end(),
              [](const CorePoint& p, const CorePoint& q) { return p.feature < q.feature; });
    double patch = 0.0;
    for (const CorePoint& point : points) patch = std::max(patch, (point.point_a - points[0].point_a).norm());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        bool near = false;
        for (std::size_t j = 0; j < kept; ++j) {
            near = near || points[i].feature == points[j].feature ||
                   (points[i].point_a - points[j].point_a).norm() <= 1e-3 * patch;
        }
        if (!near) points[kept++] = points[i];
    }
    points.resize(kept);
    if (kept <= most) return;
    std::vector<double> far(kept, std::numeric_limits<double>::infinity());
    std::vector<CorePoint> chosen;
    std::size_t next = 0;
    for (std::size_t i = 1; i < kept; ++i) {
        if (points[i].distance < points[next].distance) next = i;
    }
    while (chosen.size() < most) {
        chosen.push_back(points[next]);
        for (std::size_t i = 0; i < kept; ++i)
            far[i] = std::min(far[i], (points[i].point_a - chosen.back().point_a).squaredNorm());
        next = static_cast<std::size_t>(std::max_element(far.begin(), far.end()) - far.begin());
    }
    std::sort(chosen.begin(), chosen.end(),
              [](const CorePoint& p, const CorePoint& q) { return p.feature < q.feature; });
    points.swap(chosen);
}

void Manifold::between(Placed& a, Placed& b, const Vector3d& offset, const Separation& nearest, double limit,
                       std::vector<CorePoint>& points) {
    points.clear();
    const std::int32_t face_a = face_towards(a, nearest.normal);
    const std::int32_t face_b = face_towards(b, -nearest.normal);
    bool found = false;
    // The face that is more aligned is the reference; up to rounding that of a, but that a cap, of which there are but
    // samples, is the reference of what lies within it, and of nothing else. Of two caps it is the larger one.
    const double aligned_a = face_a < 0 ? 0.0 : a.normals[face_a].dot(nearest.normal),
                 aligned_b = face_b < 0 ? 0.0 : -b.normals[face_b].dot(nearest.normal);
    bool of_b = face_b >= 0 && (face_a < 0 || aligned_b > aligned_a + 1e-14);
    if (face_a >= 0 && face_b >= 0 && std::abs(aligned_b - aligned_a) <= 1e-14) {
        if (a.is_cylinder() && b.is_cylinder()) {
            of_b = b.solid->cylinder_radius > a.solid->cylinder_radius;
        } else if (a.is_cylinder() || b.is_cylinder()) {
            of_b = a.is_cylinder() ? !holds(a, b, face_b, offset) : holds(b, a, face_a, -offset);
        }
    }
    if (of_b) {
        found = from_face(b, face_b, a, -offset, false, limit, points);
    } else if (face_a >= 0) {
        found = from_face(a, face_a, b, offset, true, limit, points);
    }
    if (!found) found = from_edges(a, b, offset, nearest, limit, points);
    const auto deeper = [&](const CorePoint& point) {
        return point.distance <= nearest.distance + 1e-10 * (a.solid->reach + b.solid->reach);
    };
    // The sampled cap of a cylinder may miss the nearest point.
    const bool sampled = a.is_cylinder() || b.is_cylinder();
    if (!found || (sampled && std::none_of(points.begin(), points.end(), deeper))) points.push_back(nearest);
    if (!sampled && face_a < 0 && face_b < 0) beside_edges(a, b, offset, nearest, limit, points);
    reduce(points, sampled ? kMostPointsOfCaps : kMostPoints);
}

void Manifold::facing(const Placed& placed, const Vector3d& direction, std::vector<FacingPoint>& points) {
    points.clear();
    incident_polygon(placed, direction);
    for (const Corner& corner : polygon_) points.push_back({corner.point, corner.vertex});
}

void Manifold::on_plane(Placed& other, const Vector3d& point, const Vector3d& normal, bool plane_is_a, double limit,
                        std::vector<CorePoint>& points) {
    points.clear();
    if (other.solid->core.is_large() && normal.dot(other.support(-normal) - point) >= limit) return;
    other.rotate_core();
    incident_polygon(other, -normal);
    for (const Corner& corner : polygon_) {
        const double distance = normal.dot(corner.point - point);
        if (distance >= limit) continue;
        CorePoint result;
        result.distance = distance;
        result.normal = plane_is_a ? normal : Vector3d(-normal);
        const Vector3d foot = corner.point - distance * normal;
        result.point_a = plane_is_a ? foot : corner.point;
        result.point_b = plane_is_a ? corner.point : foot;
        result.feature = feature(corner, !plane_is_a);
        points.push_back(result);
    }
    reduce(points, other.is_cylinder() ? kMostPointsOfCaps : kMostPoints);
}

}  // namespace delassus::collision
