// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/collision_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "delassus/mesh_files.hpp"

namespace delassus {
namespace {

struct KindRow {
    ShapeKind kind;
    const char* name;
    std::size_t sizes;  ///< how many entries of size are used
};

constexpr std::array<KindRow, 8> kKinds{{{ShapeKind::Sphere, "sphere", 1},
                                         {ShapeKind::Box, "box", 3},
                                         {ShapeKind::Capsule, "capsule", 2},
                                         {ShapeKind::Cylinder, "cylinder", 2},
                                         {ShapeKind::Plane, "plane", 0},
                                         {ShapeKind::Convex, "convex", 0},
                                         {ShapeKind::Terrain, "terrain", 0},
                                         {ShapeKind::HeightField, "height field", 0}}};

bool finite(std::span<const double> values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
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
        throw InputError(
            fmt::format("{}: body {} moves; planes are for fixed bodies and the world only; use a box here.", who,
                        setup.name_of(shape.body)));
    }
    if (shape.kind == ShapeKind::Terrain || shape.kind == ShapeKind::HeightField) {
        if (shape.body >= 0 && !setup.fixed[shape.body]) {
            throw InputError(fmt::format(
                "{}: body {} moves; terrain is for fixed bodies and the world only; use convex shapes here.", who,
                setup.name_of(shape.body)));
        }
        if (shape.mesh == nullptr) throw InputError(fmt::format("{}: it has no mesh.", who));
        check_terrain(*shape.mesh, who);
    }
    if (shape.kind == ShapeKind::Convex) {
        if (shape.mesh == nullptr || shape.mesh->triangles.empty())
            throw InputError(fmt::format("{}: it has no mesh; a convex shape should have one.", who));
        check_closed_surface(*shape.mesh, who);
    }
}

}  // namespace

std::string CollisionSetup::name_of(std::int32_t body) const {
    const auto number = static_cast<std::size_t>(body);
    return number < names.size() ? fmt::format("\"{}\"", names[number]) : std::to_string(body);
}

void check_collision_setup(const CollisionSetup& setup) {
    for (std::size_t i = 0; i < setup.shapes.size(); ++i) {
        const auto row = std::find_if(kKinds.begin(), kKinds.end(),
                                      [&](const KindRow& entry) { return entry.kind == setup.shapes[i].kind; });
        if (row == kKinds.end()) throw InputError(fmt::format("Shape {} has a kind that does not exist.", i));
        check_shape(setup.shapes[i], fmt::format("Shape {} ({})", i, row->name), *row, setup);
    }
    if (!setup.group.empty() && setup.group.size() != setup.fixed.size()) {
        throw InputError(
            fmt::format("There are groups for {} bodies of {}; each body should have one, or no body should.",
                        setup.group.size(), setup.fixed.size()));
    }
    if (!setup.solid.empty() && setup.solid.size() != setup.fixed.size()) {
        throw InputError(
            fmt::format("There are solids for {} bodies of {}; each body should have one, or no body should.",
                        setup.solid.size(), setup.fixed.size()));
    }
    if (!setup.passing.empty() && setup.material.size() != setup.shapes.size()) {
        throw InputError(fmt::format("There are materials for {} shapes of {}; each shape should have one.",
                                     setup.material.size(), setup.shapes.size()));
    }
    const auto bodies = static_cast<std::int32_t>(setup.fixed.size());
    for (const auto& [first, second] : setup.apart) {
        if (std::min(first, second) < -1 || std::max(first, second) >= bodies) {
            throw InputError(fmt::format(
                "The pair ({}, {}) of bodies that never touch should have numbers from 0 to {}, or -1 for the world.",
                first, second, bodies - 1));
        }
    }
}

}  // namespace delassus
