// SPDX-License-Identifier: BSD-3-Clause
// Meshes and height fields.
//
// A surface of triangles (D, E, F) about a point p is a sum of pyramids with the volumes V = (c − p)·n A/3, c being a
// triangle's centre and n A its normal times its area. The mass centre of a pyramid is 3/4 c + 1/4 p, and its second
// moments about p, with D, E, F measured from p, are
//
//     S = V/20 (2 (D Dᵀ + E Eᵀ + F Fᵀ) + D Eᵀ + E Dᵀ + D Fᵀ + F Dᵀ + E Fᵀ + F Eᵀ),    J = tr(S) 1 − S.
//
// "exact" takes V with its sign, "legacy" its magnitude (p: the centroid of the surface), "convex" the hull's
// triangles, and "shell" has A in place of V and 12 in place of 20 (Eberly 2002, "Polyhedral mass properties", and
// MuJoCo's manual, which says what each of them is).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "delassus/error.hpp"
#include "importers/mjcf_spec.hpp"
#include "mechanics/convex_hull.hpp"
#include "model_import/mesh_reading.hpp"
#include "support/text_file.hpp"

namespace delassus::importers::mjcf {

namespace {

constexpr double smallest = 1e-15;  // m² and m³: what MuJoCo refuses as too small

using Triangles = std::vector<std::array<std::int32_t, 3>>;

struct Triangle {
    const Vector3d &a, &b, &c;
    [[nodiscard]] Vector3d centre() const { return (a + b + c) / 3.0; }
    [[nodiscard]] Vector3d normal_area() const { return 0.5 * (b - a).cross(c - a); }
};

Triangle triangle_of(const std::vector<Vector3d>& points, const std::array<std::int32_t, 3>& corners) {
    const auto at = [&](std::size_t k) -> const Vector3d& { return points[static_cast<std::size_t>(corners[k])]; };
    return {at(0), at(1), at(2)};
}

Vector3d centroid_of(const std::vector<Vector3d>& points, const Triangles& triangles, double& area) {
    Vector3d sum = Vector3d::Zero();
    area = 0.0;
    for (const auto& corners : triangles) {
        const Triangle one = triangle_of(points, corners);
        const double own = one.normal_area().norm();
        sum += own * one.centre();
        area += own;
    }
    return area > 0.0 ? Vector3d(sum / area) : sum;
}

/// Of density 1. Throws InputError where there is no volume or surface.
MassProperties mass_properties(const std::vector<Vector3d>& points, const Triangles& triangles, MeshInertia kind) {
    double area = 0.0;
    const Vector3d middle = centroid_of(points, triangles, area);
    if (area < smallest) throw InputError("its surface has no area");
    MassProperties result;
    const auto weigh = [&](const Triangle& one, const Vector3d& about) {
        if (kind == MeshInertia::Shell) return one.normal_area().norm();
        const double volume = (one.centre() - about).dot(one.normal_area()) / 3.0;
        return kind == MeshInertia::Legacy ? std::abs(volume) : volume;
    };
    double total = 0.0;
    Vector3d sum = Vector3d::Zero();
    for (const auto& corners : triangles) {
        const Triangle one = triangle_of(points, corners);
        const double weight = weigh(one, middle);
        total += weight;
        sum += weight * (kind == MeshInertia::Shell ? one.centre() : Vector3d(0.75 * one.centre() + 0.25 * middle));
    }
    if (total < smallest)
        throw InputError(total < 0.0 ? "its volume is negative: its triangles face inwards" : "it has no volume");
    result.centre = sum / total;
    Matrix3d S = Matrix3d::Zero();
    const double share = kind == MeshInertia::Shell ? 12.0 : 20.0;
    for (const auto& corners : triangles) {
        const Triangle one = triangle_of(points, corners);
        const double weight = weigh(one, result.centre);
        const Vector3d D = one.a - result.centre, E = one.b - result.centre, F = one.c - result.centre, all = D + E + F;
        result.mass += weight;
        S += weight / share * (all * all.transpose() + D * D.transpose() + E * E.transpose() + F * F.transpose());
    }
    result.inertia = S.trace() * Matrix3d::Identity() - S;
    if (!(result.mass >= smallest) || !(result.inertia.trace() > 0.0)) throw InputError("it has no volume");
    return result;
}

/// Vertices and faces in attributes of the element.
model_import::RawMesh inline_mesh(const XmlElement& element, const std::vector<double>& vertices) {
    model_import::RawMesh raw;
    if (vertices.size() % 3 != 0) element.refuse("the number of its vertex coordinates is no multiple of 3");
    for (std::size_t k = 0; k + 2 < vertices.size(); k += 3)
        raw.points.push_back(Vector3d(vertices.data() + k).cast<float>().cast<double>());
    const auto faces = element.numbers("face");
    if (!faces) return raw;
    if (faces->size() % 3 != 0) element.refuse("the number of its face corners is no multiple of 3");
    for (std::size_t k = 0; k + 2 < faces->size(); k += 3) {
        std::array<std::int32_t, 3> corners{};
        for (std::size_t i = 0; i < 3; ++i) {
            const double corner = (*faces)[k + i];
            if (!(corner >= 0.0 && corner < static_cast<double>(raw.points.size())))
                element.refuse(fmt::format("a face has vertex {}, and there are {}", corner, raw.points.size()));
            corners[i] = static_cast<std::int32_t>(corner);
        }
        raw.triangles.push_back(corners);
    }
    return raw;
}

}  // namespace

const Mesh::Hull& Mesh::hull() const {
    if (hull_) return *hull_;
    Hull& found = hull_.emplace();
    try {
        std::vector<Vector3> given;
        given.reserve(points.size());
        for (const Vector3d& point : points) given.push_back(model_import::array(point));
        const ConvexHull hull = convex_hull(given);
        for (const Vector3& vertex : hull.vertices) found.points.emplace_back(vertex.data());
        for (const auto& face : hull.faces)
            for (std::size_t k = 2; k < face.size(); ++k) found.triangles.push_back({face[0], face[k - 1], face[k]});
        if (found.points.empty()) found.trouble = "its points span no volume";
    } catch (const InputError& error) {
        found.trouble = error.what();
    }
    return found;
}

Mesh read_mesh(const XmlElement& element, const MeshDefaults& defaults, const std::filesystem::path& file) {
    Mesh mesh;
    MeshDefaults own = defaults;
    element.read("scale", own.scale.data(), 3, 3);
    if (const int kind = element.word("inertia", {"convex", "exact", "legacy", "shell"}); kind >= 0)
        own.inertia = static_cast<MeshInertia>(kind);
    Vector3d reference = Vector3d::Zero();
    element.read("refpos", reference.data(), 3, 3);
    std::array<double, 4> q = {1.0};
    element.read("refquat", q.data(), 4, 4);
    const Quaterniond turn(q[0], q[1], q[2], q[3]);
    mesh.inertia = own.inertia;
    const auto vertices = element.numbers("vertex");
    model_import::RawMesh raw;
    if (vertices) {
        raw = inline_mesh(element, *vertices);
    } else if (file.empty()) {
        mesh.trouble = element.find("builtin") != nullptr ? "it is made by a formula (builtin)" : "it has no file";
        return mesh;
    } else {
        try {
            if (!std::filesystem::is_regular_file(file)) throw InputError("the file is not there");
            raw = model_import::read_raw_mesh(file);
        } catch (const InputError& error) {
            mesh.trouble = error.what();
            return mesh;
        }
    }
    mesh.triangles = std::move(raw.triangles);
    for (const Vector3d& point : raw.points)
        mesh.points.push_back(own.scale.cwiseProduct(
            (turn.norm() > 0.0 ? turn.normalized().conjugate() : Quaterniond::Identity()) * (point - reference)));
    if (own.scale.prod() < 0.0)
        for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    try {
        const bool by_hull = mesh.triangles.empty() || mesh.inertia == MeshInertia::Convex;
        if (by_hull && mesh.hull().points.empty()) throw InputError(mesh.hull().trouble);
        mesh.unit = by_hull ? mass_properties(mesh.hull().points, mesh.hull().triangles, MeshInertia::Exact)
                            : mass_properties(mesh.points, mesh.triangles, mesh.inertia);
    } catch (const InputError& error) {
        mesh.trouble = error.what();
    }
    return mesh;
}

HeightField read_height_field(const XmlElement& element, const std::filesystem::path& file) {
    HeightField field;
    element.read("nrow", field.rows);
    element.read("ncol", field.columns);
    if (element.read("size", field.size.data(), 4, 4) == 0) element.refuse("it has no size");
    for (const double size : field.size)
        if (!(size > 0.0)) element.refuse("its size is to be four positive lengths");
    constexpr std::int64_t most = 4000000;
    const auto check = [&] {
        if (field.rows < 2 || field.columns < 2 || std::int64_t{field.rows} * field.columns > most)
            throw InputError(fmt::format("it has {} rows and {} columns", field.rows, field.columns));
    };
    try {
        if (!file.empty()) {
            if (!std::filesystem::is_regular_file(file)) throw InputError("its file is not there");
            if (file.extension() == ".png" || file.extension() == ".PNG") throw InputError("it is a picture in PNG");
            const std::string bytes = read_file(file);  // rows, columns, heights in single precision
            if (bytes.size() < 8) throw InputError("its file is too short");
            std::memcpy(&field.rows, bytes.data(), 4);
            std::memcpy(&field.columns, bytes.data() + 4, 4);
            check();
            const auto count = static_cast<std::size_t>(field.rows) * static_cast<std::size_t>(field.columns);
            if (bytes.size() != 8 + 4 * count) throw InputError("its file has another size than its head says");
            for (std::size_t k = 0; k < count; ++k) {
                float height = 0.0F;
                std::memcpy(&height, bytes.data() + 8 + 4 * k, 4);
                if (!std::isfinite(height)) throw InputError("a height is not finite");
                field.heights.push_back(static_cast<double>(height));
            }
        } else {
            check();
            const auto columns = static_cast<std::size_t>(field.columns), rows = static_cast<std::size_t>(field.rows);
            const auto given = element.numbers("elevation");
            if (given && given->size() != rows * columns)
                element.refuse(fmt::format("elevation has {} numbers in place of {}", given->size(), rows * columns));
            // On paper the row of the largest y comes first.
            for (std::size_t row = rows; row-- > 0;)
                for (std::size_t column = 0; column < columns; ++column)
                    field.heights.push_back(given ? (*given)[row * columns + column] : 0.0);
        }
    } catch (const InputError& error) {
        if (file.empty() && field.rows >= 2) throw;
        field.trouble = error.what();
        return field;
    }
    const auto [low, high] = std::minmax_element(field.heights.begin(), field.heights.end());
    const double from = *low, range = *high - *low;
    for (double& height : field.heights) {
        height -= from;
        if (range > 1e-14) height /= range;
    }
    return field;
}

}  // namespace delassus::importers::mjcf
