// SPDX-License-Identifier: BSD-3-Clause
#include "collision/flush_neighbours.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace delassus::collision {
namespace {

constexpr double kFlatCosine = 1.0 - 0.5 * kFlatAngle * kFlatAngle;

/// Calls f(m, s) for the half-spaces about a solid that count at a point x of its frame: outward normals and the
/// heights of x above them, m. Those of a swept core are of the solid that was shrunk to it.
template <class F>
void for_each_side(const Solid& solid, const Vector3d& x, F&& f) {
    switch (solid.kind) {
        case ShapeKind::Plane:
            f(Vector3d::UnitZ(), x.z());
            return;
        case ShapeKind::Box:
            for (Eigen::Index k = 0; k < 3; ++k) {
                const double half = solid.half[k] + solid.radius;
                f(Vector3d::Unit(k), x[k] - half);
                f(-Vector3d::Unit(k), -x[k] - half);
            }
            return;
        case ShapeKind::Cylinder: {
            const double half = solid.half_length + solid.radius, across = std::hypot(x.x(), x.y());
            f(Vector3d::UnitZ(), x.z() - half);
            f(-Vector3d::UnitZ(), -x.z() - half);
            if (across > 0.0)
                f(Vector3d(x.x() / across, x.y() / across, 0.0), across - solid.cylinder_radius - solid.radius);
            return;
        }
        default:
            for (const Polytope::Face& face : solid.core.faces)
                f(face.normal, face.normal.dot(x) - face.offset - solid.radius);
    }
}

/// Sides of a solid that a point lies on; more than these are not told apart.
struct Sides {
    std::array<Vector3d, 8> normals;
    std::size_t count = 0;

