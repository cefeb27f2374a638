// SPDX-License-Identifier: BSD-3-Clause
#include "collision/terrain_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "mechanics/contact_feature.hpp"

namespace delassus::collision {

// ---- What touches a surface of triangles ----
//
// Above a polyhedral surface, the points of a convex solid where its distance has a local minimum are of two kinds:
//
//   vertex over triangle   along the triangle's normal, the foot inside it
//   anything over a ridge  along a normal n of the ridge's cone: no point of the surface about the ridge's point lies
//                          further along n. About the inside of an edge that is n · t₁ ≤ 0 and n · t₂ ≤ 0, with t_i
//                          into its triangles; about a vertex n · e ≤ 0 for all its edges e.
//
// (An edge of the solid over a triangle has its minimum at a vertex, or over the triangle's border.) Flat and concave
// edges have an empty cone but for the normals of their triangles: there a direction that leans to the edge, as the
// collision of the solid with one triangle alone would give, is no minimum, and no contact is made of it. So a sphere
// or a box that slides over a flat floor of triangles has the contacts of the plane, with their names: a vertex keeps
// its name while it slides from triangle to triangle.
//
// The surface has one side. A vertex below a triangle is pushed up along the normal, unless another part of the surface
// is nearer that lies below the triangle's plane: then it left, or comes, through that part. (Below a ridge one of two
// triangles acts, in a valley both; the far side of a wall does not act through it.)

namespace {

constexpr double kRoundingAngle = 1e-9;

bool has_point_core(const Solid& solid) {
    return solid.kind == ShapeKind::Sphere;
}

}  // namespace

bool TerrainContacts::belongs_elsewhere(const Terrain& surface, const Terrain::Triangle& triangle,
                                        const Vector3d& point, double depth) const {
    const double rounding = 1e-12 * local_.solid->reach;
    return std::any_of(triangles_.begin(), triangles_.end(), [&](std::int32_t t) {
        const Terrain::Triangle& other = surface.triangles()[t];
        if (other.facet == triangle.facet) return false;
        const Vector3d nearest = surface.nearest(other, point);
        return surface.height(triangle, nearest) < -rounding &&
               (nearest - point).squaredNorm() < (1.0 - 1e-9) * depth * depth;
    });
}

void TerrainContacts::on_triangle(const Terrain& surface, const Terrain::Triangle& triangle, double limit,
                                  double depth) {
    const double lowest = surface.height(triangle, local_.position + local_.support(-triangle.normal));
    if (lowest >= limit) return;
    manifold_.facing(local_, -triangle.normal, facing_);
    const double tolerance = 1e-9 * local_.solid->reach;
    for (const FacingPoint& corner : facing_) {
        const Vector3d at = local_.position + corner.point;
        const double height = surface.height(triangle, at);
        if (height >= limit || height < -depth) continue;
        const Vector3d foot = at - height * triangle.normal;
        bool inside = true;
        for (std::size_t k = 0; k < 3 && inside; ++k) {
            const double beyond = -triangle.inward[k].dot(foot - surface.vertices()[triangle.corners[k]]);
            // Below a valley, feet lie beyond it.
            const bool valley = triangle.kinds[k] == Terrain::EdgeKind::Concave;
            inside = beyond <= tolerance + (valley ? 2.0 * std::max(0.0, -height) : 0.0);
        }
        if (!inside || (height < 0.0 && belongs_elsewhere(surface, triangle, at, -height))) continue;
        Point point;
        point.distance = height;
        point.normal = triangle.normal;
        point.on_terrain = foot;
        point.on_shape = at;
        point.vertex = corner.vertex;
        point.place = triangle.facet;
        points_.push_back(point);
    }
}

void TerrainContacts::put_edge_point(std::int32_t number, const Separation& point, const Vector3d& origin,
                                     std::uint32_t feature) {
    Point result;
    result.distance = point.distance;
    result.normal = point.normal;
    result.on_terrain = origin + point.point_a;
    result.on_shape = origin + point.point_b;
    result.place = number;
    result.feature = feature;
    points_.push_back(result);
}

void TerrainContacts::on_edge(const Terrain& surface, std::int32_t number, double limit, double depth) {
    const Terrain::SharpEdge& edge = surface.sharp_edges()[number];
    const Vector3d &tail = surface.vertices()[edge.tail], &head = surface.vertices()[edge.head];
    const Vector3d middle = 0.5 * (tail + head), half = 0.5 * (head - tail), offset = local_.position - middle;
    const double length = half.norm();
    const bool rim = edge.triangles[1] < 0;
    const Vector3d& up_1 = surface.triangles()[edge.triangles[0]].normal;
    const Vector3d up = rim ? up_1 : Vector3d(up_1 + surface.triangles()[edge.triangles[1]].normal);

    const bool point_core = has_point_core(*local_.solid), capsule = local_.solid->kind == ShapeKind::Capsule;
    std::optional<Separation> nearest;
    if (point_core || capsule) {
        const Vector3d core = capsule ? Vector3d(local_.solid->half_length * local_.axis()) : Vector3d::Zero();
        Separation found;
        nearest_of_segments(-half, 2.0 * half, offset - core, 2.0 * core, found.point_a, found.point_b);
        const Vector3d between = found.point_b - found.point_a;
        found.distance = between.norm();
        found.normal = found.distance > 0.0 ? Vector3d(between / found.distance) : up.normalized();
        if (found.distance < limit) nearest = found;
    }
    if (!point_core) {
        segment_solid_.kind = ShapeKind::Capsule;
        segment_solid_.half_length = segment_solid_.reach = length;
        if (segment_solid_.core.edges.empty()) segment_solid_.core = segment_polytope(1.0);
        segment_.solid = &segment_solid_;
        segment_.position = middle;
        segment_.vertices.assign({-half, half});
        segment_.directions.assign(1, half / length);
        segment_.rotated = true;
        if (!capsule) {
            nearest = local_.is_cylinder() ? cylinder_separation(segment_, local_, offset, limit)
                                           : polytope_separation(segment_, local_, offset, limit);
        }
    }
    if (!nearest || nearest->distance < -depth) return;
    const Vector3d& normal = nearest->normal;
    const double angle = point_core ? kRoundingAngle : kFlatAngle;
    if (normal.dot(up) < -angle) return;
    const double along = nearest->point_a.dot(half) / length;
    if (std::abs(along) >= (1.0 - 1e-9) * length) {
        if (!surface.is_top(along < 0.0 ? edge.tail : edge.head, normal, angle)) return;
    } else if (normal.dot(edge.inward[0]) > angle || normal.dot(edge.inward[1]) > angle) {
        return;
    }
    if (point_core) return put_edge_point(number, *nearest, middle, nearest->feature);
    manifold_.between(segment_, local_, offset, *nearest, limit, core_points_);
    for (const CorePoint& point : core_points_) put_edge_point(number, point, middle, point.feature);
}

void TerrainContacts::find(const Terrain& surface, const AlignedBox3d& box, double limit, double depth) {
    points_.clear();
    edges_.clear();
    surface.near(box, triangles_);
    for (const std::int32_t t : triangles_) {
        const Terrain::Triangle& triangle = surface.triangles()[t];
        on_triangle(surface, triangle, limit, depth);
        for (const std::int32_t edge : triangle.sharp_edge)
            if (edge >= 0) edges_.push_back(edge);
    }
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    for (const std::int32_t edge : edges_) on_edge(surface, edge, limit, depth);
}

/// A vertex over a border of two triangles of one facet, a corner over a ridge and over its triangle, the vertex where
/// ridges meet: of points at one place along one direction the deepest stays, of equals the first.
void TerrainContacts::leave_out_copies() {
    const double near = 1e-6 * local_.solid->reach;
    kept_.clear();
    for (const Point& point : points_) {
        const auto copy = std::find_if(kept_.begin(), kept_.end(), [&](const Point& other) {
            if (point.vertex >= 0 && point.vertex == other.vertex && point.place == other.place) return true;
            return (point.on_shape - other.on_shape).norm() <= near &&
                   (point.normal - other.normal).norm() <= kFlatAngle;
        });
        if (copy == kept_.end()) {
            kept_.push_back(point);
        } else if (point.distance < copy->distance) {
            *copy = point;
        }
    }
    points_.swap(kept_);
}

// Names say what touches what, whatever else is near: a vertex and a facet, on which a vertex keeps its name while it
// slides from triangle to triangle; a ridge, and what of the shape, or which end of the ridge, it is.
void TerrainContacts::name_features(bool terrain_is_a) {
    const FeatureKind vertex = terrain_is_a ? FeatureKind::VertexOfB : FeatureKind::VertexOfA;
    for (Point& point : points_) {
        const auto place = static_cast<std::size_t>(point.place);
        point.feature = point.vertex >= 0 ? feature_id(vertex, static_cast<std::size_t>(point.vertex), place)
                                          : feature_id(FeatureKind::Edges, place, short_feature_of_b(point.feature));
    }
    std::stable_sort(points_.begin(), points_.end(),
                     [](const Point& p, const Point& q) { return p.feature < q.feature; });
    // Where there are more than these bits count.
    for (std::size_t i = 1; i < points_.size(); ++i)
        points_[i].feature = std::max(points_[i].feature, points_[i - 1].feature + 1);
}

void TerrainContacts::collide(const Placed& terrain, const Placed& shape, bool terrain_is_a, double envelope,
                              std::vector<ContactPoint>& contacts) {
    const Terrain& surface = *terrain.solid->terrain;
    const Matrix3d to_terrain = terrain.rotation.transpose();
    local_.solid = shape.solid;
    local_.rotation.noalias() = to_terrain * shape.rotation;
    local_.position.noalias() = to_terrain * (shape.position - terrain.position);
    local_.body = {shape.body.known, to_terrain * shape.body.way, to_terrain * shape.body.turn,
                   to_terrain * shape.body.centre};
    local_.rotated = false;
    const double swept = shape.solid->radius + terrain.solid->radius, limit = envelope + swept;
    const Vector3d half = half_extent(local_) + Vector3d::Constant(envelope + terrain.solid->radius);
    const AlignedBox3d box(local_.position - half, local_.position + half);
    // What is inside a closed surface, or below a height field, may touch no triangle.
    const bool height_field = terrain.solid->kind == ShapeKind::HeightField;
    AlignedBox3d whole = surface.box();
    const double depth = height_field ? std::max(shape.solid->reach, whole.max().z() - box.min().z()) + swept
                                      : shape.solid->reach + swept;
    whole.min().array() -= height_field ? swept : depth;
    whole.max().array() += height_field ? limit : depth;
    if (height_field) whole.min().z() = box.min().z();
    if (!whole.intersects(box)) return;
    local_.rotate_core();
    find(surface, box, limit, depth);
    if (points_.empty()) {
        const Vector3d more = Vector3d::Constant(depth);
        find(surface, AlignedBox3d(box.min() - more, box.max() + more), limit, depth);
    }
    leave_out_copies();
    name_features(terrain_is_a);
    for (const Point& point : points_) {
        ContactPoint contact;
        contact.gap = point.distance - swept;
        if (!(contact.gap < envelope)) continue;
        const Vector3d normal = terrain.rotation * point.normal;
        const Vector3d on_terrain =
            terrain.position + terrain.rotation * (point.on_terrain + terrain.solid->radius * point.normal);
        const Vector3d on_shape =
            terrain.position + terrain.rotation * (point.on_shape - shape.solid->radius * point.normal);
        for (std::size_t i = 0; i < 3; ++i) {
            const auto row = static_cast<Eigen::Index>(i);
            contact.point_a[i] = terrain_is_a ? on_terrain[row] : on_shape[row];
            contact.point_b[i] = terrain_is_a ? on_shape[row] : on_terrain[row];
            contact.normal[i] = terrain_is_a ? normal[row] : -normal[row];
        }
        contact.feature = point.feature;
        contacts.push_back(contact);
    }
}

}  // namespace delassus::collision
