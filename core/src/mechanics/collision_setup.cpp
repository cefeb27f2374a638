// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/collision_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "delassus/error.hpp"

namespace delassus {
namespace {

struct KindRow {
    ShapeKind kind;
    const char* name;
    std::size_t sizes;  ///< how many entries of size are used
};

constexpr std::array<KindRow, 6> kKinds{{{ShapeKind::Sphere, "sphere", 1},
                                         {ShapeKind::Box, "box", 3},
                                         {ShapeKind::Capsule, "capsule", 2},
                                         {ShapeKind::Cylinder, "cylinder", 2},
                                         {ShapeKind::Plane, "plane", 0},
                                         {ShapeKind::Convex, "convex", 0}}};

bool finite(std::span<const double> values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

void check_mesh(const Mesh& mesh, const std::string& who) {
    const auto count = static_cast<std::int32_t>(mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!finite(mesh.vertices[i]))
            throw InputError(fmt::format("{}: vertex {} of the mesh is not finite.", who, i));
    }
    std::set<std::pair<std::int32_t, std::int32_t>> directed;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& triangle = mesh.triangles[i];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t tail = triangle[k], head = triangle[(k + 1) % 3];
            if (tail < 0 || tail >= count || tail == head) {
                throw InputError(fmt::format(
                    "{}: triangle {} of the mesh has the vertices {}, {}, {}; they should be three different "
                    "numbers from 0 to {}.",
                    who, i, triangle[0], triangle[1], triangle[2], count - 1));
            }
            if (!directed.emplace(tail, head).second) {
                throw InputError(fmt::format(
                    "{}: two triangles of the mesh run from vertex {} to {}; neighbours should run along their edge in "
                    "opposite directions, all triangles counter-clockwise from outside.",
                    who, tail, head));
            }
        }
    }
    for (const auto& [tail, head] : directed) {
        if (!directed.contains({head, tail})) {
            throw InputError(
                fmt::format("{}: the mesh is open at the edge from vertex {} to {}; it should be a closed "
                            "surface.",
                            who, tail, head));
        }
    }
    // Six times the volume is the sum of determinants over the triangles, about any point; the size is for rounding.
    double volume = 0.0, size = 0.0;
    for (const auto& triangle : mesh.triangles) {
        std::array<Vector3, 3> edge;
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t i = 0; i < 3; ++i) {
                edge[k][i] = mesh.vertices[triangle[k]][i] - mesh.vertices[0][i];
                size = std::max(size, std::abs(edge[k][i]));
            }
        }
        volume += edge[0][0] * (edge[1][1] * edge[2][2] - edge[1][2] * edge[2][1]) +
                  edge[0][1] * (edge[1][2] * edge[2][0] - edge[1][0] * edge[2][2]) +
                  edge[0][2] * (edge[1][0] * edge[2][1] - edge[1][1] * edge[2][0]);
    }
    if (!(std::abs(volume) > 1e-12 * size * size * size))
        throw InputError(fmt::format("{}: the mesh has no volume; its triangles should bound a solid.", who));
    if (volume < 0.0) {
        throw InputError(fmt::format(
            "{}: the triangles of the mesh run clockwise from outside; they should run counter-clockwise.", who));
    }
}

void check_shape(const Shape& shape, const std::string& who, const KindRow& row, const CollisionSetup& setup) {
    const auto bodies = static_cast<std::int32_t>(setup.fixed.size());
    if (shape.body < -1 || shape.body >= bodies) {
        throw InputError(fmt::format("{}: its body is {}; it should be from 0 to {}, or -1 for the world.", who,
                                     shape.body, bodies - 1));
    }
    const auto& orientation = shape.pose.orientation;
    const double norm =
        std::hypot(std::hypot(orientation[0], orientation[1]), std::hypot(orientation[2], orientation[3]));
    if (!finite(shape.pose.position) || !(std::abs(norm - 1.0) < 1e-6)) {
        throw InputError(
            fmt::format("{}: its pose should have a finite position and a quaternion of length 1, not {}.", who, norm));
    }
    double smallest = HUGE_VAL;
    for (std::size_t i = 0; i < row.sizes; ++i) {
        smallest = std::min(smallest, shape.size[i]);
        if (!(shape.size[i] > 0.0) || !std::isfinite(shape.size[i])) {
            throw InputError(
                fmt::format("{}: size {} is {} m; it should be positive and finite.", who, i, shape.size[i]));
        }
    }
    if (!(shape.margin >= 0.0) || !(shape.margin < smallest)) {
        throw InputError(
            fmt::format("{}: the margin is {} m; it should be at least 0 and smaller than {} m, the least "
                        "size of the shape.",
                        who, shape.margin, smallest));
    }
    if (shape.kind == ShapeKind::Plane && shape.body >= 0 && !setup.fixed[shape.body]) {
        throw InputError(fmt::format(
            "{}: body {} moves; planes are for fixed bodies and the world only, a box will do here.", who, shape.body));
    }
    if (shape.kind == ShapeKind::Convex) {
        if (shape.mesh == nullptr || shape.mesh->triangles.empty())
            throw InputError(fmt::format("{}: it has no mesh; a convex shape should have one.", who));
        check_mesh(*shape.mesh, who);
    }
}

}  // namespace

void check_collision_setup(const CollisionSetup& setup) {
    for (std::size_t i = 0; i < setup.shapes.size(); ++i) {
        const auto row = std::find_if(kKinds.begin(), kKinds.end(),
                                      [&](const KindRow& entry) { return entry.kind == setup.shapes[i].kind; });
        if (row == kKinds.end()) throw InputError(fmt::format("Shape {} has a kind that does not exist.", i));
        check_shape(setup.shapes[i], fmt::format("Shape {} ({})", i, row->name), *row, setup);
    }
    const auto bodies = static_cast<std::int32_t>(setup.fixed.size());
    for (const auto& [first, second] : setup.apart) {
        if (std::min(first, second) < -1 || std::max(first, second) >= bodies) {
            throw InputError(fmt::format(
                "The pair of bodies ({}, {}) never to touch should be of numbers from 0 to {}, or -1 for the world.",
                first, second, bodies - 1));
        }
    }
}

}  // namespace delassus