    void add(const Vector3d& normal) {
        for (std::size_t i = 0; i < count; ++i)
            if (normals[i].dot(normal) > kFlatCosine) return;
        if (count < normals.size()) normals[count++] = normal;
    }
};

/// Whether a unit vector is in the cone of normals, up to kFlatAngle: its nearest point there is of one, two or three.
bool in_cone(const Sides& sides, const Vector3d& n) {
    constexpr double far = kFlatAngle * kFlatAngle;
    for (std::size_t i = 0; i < sides.count; ++i) {
        const Vector3d& a = sides.normals[i];
        const double on_a = n.dot(a);
        if (on_a > 0.0 && (n - on_a * a).squaredNorm() <= far) return true;
        for (std::size_t j = i + 1; j < sides.count; ++j) {
            const Vector3d& b = sides.normals[j];
            const Vector3d across = a.cross(b);
            const double area = across.squaredNorm();
            if (area < far) continue;
            const double side = n.dot(across);
            if (n.cross(b).dot(across) >= 0.0 && a.cross(n).dot(across) >= 0.0 && side * side <= far * area)
                return true;
            for (std::size_t k = j + 1; k < sides.count; ++k) {
                const Vector3d& c = sides.normals[k];
                const double volume = across.dot(c);
                if (volume * volume < far * area) continue;
                if (n.dot(b.cross(c)) * volume >= 0.0 && n.dot(c.cross(a)) * volume >= 0.0 && side * volume >= 0.0)
                    return true;
            }
        }
    }
    return false;
}

/// Calls f(triangle, height, foot) for the triangles of a terrain that a point of its frame lies on or above, by their
/// normals, up to tolerance; below a height field too.
template <class F>
void for_each_triangle(const Solid& solid, const Vector3d& x, double tolerance, F&& f) {
    const Terrain& surface = *solid.terrain;
    AlignedBox3d box(x - Vector3d::Constant(tolerance + solid.radius),
                     x + Vector3d::Constant(tolerance + solid.radius));
    const bool fills = solid.kind == ShapeKind::HeightField;
    if (fills) box.max().z() = std::max(box.max().z(), surface.box().max().z());
    std::vector<std::int32_t> near;
    surface.near(box, near);
    for (const std::int32_t number : near) {
        const Terrain::Triangle& triangle = surface.triangles()[static_cast<std::size_t>(number)];
        const double height = surface.height(triangle, x) - solid.radius;
        if (height > tolerance || (!fills && height < -tolerance)) continue;
        const Vector3d foot = x - (height + solid.radius) * triangle.normal;
        if ((surface.nearest(triangle, foot) - foot).norm() <= tolerance) f(triangle, height, foot);
    }
}

/// Calls f(tail, head, triangle, k) for the sharp edges of a triangle that its point foot lies on up to tolerance.
template <class F>
void for_each_sharp_edge(const Terrain& surface, const Terrain::Triangle& triangle, const Vector3d& foot,
                         double tolerance, F&& f) {
    for (std::size_t k = 0; k < 3; ++k) {
        if (triangle.sharp_edge[k] < 0) continue;
        const Vector3d& tail = surface.vertices()[static_cast<std::size_t>(triangle.corners[k])];
        const Vector3d& head = surface.vertices()[static_cast<std::size_t>(triangle.corners[(k + 1) % 3])];
        if (triangle.inward[k].dot(foot - tail) <= tolerance) f(tail, head, k);
    }
}

/// covers() for a terrain and a point of its frame. Beyond a rim it has no surface: there its cone ends.
bool terrain_covers(const Solid& solid, const Vector3d& x, const Vector3d& n, double tolerance) {
    Sides sides;
    bool holds = false;
    for_each_triangle(solid, x, tolerance, [&](const Terrain::Triangle& triangle, double height, const Vector3d& foot) {
        holds = true;
        if (height < -tolerance) return;
        sides.add(triangle.normal);
        for_each_sharp_edge(*solid.terrain, triangle, foot, tolerance,
                            [&](const Vector3d&, const Vector3d&, std::size_t k) {
                                if (triangle.kinds[k] == Terrain::EdgeKind::Rim) sides.add(-triangle.inward[k]);
                            });
    });
    return holds && !in_cone(sides, n);
}

bool covers(const Placed& by, const Vector3d& point, const Vector3d& n, double tolerance) {
    const Vector3d x = by.rotation.transpose() * (point - by.position);
    if (by.solid->terrain) return terrain_covers(*by.solid, x, by.rotation.transpose() * n, tolerance);
    Sides sides;
    bool holds = true;
    for_each_side(*by.solid, x, [&](const Vector3d& normal, double height) {
        holds = holds && height <= tolerance;
        if (height >= -tolerance) sides.add(normal);
    });
    return holds && !in_cone(sides, by.rotation.transpose() * n);
}

bool is_within(const Placed& by, const Vector3d& point, double distance) {
    const Vector3d x = by.rotation.transpose() * (point - by.position);
    if (by.solid->terrain) {
        AlignedBox3d box = by.solid->terrain->box();
        if (by.solid->kind == ShapeKind::HeightField) box.min().z() = std::min(box.min().z(), x.z());
        return box.squaredExteriorDistance(x) <= distance * distance;
    }
    bool within = true;
    for_each_side(*by.solid, x, [&](const Vector3d&, double height) { within = within && height <= distance; });
    return within;
}

/// How far it is from a point inside to a side of a solid, but for one that faces against n, m.
double depth_across(const Placed& in, const Vector3d& point, const Vector3d& n) {
    const Vector3d against = in.rotation.transpose() * -n;
    double least = std::numeric_limits<double>::infinity();
    for_each_side(*in.solid, in.rotation.transpose() * (point - in.position),
                  [&](const Vector3d& normal, double height) {
                      if (normal.dot(against) < kFlatCosine) least = std::min(least, -height);
                  });
    return std::isfinite(least) ? std::max(least, 0.0) : 0.0;
}

/// any_near() for a terrain. Its triangles are open.
template <class Open>
bool any_near_on_terrain(const Solid& solid, const Vector3d& x, const Vector3d& d, double tolerance, double near,
                         Open&& open) {
    bool found = false;
    for_each_triangle(solid, x, tolerance, [&](const Terrain::Triangle& triangle, double, const Vector3d& foot) {
        found = found || triangle.normal.dot(d) > kFlatCosine;
        for_each_sharp_edge(
            *solid.terrain, triangle, foot, tolerance, [&](const Vector3d& tail, const Vector3d& head, std::size_t) {
                const Vector3d along = (head - tail).normalized();
                if (std::abs(along.dot(d)) > kFlatAngle) return;
                const double ahead = std::min(near, along.dot(head - foot));
                const double behind = std::min(near, along.dot(foot - tail));
                found = found || (ahead > 0.0 && open(x + ahead * along)) || (behind > 0.0 && open(x - behind * along));
            });
    });
    return found;
}

/// Whether one of the points of a shape's feature near x, which d is normal to, is open; x and d in its frame.
template <class Open>
bool any_near(const Solid& solid, const Vector3d& x, const Vector3d& d, double tolerance, double near, Open&& open) {
    if (solid.terrain) return any_near_on_terrain(solid, x, d, tolerance, near, open);
    // As far as the solid goes, in a plane of one of its sides or along an edge.
    const auto open_towards = [&](const Vector3d& direction) {
        double way = near;
        for_each_side(solid, x, [&](const Vector3d& normal, double height) {
            const double rise = normal.dot(direction);
            if (rise > 1e-12) way = std::min(way, std::max(-height, 0.0) / rise);
        });
        return way > 0.0 && open(x + way * direction);
    };
    Sides sides;
    Vector3d face = Vector3d::Zero();
    for_each_side(solid, x, [&](const Vector3d& normal, double height) {
        if (height < -tolerance) return;
        sides.add(normal);
        if (normal.dot(d) > kFlatCosine) face = normal;
    });
    if (!face.isZero(0.0)) {
        constexpr int directions = 8;
        const Vector3d u = face.unitOrthogonal(), v = face.cross(u);
        for (int k = 0; k < directions; ++k) {
            const double angle = 2.0 * std::numbers::pi * k / directions;
            if (open_towards(std::cos(angle) * u + std::sin(angle) * v)) return true;
        }
        // A corner may be sharper than that.
        for (const Polytope::Face& one : solid.core.faces) {
            if (one.normal.dot(face) <= kFlatCosine) continue;
            for (const std::int32_t corner : one.loop) {
                Vector3d to = solid.core.vertices[static_cast<std::size_t>(corner)] - x;
                to -= to.dot(face) * face;
                if (const double length = to.norm(); length > tolerance && open_towards(to / length)) return true;
            }
        }
        return false;
    }
    for (std::size_t i = 0; i < sides.count; ++i) {
        for (std::size_t j = i + 1; j < sides.count; ++j) {
            Vector3d along = sides.normals[i].cross(sides.normals[j]);
            if (along.norm() < kFlatAngle) continue;
            along.normalize();
            if (std::abs(along.dot(d)) <= kFlatAngle && (open_towards(along) || open_towards(-along))) return true;
        }
    }
    if (sides.count == 1 && solid.kind == ShapeKind::Cylinder)
        return open_towards(Vector3d::UnitZ()) || open_towards(-Vector3d::UnitZ());
    return false;
}

}  // namespace

bool has_flat_faces(const Solid& solid) {
    return solid.kind == ShapeKind::Box || solid.kind == ShapeKind::Cylinder || solid.kind == ShapeKind::Convex ||
           solid.kind == ShapeKind::Plane || solid.terrain;
}

bool is_covered(const Placed& shape, std::span<const Placed* const> neighbours, const Vector3d& point,
                const Vector3d& n, double other) {
    constexpr std::size_t most = 16;
    const Solid& solid = *shape.solid;
    if (neighbours.empty() || !has_flat_faces(solid) || solid.kind == ShapeKind::Plane) return false;
    const auto tolerance_with = [&](const Placed& neighbour) {
        double least = std::numeric_limits<double>::infinity();
        for (const double reach : {other, solid.reach, neighbour.solid->reach})
            if (reach > 0.0) least = std::min(least, reach);  // 0: of planes and terrains
        return kFlush * least;
    };
    double tolerance = 0.0, buried = 0.0;
    for (const Placed* by : neighbours) {
        const double own = tolerance_with(*by);
        if (!covers(*by, point, n, own)) continue;
        tolerance = std::max(tolerance, own);
        buried = std::max(buried, depth_across(*by, point, n));
    }
    if (tolerance == 0.0) return false;
    const double near = std::max(10.0 * tolerance, 2.0 * buried);
    std::array<const Placed*, most> close;
    std::size_t count = 0;
    for (const Placed* by : neighbours)
        if (count < most && is_within(*by, point, tolerance + near)) close[count++] = by;
    const auto open = [&](const Vector3d& x) {
        const Vector3d at = shape.position + shape.rotation * x;
        return std::none_of(close.begin(), close.begin() + static_cast<std::ptrdiff_t>(count),
                            [&](const Placed* by) { return covers(*by, at, n, tolerance_with(*by)); });
    };
    const Matrix3d to_shape = shape.rotation.transpose();
    return !any_near(solid, to_shape * (point - shape.position), to_shape * n, tolerance, near, open);
}

}  // namespace delassus::collision
